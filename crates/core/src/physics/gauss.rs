//! Gauss's rule of twelve points on one panel.

use super::real::Real;

/// Points of Gauss's rule on [−1, 1] and their weights: twelve, of which half are written.
const GAUSS: [[f64; 2]; 6] = [
    [0.125_233_408_511_468_9, 0.249_147_045_813_402_8],
    [0.367_831_498_998_180_2, 0.233_492_536_538_354_8],
    [0.587_317_954_286_617_4, 0.203_167_426_723_065_92],
    [0.769_902_674_194_304_7, 0.160_078_328_543_346_22],
    [0.904_117_256_370_474_9, 0.106_939_325_995_318_43],
    [0.981_560_634_246_719_2, 0.047_175_336_386_511_83],
];

/// Calls `f` with the places between `from` and `to`, and their weights.
pub fn each<T: Real>(from: T, to: T, mut f: impl FnMut(T, T)) {
    let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5);
    for [x, w] in GAUSS {
        f(middle - half * x, half * w);
        f(middle + half * x, half * w);
    }
}
