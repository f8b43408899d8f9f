#!/usr/bin/env python3
"""Taps at the hard ends of the domain, read from charts where these hold, against the same taps in f64.

    hard_ends.py PROGRAM"""
import csv
import json
import os
import subprocess
import sys
import tempfile

N = 13_200
PRACTICAL = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"


def axis(lo, hi):
    return f"{{ min = {lo}, max = {hi}, samples = {N} }}"


def spec(tips, places, drive, model, rig="", side="", rest=""):
    return f"""[whisker]
D = 10
d = {axis(*tips)}
L_a = 50
{rig}
[gauge]
x_ss = {axis(*places)}
l = {axis(1, 4)}
{side}
[tap]
a = {{ from = 21, to = 48, steps = 10 }}
{drive}
[model]
{model}
{rest}
[output]
designs = false
distances = false
"""


def theta(most):
    return f"theta = {axis(0.5, most)}"


MOVED = f'drive = "displacement"\ndelta = {axis(0.2, 8)}'
CASES = {
    "practical": spec((2.5, 8), (0, 18), theta(20), PRACTICAL),
    "practical, fine tips": spec((1, 2.5), (3, 15), theta(20), PRACTICAL),
    "practical, thick tips": spec((8, 12), (0, 18), theta(10), PRACTICAL),
    "hub and pole": spec(
        (2.5, 8), (3, 18), theta(20), "surface = true\npole_radius = 2\nmaterial = { mooney-rivlin = [0.35, 0.15] }", "hub = 8"
    ),
    "displaced, far side": spec(
        (2.5, 8), (0, 15), MOVED, "extension = true\nmaterial = { yeoh = [0.5, -0.08, 0.02] }", side='side = "far"'
    ),
    "shear, Timoshenko's theory": spec((2.5, 8), (0.5, 18), theta(15), "shear = true", rest='[estimate]\ntheory = "timoshenko"'),
    "practical, Coulomb 0.2": spec((4, 8), (0, 15), theta(10), PRACTICAL + "contact = { coulomb = 0.2 }"),
}


def sweep(program, folder, precision):
    out = os.path.join(folder, precision)
    flags = ["--backend", "cpu", "--precision", precision, "--out", out, "--json"]
    ran = subprocess.run([program, "sweep", os.path.join(folder, "spec.toml"), *flags], check=True, capture_output=True)
    with open(os.path.join(out, "tuples.csv")) as f:
        rows = [(float(row["strain"] or "nan"), row["status"]) for row in csv.DictReader(f)]
    return json.loads(ran.stdout)["counts"], rows


def main():
    program = os.path.abspath(sys.argv[1])
    for name, text in CASES.items():
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "spec.toml"), "w") as f:
                f.write(text)
            (counts, got), (_, want) = (sweep(program, folder, p) for p in ["f32", "f64"])
        floor = 1e-3 * max(abs(strain) for strain, _ in want if strain == strain)
        pairs = [(a, b) for (a, _), (b, _) in zip(got, want, strict=True) if a == a and b == b]
        worst = max(abs(a - b) / max(abs(b), floor) for a, b in pairs)
        words = sum(a[1] != b[1] for a, b in zip(got, want, strict=True))
        read = counts["interpolated"] / counts["taps"]
        print(f"{name}: {read:.1%} of {counts['taps']} read, {len(pairs)} compared, worst {worst:.1e}, {words} words differ", flush=True)


main()
