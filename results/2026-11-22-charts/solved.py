#!/usr/bin/env python3
"""Taps with friction solved one by one, by two builds of the program in turn: CPU seconds of the whole process on one thread, sweeps, and how far
their strains and words are apart.

    solved.py BEFORE AFTER"""
import csv
import json
import os
import resource
import subprocess
import sys
import tempfile

N = 12_500
FULL = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"
MODELS = {
    "ideal": "",
    "practical": FULL,
    "extension, Coulomb 0.3": "extension = true\ncontact = { coulomb = 0.3 }",
    "practical, Coulomb 0.3": FULL + "contact = { coulomb = 0.3 }",
    "extension, stick": 'extension = true\ncontact = "stick"',
}


def spec(model):
    def axis(lo, hi):
        return f"{{ min = {lo}, max = {hi}, samples = {N} }}"

    return f"""[whisker]
D = {axis(8, 12)}
d = {axis(2, 7)}
L_a = 50
[gauge]
x_ss = 5
l = 2
[tap]
a = {{ from = 20, to = 48, steps = 8 }}
theta = {axis(0.5, 10)}
[model]
{model}
[output]
distances = false
"""


def sweep(program, text, folder, tolerance):
    path = os.path.join(folder, "spec.toml")
    with open(path, "w") as f:
        f.write(text)
    out = os.path.join(folder, "out")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    flags = ["--backend", "cpu", "--threads", "1", "--tolerance", tolerance, "--quiet", "--force"]
    subprocess.run([program, "sweep", path, "--out", out, *flags], check=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    with open(os.path.join(out, "run.json")) as f:
        counts = json.load(f)["counts"]
    with open(os.path.join(out, "tuples.csv")) as f:
        rows = [(float(row["strain"]), row["status"]) for row in csv.DictReader(f)]
    return seconds, counts, rows


def main():
    programs = [os.path.abspath(p) for p in sys.argv[1:3]]
    for tolerance in ["1e-5", "1e-6"]:
        for name, model in MODELS.items():
            with tempfile.TemporaryDirectory() as folder:
                runs = [[sweep(p, spec(model), folder, tolerance) for p in programs] for _ in range(2)]
            best = [min(run[k][0] for run in runs) for k in range(2)]
            counts = [c for _, c, _ in runs[0]]
            one, other = (rows for _, _, rows in runs[0])
            words = sum(a[1] != b[1] for a, b in zip(one, other, strict=True))
            apart = max(abs(a[0] - b[0]) / abs(a[0]) for a, b in zip(one, other, strict=True))
            told = ", ".join(
                f"{s:.2f} s ({c['sweeps_mean']:.1f} sweeps, {c['sweeps_max']:.0f} at most)" for s, c in zip(best, counts, strict=True)
            )
            print(f"{tolerance} {name}: {told}; {words} words differ, strains by {apart:.1e}", flush=True)


main()
