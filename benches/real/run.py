#!/usr/bin/env python3
"""Measured data through `vibrissa calibrate`, compared with independent fits: errors on held-out positions.

    python3 benches/real/run.py DATA_FOLDER [PROGRAM] > table.md

DATA_FOLDER holds CSV files as `vibrissa calibrate` reads them (a_mm, perhaps delta_mm or theta_deg, one signal; rows with drive 0 or
below are zero readings). Needs numpy, scipy and scikit-learn. Positions and drives within 2 % of each other count as one for leaving out.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import warnings

import numpy as np
from scipy.optimize import least_squares
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

SIGNALS = ["strain", "microstrain", "bridge_mV_per_V", "reading"]


def load(path):
    """(a, drive, |signal| without zero) of each tap; drive 1 without a drive column."""
    rows = list(csv.DictReader(open(path)))
    drive = next((c for c in ("theta_deg", "delta_mm") if c in rows[0]), None)
    signal = next(c for c in SIGNALS if c in rows[0])
    number = lambda r, c: float(r[c])
    zero = [(i, number(r, signal)) for i, r in enumerate(rows) if drive and number(r, drive) <= 0]
    taps = [(i, number(r, "a_mm"), number(r, drive) if drive else 1.0, number(r, signal))
            for i, r in enumerate(rows) if not drive or number(r, drive) > 0]
    i, a, d, s = map(np.array, zip(*taps))
    if zero:
        s = s - np.interp(i, *zip(*zero))
    elif (s > 0).any() and (s < 0).any():
        # Without a zero reading, any value beyond all signals makes the fit smooth.
        rising = np.polyfit(d, s, 1)[0] > 0
        s = s - (s.min() - 0.1 * np.ptp(s) if rising else s.max() + 0.1 * np.ptp(s))
    return a, d, np.abs(s)


def grouped(x):
    """Number of the group of each value: neighbours within 2 %."""
    order = np.argsort(x)
    steps = np.diff(x[order]) > 0.02 * x[order][:-1]
    group = np.empty(len(x), int)
    group[order] = np.concatenate([[0], np.cumsum(steps)])
    return group


def quadratic(a, d, s, D, S):
    """a quadratic in ln s for each drive."""
    groups = grouped(np.concatenate([d, D]))
    mine, theirs = groups[: len(d)], groups[len(d):]
    fits = {g: np.polyfit(np.log(s[mine == g]), a[mine == g], 2) for g in np.unique(mine)}
    return np.array([np.polyval(fits[g], np.log(x)) for g, x in zip(theirs, S)])


def power(a, d, s, D, S):
    """a linear in ln s and ln d."""
    X = lambda d, s: np.stack([np.ones(len(s)), np.log(s), np.log(d)], 1)
    return X(D, S) @ np.linalg.lstsq(X(d, s), a, rcond=None)[0]


def cubic(a, d, s, D, S):
    """signal/drive a power of a cubic in 1/a, solved for a: a smooth forward model, inverted."""
    p = np.polyfit(1 / a, np.log(s / d), 3)
    grid = np.linspace(0.7 * a.min(), 1.3 * a.max(), 4000)
    f = np.polyval(p, 1 / grid)
    return np.array([grid[np.argmin(np.abs(f - y))] for y in np.log(S / D)])


def process(a, d, s, D, S):
    """A Gaussian process over (ln s, ln d)."""
    X = lambda d, s: np.stack([np.log(s), np.log(d)], 1)
    x = X(d, s)
    mean, sd = x.mean(0), np.where(x.std(0) > 0, x.std(0), 1)
    kernel = ConstantKernel(a.var()) * RBF([1.0, 1.0], (0.1, 1e3)) + WhiteKernel(0.1, (1e-4, 1e3))
    gp = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gp.fit((x - mean) / sd, a)
    return gp.predict((X(D, S) - mean) / sd)


def robust(a, d, s, D, S):
    """ln s = c + p ln(d + d0) − q ln a by soft-L1, solved for a."""
    r = lambda c: c[0] + c[1] * np.log(d + np.exp(c[3])) - c[2] * np.log(a) - np.log(s)
    c = least_squares(r, [np.log(s).mean(), 1.0, 1.0, -3.0], loss="soft_l1", f_scale=0.05).x
    return np.exp((c[0] + c[1] * np.log(D + np.exp(c[3])) - np.log(S)) / c[2])


def left_out(fit, a, d, s):
    """Root mean square error over all taps where each position is left out whole."""
    group, errors = grouped(a), np.empty(len(a))
    for g in np.unique(group):
        out = group == g
        errors[out] = fit(a[~out], d[~out], s[~out], d[out], s[out]) - a[out]
    return float(np.sqrt((errors**2).mean()))


def ours(path, program):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "cal"
        ran = subprocess.run([program, "calibrate", path, "--out", out, "--json"], capture_output=True, text=True)
        reply = json.loads(ran.stdout)
        if not reply["ok"]:
            return None
        return reply["result"]


def main():
    folder = pathlib.Path(sys.argv[1])
    program = sys.argv[2] if len(sys.argv) > 2 else "target/release/vibrissa"
    fits = [power, quadratic, cubic, robust, process]
    head = ["file", "taps", "default", "curve", "table", "paper"] + [f.__name__ for f in fits]
    head += ["within 1 σ (95 %)", "beyond 3 σ", "not used", "positions in the wrong order"]
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for path in sorted(folder.glob("*.csv")):
        a, d, s = load(path)
        found = ours(path, program)
        side = found["sides"][0]
        mm = lambda x: "–" if x is None or not np.isfinite(x) else f"{x:.2f}"
        one = side["estimators"]
        named = lambda n: mm(one[n]["held_out_rms_mm"]) + ("" if one[n]["answered"] == one[n]["asked"] else f" of {one[n]['answered']}") if one[n]["calibrated"] else "–"
        c = found["coverage"]["all"]
        cells = [path.stem, str(side["used"]), found["estimator"], named("curve"), named("table"), named("paper")]
        cells += [mm(left_out(f, a, d, s)) for f in fits]
        cells += [f"{100 * c['within_1']:.0f} % ({100 * c['interval'][0]:.0f} … {100 * c['interval'][1]:.0f})", f"{100 * c['beyond_3']:.1f} %"]
        cells += [str(len(a) - sum(s["used"] for s in found["sides"])), "; ".join(f"{x['a_mm'][0]:g}, {x['a_mm'][1]:g}" for x in side["contradictions"]) or "–"]
        print("| " + " | ".join(cells) + " |")
    print("\nRoot mean square error on positions left out whole, mm; of all taps unless a number of answered ones stands beside it.")
    print("\nBy position, of the default estimator: errors on that position left out, against the σ of `locate`.\n")
    print("| file | a_mm | taps | within 1 σ | 95 % | beyond 3 σ |")
    print("|---|---|---|---|---|---|")
    for path in sorted(folder.glob("*.csv")):
        for p in ours(path, program)["coverage"]["positions"]:
            lo, hi = (100 * x for x in p["interval"])
            print(f"| {path.stem} | {p['a_mm']:.2f} | {p['n']} | {100 * p['within_1']:.0f} % | {lo:.0f} … {hi:.0f} % | {100 * p['beyond_3']:.0f} % |")


main()
