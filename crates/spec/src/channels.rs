//! `[sensor]` with several channels: a list of signals, or a matrix (model §7).

use std::sync::Arc;

use super::keys::Key;
use super::{Item, Result, Section, Sections};
use crate::scene::channels::{MOST_CHANNELS, SOURCES};
use crate::scene::{Channels, Setup, Signal, Theory};

const NOISE: &str = "one standard deviation > 0 for each channel, in its unit";

pub(super) fn several(section: &Section<'_>) -> bool {
    section.written("matrix").is_some()
        || section.written("signal").is_some_and(|signal| signal.elements().is_some())
}

pub(super) fn read_strain(signal: Option<Item<'_>>, matrix: Option<Item<'_>>) -> bool {
    let strain = |item: &Item<'_>| item.text().ok() == Some("strain");
    let fourth = |row: Item<'_>| row.elements().is_some_and(|row| row.len() == SOURCES);
    match (signal, matrix) {
        (Some(signal), _) => signal.elements().map_or(strain(&signal), |mut all| all.any(|one| strain(&one))),
        (None, Some(matrix)) => matrix.elements().is_some_and(|mut rows| rows.any(fourth)),
        (None, None) => true,
    }
}

pub(super) fn allowed(sections: &Sections<'_>, setup: &Setup, item: &Item<'_>) -> Result<()> {
    if setup.estimate.theory == Theory::Exact {
        let error = item.error("the distance is told by several channels and linear theory together");
        return Err(error.allowed("theory = \"euler-bernoulli\" or \"timoshenko\" in [estimate]"));
    }
    if let Some(robust) = sections.section("optimise").written("robust") {
        return robust.refuse("tolerances are those of one signal", "one signal, or no robust");
    }
    Ok(())
}

/// The channels, and the signal that stands for them where one is needed; `None` for a single signal.
pub(super) fn read(section: &Section<'_>) -> Result<Option<(Signal, Arc<Channels>)>> {
    if !several(section) {
        return section.written("covariance").map_or(Ok(None), |item| {
            let allowed = "noise, or several signals, or a matrix";
            item.refuse("a covariance is that of several channels", allowed)
        });
    }
    let (signal, matrix) = (section.written("signal"), section.written("matrix"));
    if let (Some(_), Some(matrix)) = (&signal, &matrix) {
        return matrix
            .refuse("the matrix names its channels itself; remove it or signal", "signal, or matrix");
    }
    let signals = signal.as_ref().map_or(Ok(Vec::new()), signals)?;
    let rows = matrix.as_ref().map_or(Ok(Vec::new()), rows)?;
    let Some(item) = signal.or(matrix) else { return Ok(None) };
    let n = signals.len().max(rows.len());
    let (covariance, place) = match (section.written("noise"), section.written("covariance")) {
        (Some(noise), Some(_)) => {
            return noise
                .refuse("the covariance has the noise of each channel already", "noise, or covariance");
        }
        (Some(item), None) => (Some(diagonal(&item, n)?), item),
        (None, Some(item)) => (Some(square(&item, n)?), item),
        (None, None) => (None, item.clone()),
    };
    let listed = rows.is_empty();
    let made = if listed { Channels::of(&signals, covariance) } else { Channels::matrix(rows, covariance) };
    let Some(channels) = made else {
        let allowed = section.known.key("covariance").map_or_else(String::new, Key::allowed);
        return place.refuse("this is the covariance of no noise: it is not positive definite", allowed);
    };
    let one = if channels.read_strain() { Signal::Strain } else { Signal::Moment };
    Ok(Some((one, Arc::new(channels))))
}

fn signals(item: &Item<'_>) -> Result<Vec<Signal>> {
    let mut all = Vec::new();
    for one in item.elements().into_iter().flatten() {
        let signal = one.word(&Signal::WORDS)?;
        one.wrong_if(all.contains(&signal), "this signal stands here twice")?;
        all.push(signal);
    }
    item.wrong_if(all.len() < 2, "a list needs at least two signals").map(|()| all)
}

fn rows(item: &Item<'_>) -> Result<Vec<[f64; SOURCES]>> {
    let Some(elements) = item.elements() else { return item.wrong("rows of numbers are needed") };
    let rows = elements.map(|row| match row.elements().map_or(0, |row| row.len()) {
        3 => row.numbers::<3>().map(|[m, x, y]| [m, x, y, 0.0]),
        4 => row.numbers::<4>(),
        width => row.wrong(format!("a row of {width} numbers is none of a channel")),
    });
    let rows = rows.collect::<Result<Vec<_>>>()?;
    let few = !(2..=MOST_CHANNELS).contains(&rows.len());
    item.wrong_if(few, format!("2 to {MOST_CHANNELS} rows of numbers are needed, not {}", rows.len()))?;
    let idle = rows.iter().position(|row| *row == [0.0; SOURCES]);
    idle.map_or(Ok(rows), |k| item.wrong(format!("row {} reads nothing", k + 1)))
}

fn diagonal(item: &Item<'_>, n: usize) -> Result<Vec<f64>> {
    let wrong = |count: usize| item.error(format!("{n} numbers are needed, not {count}")).allowed(NOISE);
    let elements = item.elements().ok_or_else(|| wrong(1))?;
    let values = elements.map(|e| Ok((e.number().map_err(|e| e.allowed(NOISE))?, e)));
    let values = values.collect::<Result<Vec<_>>>()?;
    if values.len() != n {
        return Err(wrong(values.len()));
    }
    let mut all = vec![0.0; n * n];
    for (k, (sigma, item)) in values.into_iter().enumerate() {
        item.refuse_if(sigma <= 0.0, "a standard deviation must be positive", NOISE)?;
        all[k * n + k] = sigma * sigma;
    }
    Ok(all)
}

fn square(item: &Item<'_>, n: usize) -> Result<Vec<f64>> {
    let shape = || item.error(format!("{n} rows of {n} numbers are needed")).allowed(item.allowed());
    let mut all = Vec::with_capacity(n * n);
    for row in item.elements().ok_or_else(shape)? {
        let row = row.elements().ok_or_else(shape)?;
        all.extend(row.map(|e| e.number()).collect::<Result<Vec<_>>>()?);
    }
    if all.len() != n * n || item.elements().is_none_or(|rows| rows.len() != n) {
        return Err(shape());
    }
    for i in 0..n {
        for j in 0..i {
            let (below, above) = (all[i * n + j], all[j * n + i]);
            let differ = (below - above).abs() > 1e-12 * below.abs().max(above.abs());
            let rows = format!("rows {} and {}", j + 1, i + 1);
            item.wrong_if(differ, format!("{rows} are not symmetric: {below} and {above}"))?;
        }
    }
    Ok(all)
}
