#!/usr/bin/env python3
"""How well `vibrissa taps` reads raw records: random records of each kind, told by the program, against what they were made of.

    python3 benches/real/records.py PROGRAM [--records 60] [--seed 1] > table.md

A record has 3 to 11 taps of 0.15 to 1 times a size, ramps of 0.1 to 0.5 s, holds of 0.5 to 2 s and rests of 0.5 to 2 s, at 20, 100 or 1000 Hz, with noise of 1e-4 to
1e-2 of that size. A record is right if the taps are as many as they were, and each is right to 1.2 % of the size and twice the noise (where rubber creeps, or the
zero sways, to 6 %). Needs numpy.
"""

import argparse
import csv
import pathlib
import subprocess
import tempfile

import numpy as np

KINDS = {
    "as above": "", "both signs": "neg", "peaks of a sine": "peak", "holds of three samples": "short", "peaks of a triangle": "tri", "two touches in one": "double",
    "overshoot": "overshoot", "free vibration": "ringing", "creep of 5 %": "creep", "drift of 0.3 in all": "drift", "drift of 1 in all": "bigdrift", "a swaying zero": "sine",
    "hum of 1 %": "mains", "an end stop": "clip", "steps of 2 %": "quant", "ramps and rests of any length": "ragged", "with a drive": "theta",
}


def record(kind, r):
    """Samples, drives, levels and tolerance."""
    fs, n, noise = r.choice([20, 100, 1000]), int(r.integers(3, 12)), 10 ** r.uniform(-4, -2)
    x, drives, levels = [], [], []

    def add(of, seconds, drive=0):
        m = max(1, int(seconds * fs))
        x.extend(of(np.linspace(0, 1, m, endpoint=False)))
        drives.extend([drive] * m)

    add(lambda s: 0 * s, r.uniform(1, 3))
    for u in r.choice([1, 2, 3, 4], n):
        L = u / 4 * r.uniform(0.6, 1) * (r.choice([1, -1]) if kind == "neg" else 1)
        ramp, hold, rest = r.uniform(0.1, 0.5), r.uniform(0.5, 2), r.uniform(0.5, 2)
        if kind == "ragged":
            ramp, hold, rest = 10 ** r.uniform(-1.5, 0.3), 10 ** r.uniform(-0.7, 0.7), 10 ** r.uniform(-0.7, 0.5)
        hold = 3 / fs if kind == "short" else hold
        levels.append(L)
        if kind in ("peak", "tri"):
            add((lambda s: L * np.sin(np.pi * s)) if kind == "peak" else (lambda s: L * (1 - abs(2 * s - 1))), 2 * ramp + 0.5, u)
        else:
            add(lambda s: L * s * (1.2 if kind == "overshoot" else 1), ramp, u)
            swing = lambda s: 0.3 * np.exp(-s / 0.15) * np.sin(2 * np.pi * 8 * s)
            held = {"overshoot": lambda s: L * (1 + 0.2 * np.exp(-8 * s)), "ringing": lambda s: L * (1 + swing(s * hold)), "creep": lambda s: L * (1.05 - 0.05 * np.exp(-2 * s))}
            add(held.get(kind, lambda s: L + 0 * s), hold, u)
            if kind == "double":
                add(lambda s: L * (1 - 0.9 * np.sin(np.pi * s)), 0.3, u)
                add(lambda s: L + 0 * s, hold, u)
            add(lambda s: L * (1 - s), ramp, u)
            if kind == "creep":
                add(lambda s: 0.05 * L * np.exp(-5 * s), 1)
            if kind == "ringing":
                add(lambda s: -L * swing(s), 1)
        add(lambda s: 0 * s, rest)
    t = np.arange(len(x)) / fs
    share = t / t[-1]
    more = {"drift": 0.3 * share, "bigdrift": share, "sine": 0.05 * np.sin(3 * np.pi * share), "mains": 0.01 * np.sin(2 * np.pi * 50 * t + 1)}
    y = np.array(x) + more.get(kind, 0) + noise * r.normal(size=len(x))
    tolerance = 0.012 + 2 * noise + (0.05 if kind in ("creep", "sine", "bigdrift") else 0)
    if kind == "clip":
        y, levels = np.clip(y, -0.6, 0.6), list(np.clip(levels, -0.6, 0.6))
    if kind == "quant":
        y, tolerance = np.round(y * 50) / 50, tolerance + 0.01
    return t, y + r.normal() * r.choice([0, 1, 10]), drives, levels, tolerance


def judged(program, folder, kind, r):
    t, y, drives, levels, tolerance = record(kind, r)
    driven = kind == "theta"
    with open(folder / "r.csv", "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["t_s", "reading"] + ["theta_deg"] * driven)
        out.writerows([f"{a:.4f}", f"{b:.7g}"] + [c] * driven for a, b, c in zip(t, y, drives))
    ran = subprocess.run([program, "taps", str(folder / "r.csv"), "--out", str(folder / "o"), "--force", "--quiet"], capture_output=True, text=True)
    if ran.returncode:
        return "refused"
    rows = [row for row in csv.DictReader(open(folder / "o/readings.csv")) if row["kind"] != "rest"]
    if len(rows) != len(levels):
        return "number"
    off = max(abs(float(row["signal"]) - float(row["rest"]) - level) for row, level in zip(rows, levels))
    return "right" if off < tolerance else "level"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--records", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    print("| records | right | another number of taps | a level off | refused |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, kind) in enumerate(KINDS.items()):
            told = [judged(args.program, pathlib.Path(folder), kind, np.random.default_rng([args.seed, k, i])) for i in range(args.records)]
            print(f"| {name} | " + " | ".join(str(told.count(word)) for word in ("right", "number", "level", "refused")) + " |", flush=True)


if __name__ == "__main__":
    main()
