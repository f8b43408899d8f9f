"""`vibrissa.strain` from Python: arrays in, array out, on all cores."""

import sys

import numpy as np

import vibrissa
from problem import Taps, best_time, report


def main(path):
    taps = Taps(path)
    whiskers = (taps.D, taps.d, taps.length, taps.place, taps.grid, taps.a, np.degrees(taps.theta))
    for precision in ("f32", "f64"):
        strain, seconds = best_time(lambda: vibrissa.strain(*whiskers, precision=precision))
        report(f"vibrissa from Python, cpu {precision}", taps, seconds, strain)


if __name__ == "__main__":
    main(sys.argv[1])
