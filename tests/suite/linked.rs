//! The exported program in C beside C++.

use std::path::Path;
use std::process::Command;

use crate::common::measuring::{prototype, table};
use crate::common::program::Desk;
use vibrissa::simulate::Settings;

/// A program that declares what `locate.c` defines.
const MAIN: &str = "#define VIBRISSA_DECLARATIONS_ONLY
#include \"cal/locate.c\"
#include <cstdio>
int main()
{
    double a, sigma, both, sigma_of_both;
    double signals[VIBRISSA_TAPS] = {0.0106, 0.0212};
    int status = vibrissa_locate(4.0, 0.0212, VIBRISSA_ZERO, &a, &sigma);
    status |= vibrissa_taps(signals, VIBRISSA_ZERO, &both, &sigma_of_both);
    std::printf(\"%.6f %.6f %d\\n\", a, both, status);
    return 0;
}
";

fn ran(folder: &Path, program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).current_dir(folder).args(arguments).output().expect("a compiler");
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_program_in_cpp_links_with_the_file_compiled_as_c() {
    let spec = prototype(
        10.0,
        &["noise_strain = 1e-5\n", "[tap]\na = [25, 30, 35, 40, 45, 48]\ntheta = [2, 4, 6]\n"],
    );
    let desk = Desk::new(&spec);
    desk.write(
        "data.csv",
        table(&spec, &Settings { noise: 1e-5, zero_every: Some(4), ..Settings::default() }),
    );
    let asked =
        ["calibrate", "data.csv", "--whisker", "spec.toml", "--export", "c", "--taps", "2,4", "--out", "cal"];
    desk.run(&asked).exits(0);
    desk.write("main.cpp", MAIN);
    desk.write("whole.cpp", MAIN.replace("#define VIBRISSA_DECLARATIONS_ONLY\n", ""));
    let folder = desk.path("");
    let strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];
    ran(&folder, "cc", &[&["-std=c99", "-c", "cal/locate.c", "-o", "locate.o"], &strict[..]].concat());
    ran(&folder, "c++", &[&["main.cpp", "locate.o", "-o", "linked"], &strict[..]].concat());
    ran(&folder, "c++", &[&["whole.cpp", "-o", "whole"], &strict[..]].concat());
    let answers = ["linked", "whole"].map(|name| ran(&folder, folder.join(name).to_str().unwrap(), &[]));
    assert_eq!(answers[0], answers[1]);
    let located = desk.pipe(&["locate", "cal/calibration.toml", "--zero", "0"], "4,0.0212\n").exits(0).stdout;
    let distance: f64 = located.lines().nth(1).unwrap().split(',').nth(2).unwrap().parse().unwrap();
    let exported: f64 = answers[0].split(' ').next().unwrap().parse().unwrap();
    assert!((distance - exported).abs() < 0.02, "{distance} {}", answers[0]);
}
