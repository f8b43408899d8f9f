#!/usr/bin/env python3
"""How many taps of a fixed grid of drives leave the σ that taps leave whose drives `vibrissa next` says.

    python3 benches/real/next.py > table.md

The paper's whisker (D 10, d 4, L_a 50, gauge of 2 mm at 5 mm) with a noise of 20 µε, calibrated in three runs at ten distances and seven angles.
Objects at three distances are tapped where `Locator.next` says, and by grids of angles that begin anew when they are through. Readings are those of the
model, so that σ is what is expected. Needs numpy and the vibrissa package."""

import numpy as np

import vibrissa

WHISKER, GAUGE = dict(D=10, d=4, L_a=50), dict(x_ss=5, l=2)
GRIDS = {"1, 2 … 10": range(1, 11), "the calibrated": (0.5, 1, 2, 4, 6, 8, 10), "2, 4, 6": (2, 4, 6)}
TAPS, MOST = 6, 60


def strain(a, theta):
    return np.asarray(vibrissa.strain(10, 4, 50, 5, 2, a, theta))


def main():
    rng = np.random.default_rng(3)
    a, theta = (np.tile(x.ravel(), 3) for x in np.meshgrid(np.arange(21, 49, 3), GRIDS["the calibrated"]))
    run = np.repeat([1, 2, 3], len(a) // 3)
    data = dict(a_mm=a, theta_deg=theta, strain=strain(a, theta) + 2e-5 * rng.normal(size=a.size), run=run)
    locator = vibrissa.Locator(vibrissa.calibrate(data, whisker=WHISKER, gauge=GAUGE))
    names = " | ".join(f"{name}°" for name in GRIDS)
    print(f"| a, mm | taps as `next` says | their θ, ° | σ, mm | taps of {names} |\n|---|---|---|---|{'---|' * len(GRIDS)}")
    for a in (24.0, 33.0, 45.0):
        sigmas = {}
        for name, grid in GRIDS.items():
            taps = [(float(grid[k % len(grid)]), float(strain(a, grid[k % len(grid)]))) for k in range(MOST)]
            sigmas[name] = [locator.next(taps[: k + 1]).sigma_mm for k in range(MOST)]
        taps = []
        for count in range(1, TAPS + 1):
            drive = locator.next(taps).drive
            taps.append((drive, float(strain(a, drive))))
            sigma = locator.next(taps).sigma_mm
            reached = [next((str(k + 1) for k, s in enumerate(sigmas[name]) if s <= sigma), f"over {MOST}") for name in GRIDS]
            print(f"| {a:.0f} | {count} | {drive:.2f} | {sigma:.4f} | {' | '.join(reached)} |")


if __name__ == "__main__":
    main()
