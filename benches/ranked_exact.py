#!/usr/bin/env python3
"""Ranked sweeps read from charts against the same sweeps solved tap by tap in f64: rows that are kept, and status words.

    benches/ranked_exact.py PROGRAM [NAME …]          PROGRAM: a path to `vibrissa`; NAME: these variants alone

One line per variant: charts, their strain error, taps read, words whose counts differ, complete rows, rows that both keep, largest relative
difference of the column that ranks."""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

PRACTICAL = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"
BASE = dict(designs=4000, D=(8, 12), d=(2, 7), a="{ from = 21, to = 48, steps = 40 }", drive="theta", moved=(0.5, 10), drives=0,
            whisker="", gauge="", tap="", model=PRACTICAL, estimate="", by="K_sd", per="row")
GRID = dict(designs=400, drives=40)
TEN = dict(designs=400, drives=80, d=(2, 12), a="{ from = 21, to = 48, steps = 10 }")
PASSIVE = dict(drive="delta", moved=(0.3, 4), tap='drive = "displacement"\n')
VARIANTS = {
    "ideal": dict(model=""),
    "practical": {},
    "practical_total": dict(by="total_rms_mm"),
    "hub": dict(whisker="hub = 12\n"),
    "displacement": PASSIVE,
    "displacement_ideal": dict(PASSIVE, model="", by="error_max_mm"),
    "timoshenko": dict(model="shear = true\n", estimate='theory = "timoshenko"\n'),
    "pole_far_side": dict(model="pole_radius = 3\n", gauge='side = "far"\n'),
    "stick": dict(model=PRACTICAL + 'contact = "stick"\n'),
    "coulomb": dict(model=PRACTICAL + "contact = { coulomb = 0.3 }\n"),
    "elongation": dict(estimate='convention = "elongation"\n'),
    "given_K": dict(estimate="K = 1.0\n", by="total_rms_mm"),
    "grid": GRID,
    "grid_per_design": dict(GRID, per="design"),
    "grid_total": dict(GRID, model="", by="total_rms_mm"),
    "grid_ten_total": dict(TEN, model="", by="total_rms_mm"),
    "grid_ten_error": dict(TEN, by="error_rms_mm"),
    "grid_ten_noise": dict(TEN, by="noise_rms_mm"),
    "near_the_gauge": dict(a="{ from = 12, to = 49.9, steps = 40 }"),
    "slipping": dict(a="{ from = 21, to = 50, steps = 40 }", moved=(5, 25)),
    "slipping_ten": dict(designs=14000, a="{ from = 21, to = 50, steps = 10 }", moved=(5, 25)),
    "widening": dict(d=(6, 16)),
    "sharp": dict(d=(0.5, 3)),
    "repeated": dict(designs=9000, a="[21, 21, 22, 22, 23, 24, 25, 26, 27, 28, 30, 33, 36, 39, 41, 42, 43, 44, 45, 46, 47, 48, 48]"),
    "narrow": dict(a="{ from = 30, to = 30.5, steps = 40 }"),
}


def spec(v):
    axis = lambda ends: f"{{ min = {ends[0]}, max = {ends[1]}, samples = {v['designs']} }}"
    moved = f"{{ from = {v['moved'][0]}, to = {v['moved'][1]}, steps = {v['drives']} }}" if v["drives"] else axis(v["moved"])
    return (f"[whisker]\nD = {axis(v['D'])}\nd = {axis(v['d'])}\nL_a = 50\n{v['whisker']}[gauge]\nx_ss = {axis((3, 15))}\nl = 2\nnoise_strain = 2e-5\n"
            f"{v['gauge']}[tap]\na = {v['a']}\n{v['tap']}{v['drive']} = {moved}\n[estimate]\n{v['estimate']}[model]\n{v['model']}[output]\ntuples = false\n"
            f"distances = false\ntop = 50\nby = \"{v['by']}\"\nper = \"{v['per']}\"\n")


def swept(program, path, flags):
    """Counts, and each kept row's whisker and ranked value."""
    out = path.parent / "out"
    subprocess.run([program, "sweep", path, "--backend", "cpu", "--force", "--quiet", "--out", out, *flags], check=True, stderr=subprocess.DEVNULL)
    counts = json.loads((out / "run.json").read_text())["counts"]
    with open(out / "designs.csv", newline="") as file:
        return counts, list(csv.DictReader(file))


def main(program, *names):
    with tempfile.TemporaryDirectory() as work:
        path = pathlib.Path(work) / "spec.toml"
        for name in names or VARIANTS:
            v = {**BASE, **VARIANTS[name]}
            path.write_text(spec(v))
            (read, got), (solved, wanted) = (swept(program, path, flags) for flags in ([], ["--precision", "f64"]))
            column = next(c for c in wanted[0] if c.startswith(v["by"]))
            whisker = [c for c in wanted[0] if c in ("D_mm", "d_tip_mm", "x_ss_mm", "theta_deg", "delta_mm")]
            key = lambda row: tuple(row[c] for c in whisker)
            same = len({key(r) for r in got} & {key(r) for r in wanted})
            far = max(abs(float(x[column]) / float(y[column]) - 1) for x, y in zip(got, wanted))
            words = {w: read["status"].get(w, 0) - solved["status"].get(w, 0) for w in {**read["status"], **solved["status"]}}
            words = {w: n for w, n in words.items() if n} or "the same"
            chart = read.get("chart") or {}
            print(f"{name}: {chart.get('charts', 0)} charts, error {chart.get('strain_error', 0):.1e}, read {read['interpolated']} of {read['taps']}, words {words}, "
                  f"complete {read['complete_rows']} and {solved['complete_rows']}, kept by both {same} of {len(wanted)}, rank {far:.1e}", flush=True)


main(*sys.argv[1:])
