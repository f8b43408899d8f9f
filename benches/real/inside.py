#!/usr/bin/env python3
"""How often the intervals of `vibrissa locate` hold the distance: calibration judged by simulation (Talts et al. 2018).

    python3 benches/real/inside.py PROGRAM [--rigs 1000] [--seed 1] [--jobs 2] [--prior] > table.md

Every rig is drawn anew: its whisker, gain, offset of the angle, noise, and by how much runs differ in gain and zero, which is about as much as
the noise. It is calibrated on 6 runs of 18 taps, and asked for ten single taps, two objects of five taps, and two strokes with an unknown
touch, each in a run of its own. With --prior the noise, and what positions, visits and runs have of their own, are drawn from the priors of the
model (crates/learned/src/evidence.rs), as calibration by simulation wants it: then the intervals should hold what they say, but for the curve. The table says how many distances lie within the 68 and 95 % intervals, the 99 % interval of a binomial with as
many trials, and how often each of ten equal shares of the posterior holds the distance (with chi² of 9 degrees of freedom). Needs numpy, scipy
and the vibrissa package.
"""

import argparse
import concurrent.futures
import csv
import pathlib
import subprocess
import tempfile

import numpy as np
from scipy import stats

import vibrissa

SPEC = """[whisker]
D = {D}
d = {d}
L_a = 75
[gauge]
x_ss = 5
l = 2
[tap]
a = [20, 50]
theta = [1, 6]
[model]
surface = true
shear = true
extension = true
"""
ANGLES = [1.5, 3.0, 6.0]
# Median and spread in ln: noise, noise proportional to the signal, position, visit, gain and zero of a run.
PRIORS = [(2e-3, 2.0), (3e-3, 2.0), (1.5e-3, 2.0), (3e-3, 1.5), (3e-3, 1.5), (3e-3, 1.5)]


