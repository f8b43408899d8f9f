//! Scores candidates from the solved taps of their nominal and sampled whiskers.

use std::sync::Arc;

use rayon::prelude::*;

use super::score::{self, Seen, continued, gather, normal, over};
use super::{Limit, Score};
use crate::census::Row;
use crate::chart::lanes::Figures;
use crate::curve::both::{self, Both};
use crate::curve::{Curve, Reach};
use crate::design::Design;
use crate::estimate::Estimator;
use crate::evaluate::{Outcome, Task};
use crate::physics::taper::Taper;
use crate::reduce::Spread;
use crate::scene::{COLUMNS, Calibrated, Column, Direction, Property, Robust, Search, Setup, Theory, Tuple};
use crate::statistics::{DriveRow, Told};

pub(super) struct Judge<'a> {
    pub setup: &'a Setup,
    pub search: &'a Search,
    pub distances: Arc<[f64]>,
    pub reach: [f64; 2],
    pub deviations: Vec<[f64; COLUMNS]>,
    /// Relative safety margin of the limits: the error of the kernel, so that a more accurate one also finds them kept.
    pub margin: f64,
}

/// Taps, and calibrating taps if [`Judge::blind`].
pub(super) type Taps<'s> = (&'s [Outcome], &'s [Outcome]);

/// Exact curves, and estimates from two strains.
pub(super) type Distances<'s> = (&'s [Option<Curve>], &'s [Option<Both>]);

