//! Drives of two signs: taps to the other side of the whisker.

use super::Data;

/// Rows with a drive below 0, at least.
const ROWS: usize = 3;
/// Signals at one drive lie on a line over 1/a² but for this share of their scatter.
const LEFT: f64 = 0.3;
/// Both sides give alike: slopes per drive differ by no more than this factor.
const ALIKE: f64 = 3.0;

/// `data` with drives above 0 alone, where those below 0 are taps to the other side: at one drive their signals change with the distance the other way. (Before contact they do not
/// change, and a slip of the sign changes them the same way.)
pub fn folded(data: &Data) -> Option<Data> {
    let below = slope(data, |drive| drive < 0.0).filter(|(_, rows)| *rows >= ROWS)?.0;
    let above = slope(data, |drive| drive > 0.0)?.0;
    let ratio = -below / above;
    if !(1.0 / ALIKE..ALIKE).contains(&ratio) {
        return None;
    }
    let mut data = data.clone();
    data.rows.iter_mut().for_each(|row| row.drive = row.drive.abs());
    Some(data)
}

/// By how much signals change with |drive|/a² at one drive, of rows whose drive is `wanted`, and of how many rows; `None` where they do not follow it.
fn slope(data: &Data, wanted: impl Fn(f64) -> bool) -> Option<(f64, usize)> {
    let mut drives = std::collections::BTreeMap::<u64, Vec<[f64; 2]>>::new();
    for row in data.rows.iter().filter(|r| wanted(r.drive) && r.a > 0.0 && r.value.is_finite()) {
        drives.entry(row.drive.to_bits()).or_default().push([row.drive.abs() / row.a.powi(2), row.value]);
    }
    let (mut sums, mut rows) = ([0.0; 3], 0);
    for all in drives.values() {
        let mean = |k: usize| all.iter().map(|p| p[k]).sum::<f64>() / all.len() as f64;
        let middle = [mean(0), mean(1)];
        for [x, y] in all {
            let (x, y) = (x - middle[0], y - middle[1]);
            sums = [sums[0] + x * x, sums[1] + x * y, sums[2] + y * y];
            rows += 1;
        }
    }
    let [xx, xy, yy] = sums;
    let left = 1.0 - xy * xy / (xx * yy);
    (left <= LEFT).then(|| (xy / xx, rows))
}