def write(path, names, rows):
    with open(path, "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(names)
        out.writerows([[x if isinstance(x, str) else repr(float(x)) for x in row] for row in rows])


def rig(program, seed, prior):
    """z of single taps and of objects, and whether the interval of 95 % holds them; parts of the posterior in which strokes lie, and whether the touch is
    within one sigma."""
    rng = np.random.default_rng(seed)
    D = rng.uniform(8, 12)
    d = D * rng.uniform(0.4, 0.9)
    gain, offset = 1 + 0.05 * rng.normal(), 0.05 * rng.normal()

    def strain(a, theta):
        eps = vibrissa.strain(D, d, 75.0, 5.0, 2.0, a, np.maximum(theta + offset, 1e-3), surface=True, shear=True, extension=True, precision="f64")
        return gain * np.asarray(eps)

    size = float(strain(35.0, 3.0))
    noise = size * 10 ** rng.uniform(-2.7, -1.9)
    runs = [noise / size * 10 ** rng.uniform(-0.15, 0.15), noise * 10 ** rng.uniform(-0.15, 0.15)]

    relative = position = visit = 0.0
    if prior:
        floor, relative, position, visit, *of_run = [m * np.exp(s * rng.normal()) for m, s in PRIORS]
        # Skip rigs too noisy to give a distance.
        if max(floor, relative, position, visit, *of_run) > 0.1:
            return None
        noise, runs = size * floor, [of_run[0], size * of_run[1]]

    def read(a, theta, stroke=False):
        """Readings in a new run."""
        g, z = 1 + runs[0] * rng.normal(), runs[1] * rng.normal()
        theta, a = np.asarray(theta), np.asarray(a)
        # Factor from the labelled to the true position of each object.
        own = {x: np.exp(np.hypot(position, visit) * rng.normal()) for x in np.unique(a)}
        y = np.where(theta > -offset, strain(np.minimum(a * np.vectorize(own.get)(a), 74.0), theta), 0.0)
        # One draw for the whole stroke.
        y = y * g * (1 + relative * rng.normal(size=a.shape if stroke else y.shape))
        return y + z + noise * rng.normal(size=y.shape)

    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: str(pathlib.Path(folder) / name)
        (pathlib.Path(folder) / "spec.toml").write_text(SPEC.format(D=D, d=d))
        rows = []
        for run in range(6):
            a = np.repeat(np.linspace(20, 50, 6) + rng.uniform(-1, 1), 3).clip(20, 50)
            theta = np.tile(ANGLES, 6)
            order = rng.permutation(18)
            rows += [[a[k], theta[k], y, f"r{run}"] for k, y in zip(order, read(a[order], theta[order]))]
        write(at("rows.csv"), ["a_mm", "theta_deg", "strain", "run"], rows)
        do = lambda *args: subprocess.run([program, *args, "--quiet"], check=True, capture_output=True, text=True)
        do("calibrate", at("rows.csv"), "--whisker", at("spec.toml"), "--out", at("cal"))

        def located(name, names, rows, *flags):
            write(at(name), names, rows)
            do("locate", at("cal/calibration.toml"), at(name), "--out", at(name + ".out"), *flags)
            return list(csv.DictReader(open(at(name + ".out/located.csv"))))

        number = lambda text: float(text) if text else np.nan
        singles = [(a, u, float(read(a, u))) for a, u in zip(rng.uniform(22, 48, 10), rng.uniform(1.5, 6, 10))]
        told = located("single.csv", ["true_mm", "theta_deg", "strain"], singles, "--interval")

        def judged(row, of):
            a, sigma, lo, hi = (number(row[of + c]) for c in ("distance_mm", "sigma_mm", "from_95_mm", "to_95_mm"))
            true = float(row["true_mm"])
            return (a - true) / sigma, lo < true < hi

        single = [judged(r, "") for r in told]

        taps = []
        for k in range(2):
            a, u = rng.uniform(22, 48), rng.uniform(1.5, 6, 5)
            taps += [(a, v, y, f"o{k}") for v, y in zip(u, read(a, u))]
        told = located("objects.csv", ["true_mm", "theta_deg", "strain", "object"], taps, "--interval")
        five = [judged(r, "object_") for r in told[4::5]]

        readings, truths = [], []
        for k in range(2):
            a, touch = rng.uniform(22, 48), rng.uniform(0.5, 2)
            u = np.linspace(0.1, 6.5, 25)
            # Contact begins at the drive where the true angle is zero.
            truths.append((a, touch - offset))
            readings += [(v, y, f"s{k}") for v, y in zip(u, read(a, u - touch, stroke=True))]
        told = located("strokes.csv", ["theta_deg", "strain", "stroke"], readings, "--strokes")
        strokes = []
        for (a, touch), row in zip(truths, told[24::25]):
            places = [number(row[c]) for c in ("from_95_mm", "from_68_mm", "stroke_distance_mm", "to_68_mm", "to_95_mm")]
            strokes.append((sum(a > x for x in places), abs(number(row["touch"]) - touch) < number(row["touch_sigma"]), "inconsistent" in row["stroke_status"]))
    return single, five, strokes


def line(name, n, inside, share):
    lo, hi = stats.binom.interval(0.99, n, share)
    return f"| {name} | {n} | {100 * inside / n:.1f} % | {100 * lo / n:.1f} … {100 * hi / n:.1f} % |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--rigs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--prior", action="store_true")
    args = parser.parse_args()
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        seeds = [args.seed * 1_000_000 + k for k in range(args.rigs)]
        program = str(pathlib.Path(args.program).resolve())
        results = list(pool.map(rig, [program] * args.rigs, seeds, [args.prior] * args.rigs, chunksize=8))
    results = [r for r in results if r]
    print(f"{len(results)} rigs\n")
    print("| | distances | inside | 99 % of a binomial |\n|---|---|---|---|")
    for name, k in (("single taps", 0), ("five taps", 1)):
        all_told = np.array([told for r in results for told in r[k]])
        told = all_told[~np.isnan(all_told[:, 0])]
        z, lost = told[:, 0], len(all_told) - len(told)
        for share, limit in ((0.682689, 1.0), (0.954500, 2.0)):
            print(line(f"{name}, {limit:.0f} σ", len(z), int((abs(z) < limit).sum()), share))
        print(line(f"{name}, 95 % interval", len(z), int(told[:, 1].sum()), 0.95))
        bins = np.histogram(stats.norm.cdf(z), np.linspace(0, 1, 11))[0]
        chi2 = float(((bins - len(z) / 10) ** 2 / (len(z) / 10)).sum())
        print(f"\n{name}: {lost} without an answer; tenths of the posterior {bins.tolist()}, chi² {chi2:.1f}; beyond 3 σ {100 * (abs(z) > 3).mean():.2f} %\n")
    strokes = [s for r in results for s in r[2]]
    n = len(strokes)
    rank = np.bincount([s[0] for s in strokes], minlength=6)
    print(line("strokes, 68 %", n, int(rank[2] + rank[3]), 0.682689))
    print(line("strokes, 95 %", n, int(rank[1:5].sum()), 0.95))
    print(line("their touch, 1 σ", n, sum(s[1] for s in strokes), 0.682689))
    expected = n * np.diff([0, 0.025, 0.158655, 0.5, 0.841345, 0.975, 1])
    print(f"\nstrokes: parts of the posterior {rank.tolist()}, expected {expected.round(0).astype(int).tolist()}, chi² {float(((rank - expected) ** 2 / expected).sum()):.1f} of 5; {sum(s[2] for s in strokes)} said to be inconsistent")


if __name__ == "__main__":
    main()