impl Judge<'_> {
    /// True if each sampled whisker is calibrated at upright poles, but measures poles of unknown direction.
    pub fn blind(&self) -> bool {
        let each = self.search.robust.as_ref().filter(|r| r.calibrated == Calibrated::Each);
        !self.deviations.is_empty() && each.is_some_and(Robust::tilts)
    }

    pub fn tasks(&self, designs: &[Design]) -> Vec<Task> {
        let n = self.distances.len();
        let task =
            |t: usize| Task::of((t / n) as u32, &Tuple { a: self.distances[t % n], ..designs[t / n].tuple });
        (0..designs.len() * n).into_par_iter().map(task).collect()
    }

    /// Whisker `w` of a point: 0 is the nominal one, the others are samples.
    pub fn whisker(&self, point: &Tuple, w: usize) -> Tuple {
        let (Some(robust), Some(sample)) = (&self.search.robust, w.checked_sub(1)) else { return *point };
        let (mut values, z) = (point.to_array(), &self.deviations[sample]);
        for ((value, sd), z) in values.iter_mut().zip(&robust.sd).zip(z) {
            *value += sd * z;
        }
        let place = &mut values[Column::GaugePosition as usize];
        *place = place.max(0.0);
        Tuple::from_array(values).of_rig(point.rig)
    }

    /// The design of whisker `w` of a point; a sample has a separate rig if properties of the rig are sampled.
    pub fn design(&self, point: &Tuple, w: usize) -> Design {
        let mut tuple = self.whisker(point, w);
        let robust = self.search.robust.as_ref().filter(|robust| w > 0 && !robust.properties.is_empty());
        let Some(robust) = robust else { return Design::new(self.setup, tuple) };
        let rigs = self.setup.rigs.as_ref();
        let Some(mut own) = rigs.map_or(Some(self.setup.clone()), |rigs| rigs.setup(self.setup, point.rig))
        else {
            return Design::nothing(tuple);
        };
        for (dimension, (property, sd)) in (COLUMNS as u32..).zip(&robust.properties) {
            let scale =
                rigs.filter(|_| *property == Property::Scale).map(|rigs| rigs.value(point.rig, *property));
            let nominal = scale.filter(|scale| !scale.is_nan()).unwrap_or_else(|| property.get(&own));
            let value = inside(*property, nominal + sd * normal(self.search.seed, w as u32 - 1, dimension));
            if !property.about().range.holds(value) {
                return Design::nothing(tuple);
            }
            if *property == Property::Scale {
                (tuple.D, tuple.d) = (tuple.D * value / nominal, tuple.d * value / nominal);
                property.set(&mut own, value / nominal);
            } else {
                property.set(&mut own, value);
            }
        }
        Design::with(own, tuple)
    }

    /// The range over which the exact model's curve of whisker `w` is needed, for a pole of this direction; `None` if it is not needed.
    pub fn reach_of(&self, w: usize, direction: Direction) -> Option<Reach> {
        if self.setup.estimate.theory != Theory::Exact {
            return None;
        }
        let robust = self.search.robust.as_ref().filter(|_| !self.deviations.is_empty());
        let nominal = robust.is_some_and(|r| r.calibrated == Calibrated::Nominal);
        match (nominal, self.search.limits.unambiguous) {
            (true, _) if w == 0 => Some(Reach::Whole(self.reach)),
            (false, _) if !direction.is_upright() => Some(Reach::Whole(self.reach)),
            (_, true) => Some(Reach::Peak(self.reach)),
            (true, false) => None,
            (false, false) => Some(Reach::Asked(self.reach)),
        }
    }

    /// Request for the distance of `tap` from two strains, by the model of its whisker or of the nominal whisker (as calibrated). The lean is the
    /// nominal one.
    pub fn ask(&self, designs: &[Design], whiskers: usize, tap: Task, outcome: &Outcome) -> both::Ask {
        let mine = both::Ask::own(self.setup, tap, outcome, self.reach);
        let nominal = tap.design - tap.design % whiskers as u32;
        let lean = designs[nominal as usize].tuple.lean;
        let direction = Direction { lean, ..tap.direction };
        let robust = self.search.robust.as_ref().filter(|_| tap.design != nominal);
        match robust.map(|r| r.calibrated) {
            Some(Calibrated::Nominal) => {
                let drive = designs[nominal as usize].tuple.drive;
                both::Ask { tap: Task { design: nominal, direction, drive, ..tap }, own: false, ..mine }
            }
            Some(Calibrated::Each) if lean != tap.direction.lean => {
                both::Ask { tap: Task { direction, ..tap }, own: false, ..mine }
            }
            _ => mine,
        }
    }

    /// Score of a candidate: nominal whisker, then samples.
    pub fn score(&self, designs: &[Design], (taps, upright): Taps<'_>, (own, both): Distances<'_>) -> Score {
        let n = self.distances.len();
        let both = |w: usize| both.get(w * n..(w + 1) * n).unwrap_or_default();
        let (nominal, k) = score::read(self, &designs[0], (&taps[..n], both(0)), Told::by(own, 0), None);
        let Some(robust) = self.search.robust.as_ref().filter(|_| designs.len() > 1) else {
            return nominal;
        };
        let curve = |w: usize| own.get(w).and_then(Option::as_ref);
        let known = k.is_some() || curve(0).is_some();
        let of_nominal = Some(&designs[0]).filter(|_| robust.calibrated == Calibrated::Nominal && known);
        let calibration = of_nominal.and_then(|design| self.calibration(design, (k, None), curve(0)));
        let samples: Vec<Score> = (1..designs.len())
            .map(|w| {
                let taps = &taps[w * n..(w + 1) * n];
                let mine = upright.chunks(n).nth(w - 1).and_then(|upright| {
                    let taps = continued(upright);
                    let row = self.reduce(&designs[w], (&taps, &[]), Told::Formula, None);
                    self.calibration(&designs[w], (row.k, Some(row.deviation)), curve(w))
                });
                let calibration = mine.as_ref().or(calibration.as_ref());
                score::read(self, &designs[w], (taps, both(w)), Told::by(own, w), calibration).0
            })
            .collect();
        gather(robust, &nominal, &samples)
    }

    fn calibration<'d>(
        &self,
        design: &'d Design,
        (k, upright): (Option<f64>, Option<Spread>),
        curve: Option<&'d Curve>,
    ) -> Option<Calibration<'d>> {
        let estimator = Estimator::new(design.setup(self.setup), design.shared.as_ref()?, self.reach);
        Some(Calibration { estimator, k, drive: design.tuple.drive, curve, upright })
    }

    pub fn score_of_chart(&self, tuple: &Tuple, figures: &Figures) -> Score {
        let mut score = self.shape(tuple);
        let taper = Taper::new(tuple.D, tuple.d, tuple.L_a);
        let [x1, x2] = taper.gauge(tuple.x_ss, tuple.l);
        let row = &figures.row;
        let largest = row.figures().strain_max.unwrap_or(0.0);
        let nearest = self.distances.iter().copied().fold(figures.arc[0], f64::min);
        let [place, highest] = figures.peak;
        if row.complete() {
            score.figures = score::figures(self, row, x2 - x1, tuple.L_a);
        }
        self.limits(
            &mut score,
            &Seen {
                nearest: x1 / nearest,
                farthest: figures.arc[1] / tuple.L_a,
                strain: largest,
                reading: largest,
                force: row.figures().force_max.unwrap_or(0.0),
                unsolved: 0.0,
                highest: row.k.map(|k| (k, highest)),
                peak: place,
            },
        );
        score
    }

    pub fn gather(&self, scores: &[Score]) -> Score {
        match &self.search.robust {
            Some(robust) if scores.len() > 1 => gather(robust, &scores[0], &scores[1..]),
            _ => scores[0],
        }
    }

    pub fn shape(&self, tuple: &Tuple) -> Score {
        let mut score = Score::NOTHING;
        let farthest = self.distances.iter().copied().fold(0.0, f64::max);
        score.set(Limit::Gauge, over((tuple.x_ss + tuple.l) / tuple.L_a - 1.0));
        score.set(Limit::Reach, over(farthest / tuple.L_a - 1.0));
        if self.search.limits.tip_not_wider {
            score.set(Limit::Tip, tuple.d / tuple.D - 1.0);
        }
        score
    }

    pub fn limits(&self, score: &mut Score, seen: &Seen) {
        let limits = &self.search.limits;
        let share = |value: f64, most: f64| value * (1.0 + self.margin) / most - 1.0;
        score.set(Limit::Solved, if seen.unsolved > 0.0 { seen.unsolved } else { f64::NEG_INFINITY });
        score.set(Limit::NoStrain, seen.nearest - 1.0);
        score.set(Limit::Slipped, over(seen.farthest - 1.0));
        score.set(Limit::Strain, share(seen.strain, limits.strain));
        if let Some(force) = limits.force {
            score.set(Limit::Force, share(seen.force, force));
        }
        if let (Some((k, peak)), true) = (seen.highest, self.search.objective.needs_distance()) {
            score.set(Limit::Root, share(k * seen.reading, peak));
        }
        if limits.unambiguous {
            let range = self.setup.estimate.range.unwrap_or(self.reach);
            score.set(Limit::Unambiguous, 1.0 - range[0] / seen.peak);
        }
    }

    /// The designs row of one whisker. Distances come from `own`, from the calibration `given` of another whisker, or from two strains (`both`).
    pub fn reduce(
        &self,
        design: &Design,
        (taps, both): (&[Outcome], &[Option<Both>]),
        own: Told<'_>,
        given: Option<&Calibration<'_>>,
    ) -> DriveRow {
        let row = Row { point: design.tuple, distances: self.distances.clone(), reach: self.reach };
        let told = given.and_then(|other| other.curve).map_or(own, Told::Other);
        let told = told.towards(design.tuple.direction());
        let given = given.map(|other| (other.estimator, other.k, other.drive));
        let each = |i: usize| told.or_both(both.get(i));
        let (reduced, _) = row.reduced(self.setup, design, taps, each, given);
        reduced.drives[0]
    }
}

fn inside(property: Property, value: f64) -> f64 {
    match property {
        Property::Exponent => value.clamp(0.25, 4.0),
        Property::Nu => value.clamp(0.0, 0.5),
        Property::Bore | Property::Core | Property::Hub | Property::PoleRadius | Property::Friction => {
            value.max(0.0)
        }
        _ => value,
    }
}

/// Calibration by which readings become distances, if it is not the whisker's.
pub(super) struct Calibration<'a> {
    pub estimator: Estimator<'a>,
    k: Option<f64>,
    pub drive: f64,
    pub curve: Option<&'a Curve>,
    /// K − 1 of the calibrating taps, if these are other taps of the same whisker.
    pub upright: Option<Spread>,
}
