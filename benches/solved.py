#!/usr/bin/env python3
"""Seconds of solving 30 000 taps of each kind of whisker, one thread, several programs in turn. Prints a table.

    benches/solved.py NAME=PROGRAM [NAME=PROGRAM …]      PROGRAM: a path to `vibrissa`

The taps are those of 3 000 designs at ten distances, each design at a drive of its own; every tap is solved, and its distance estimated; only rows of designs are written. The seconds are
`seconds.solve` of run.json, the fewest of three rounds (ROUNDS=1: of one); the last column compares `seconds.total`, which has designs, rows and tables too. ONLY="root;core"
takes these kinds. EXTRA="--precision f64" adds flags."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROUNDS = int(os.environ.get("ROUNDS", 3))
EXTRA = os.environ.get("EXTRA", "").split()
DESIGNS = 3000
SPEC = """[whisker]
D = {{ min = 8, max = 12, samples = {n} }}
d = {{ min = 2, max = 7, samples = {n} }}
L_a = 50
{whisker}
[gauge]
x_ss = {{ min = 3, max = 15, samples = {n} }}
l = 2
[tap]
a = {{ from = 21, to = 45, steps = 10 }}
theta = {{ min = 0.5, max = 20, samples = {n} }}
{tap}
[model]
surface = true
shear = true
extension = true
{model}
[output]
tuples = false
distances = false
"""
NEO = "material = { neo-hookean = 3.2 }"
ROOT = "root = { k_theta = 942.5, k_y = 20 }"
# Lines of [whisker], [tap] and [model].
KINDS = {
    "cone": ("", "", NEO),
    "root": (ROOT, "", NEO),
    "core": ("core = { diameter = 0.5, modulus = 60000 }", "", ""),
    "curved": ("curvature = 0.004", "", NEO),
    "power profile": ("exponent = 0.7", "", NEO),
    "root, friction": (ROOT, "", "contact = { coulomb = 0.3 }"),
    "soft clamp and contact": ("", "", 'clamp = "bonded"\nindentation = true\npole_radius = 2'),
    "distorting sections": ("", "", 'clamp = "glued"\nsection = "distorting"'),
    "tilted pole": ("", "tilt = 20\nlean = 10", NEO),
}
ONLY = os.environ.get("ONLY", ";".join(KINDS)).split(";")


def solved(program, spec, out):
    command = [program, "sweep", spec, "--backend", "cpu", "--threads", "1", *EXTRA, "--force", "--quiet", "--out", out]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    seconds = json.loads((out / "run.json").read_text())["seconds"]
    return seconds["solve"], seconds["total"]


def main(*programs):
    programs = dict(p.split("=", 1) for p in programs)
    first = next(iter(programs))
    print("| whisker |", " | ".join(f"{p}, s" for p in programs), "| ratio | of totals |")
    print("|---" * (len(programs) + 3) + "|")
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        for name, (whisker, tap, model) in ((name, KINDS[name]) for name in ONLY):
            path = work / "taps.toml"
            path.write_text(SPEC.format(n=DESIGNS, whisker=whisker, tap=tap, model=model))
            rounds = [{p: solved(program, path, work / "out") for p, program in programs.items()} for _ in range(ROUNDS)]
            best = {p: [min(r[p][k] for r in rounds) for k in (0, 1)] for p in programs}
            ratios = " | ".join(f"{old / new:.2f}" for old, new in zip(best[first], best[list(programs)[-1]]))
            print(f"| {name} |", " | ".join(f"{best[p][0]:.3f}" for p in programs), f"| {ratios} |", flush=True)


main(*sys.argv[1:])
