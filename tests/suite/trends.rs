//! What the paper reports, on its three whiskers (model §4).

use std::path::Path;

use crate::common::recount::check;
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, number, sweep};

/// Designs of `sweeps/prototypes.toml` by d, each a list of (θ, K_sd, K_mean, error_rms_mm).
fn prototypes(place: Place) -> Vec<Vec<[f64; 4]>> {
    let path = Path::new(crate::common::ROOT).join("sweeps/prototypes.toml");
    let swept = sweep(&std::fs::read_to_string(path).expect("the paper's sweep"), place);
    check(&swept, false);
    assert_eq!(swept.tuples.rows.len(), 330);
    let rows = swept.designs.rows.iter().map(|row| {
        assert_eq!(row["n"], "10", "{row:?}");
        ["theta_deg", "K_sd", "K_mean", "error_rms_mm"].map(|column| number(row, column).expect("a value"))
    });
    rows.collect::<Vec<_>>().chunks(11).map(<[_]>::to_vec).collect()
}

#[test]
fn the_prototypes_behave_as_published() {
    for place in [CPU, CPU_F64, GPU] {
        let [d4, d7, d10] = <[_; 3]>::try_from(prototypes(place)).expect("three whiskers");
        for whisker in [&d4, &d7, &d10] {
            assert!(whisker.windows(2).all(|w| w[0][1] < w[1][1]), "SD grows with the angle: {whisker:?}");
            assert!(whisker.windows(2).all(|w| w[0][2] < w[1][2]), "K grows with the angle: {whisker:?}");
            let best = whisker.iter().min_by(|a, b| a[3].total_cmp(&b[3])).expect("rows");
            assert_eq!(best[0], 0.5, "the best estimate is at half a degree");
        }
        for ((four, seven), ten) in d4.iter().zip(&d7).zip(&d10) {
            assert!(four[1] > seven[1] && seven[1] > ten[1], "{four:?} {seven:?} {ten:?}");
        }
    }
}
