//! Colours of figures and pages: distinct for every kind of sight, on white and on a page's dark ground.

use vibrissa::figure::LOOK;

type Linear = [f64; 3];

fn linear(text: &str) -> Linear {
    std::array::from_fn(|i| {
        let part = u8::from_str_radix(&text[2 * i + 1..2 * i + 3], 16).expect("hexadecimal digits");
        let c = f64::from(part) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
}

fn times(m: &[Linear; 3], v: Linear) -> Linear {
    m.map(|row| (0..3).map(|k| row[k] * v[k]).sum::<f64>().clamp(0.0, 1.0))
}

/// Machado, Oliveira and Fernandes (2009), severity 1: normal sight, protanopia, deuteranopia, tritanopia.
const SIGHT: [[Linear; 3]; 4] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
];

fn lab(rgb: Linear) -> Linear {
    let xyz = [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ];
    let white = [0.95047, 1.0, 1.08883];
    let f: Linear = std::array::from_fn(|i| {
        let x = (0..3).map(|k| xyz[i][k] * rgb[k]).sum::<f64>() / white[i];
        if x > 216.0 / 24389.0 { x.cbrt() } else { (24389.0 / 27.0 * x + 16.0) / 116.0 }
    });
    [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
}

/// Smallest CIELAB distance between two of `colours`, for each kind of sight.
fn least(colours: &[&str; 8]) -> [f64; 4] {
    SIGHT.map(|sight| {
        let seen = colours.map(|c| lab(times(&sight, linear(c))));
        let pairs = (0..8).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs
            .map(|(i, j)| (0..3).map(|k| (seen[i][k] - seen[j][k]).powi(2)).sum::<f64>().sqrt())
            .fold(f64::INFINITY, f64::min)
    })
}

#[test]
fn no_two_colours_look_the_same_to_any_reader() {
    // The colours were chosen by CIEDE2000; these are their plain CIELAB distances.
    let [white, dark] =
        [&LOOK.colours.light, &LOOK.colours.dark].map(|all| all.each_ref().map(String::as_str));
    for (colours, told) in [(white, [26.4, 17.9, 9.7, 16.1]), (dark, [42.6, 21.7, 18.8, 18.9])] {
        let found = least(&colours);
        assert!(found.iter().zip(told).all(|(x, told)| (x - told).abs() < 0.1), "{found:?}, told {told:?}");
    }
    let light = |c: Linear| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2] + 0.05;
    let ground =
        include_str!("../../pages/report/report.css").split("--ground: ").nth(2).expect("the dark ground");
    let map = LOOK.map.dark.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"));
    for (colours, least) in [(&dark[..], 4.5), (&map.each_ref().map(String::as_str)[..], 4.0)] {
        let contrasts = colours.iter().map(|c| light(linear(c)) / light(linear(&ground[..7])));
        assert!(contrasts.clone().all(|x| x >= least), "{:?}", contrasts.collect::<Vec<_>>());
    }
}
