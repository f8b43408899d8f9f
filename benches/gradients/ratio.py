"""Time of a tap with its derivatives by d, a and θ relative to one without, f64, for several models. Prints a table.

    python benches/gradients/ratio.py [TAPS]
"""

import sys
import time

import numpy as np

import vibrissa
from models import MODELS

NAMES = "linear", "hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "yeoh", "solid"


def least(run, repeats=7):
    """CPU seconds."""
    run()
    seconds = []
    for _ in range(repeats):
        begun = time.process_time()
        run()
        seconds.append(time.process_time() - begun)
    return min(seconds)


def main(n=4000):
    g = np.random.default_rng(1)
    lows, highs = [8, 3, 50, 3, 1, 21, 0.5], [12, 8, 55, 8, 4, 45, 10]
    taps = dict(zip(("D", "d", "L_a", "x_ss", "l", "a", "theta"), g.uniform(lows, highs, (n, 7)).T))
    print("| model | CPU, µs a tap | with derivatives | ratio |\n|---|---|---|---|")
    for name in NAMES:
        model = MODELS[name]
        plain = least(lambda: vibrissa.strain(**taps, **model))
        both = least(lambda: vibrissa.strain(**taps, **model, grad=("d", "a", "theta")))
        print(f"| {name} | {1e6 * plain / n:.2f} | {1e6 * both / n:.2f} | {both / plain:.1f} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
