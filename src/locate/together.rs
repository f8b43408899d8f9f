//! What several taps of one object tell, as columns.

use super::Located;
use super::object::COLUMNS;
use super::stream::number;

/// What all taps of an object so far tell.
pub struct Together {
    pub(super) taps: usize,
    pub(super) located: Located,
    /// By two gauges the tilt and its standard deviation, degrees.
    pub(super) tilt: [f64; 2],
    pub(super) apart: Option<(usize, f64)>,
}

impl Together {
    /// Writes the columns, with those of two gauges and with the interval or without, each with a comma after it but for the last.
    pub fn write(this: Option<&Self>, [twofold, interval]: [bool; 2], out: &mut Vec<u8>) {
        let Some(Self { taps, located, tilt, apart }) = this else {
            let columns = COLUMNS.len() + 2 * usize::from(twofold) + 2 * usize::from(interval);
            out.extend(std::iter::repeat_n(b',', columns - 1));
            return;
        };
        number(out, *taps as f64);
        [located.distance, located.sigma].into_iter().for_each(|x| number(out, x));
        located.interval.iter().filter(|_| interval).for_each(|x| number(out, *x));
        tilt.iter().filter(|_| twofold).for_each(|x| number(out, *x));
        let (line, by) = apart.map_or((f64::NAN, f64::NAN), |(line, by)| (line as f64, by));
        number(out, line);
        // More digits than two of a number of standard deviations say nothing.
        number(out, (100.0 * by).round() / 100.0 + 0.0);
        out.extend(located.status.to_string().bytes());
    }
}
