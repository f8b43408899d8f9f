#!/usr/bin/env python3
"""Whole processes of ranked sweeps, several programs in turn, and JAX beside them if there is one.

    benches/ranked.py OUT PROGRAM [PROGRAM …]          PROGRAM: a path to `vibrissa`, or NAME=PATH
    JAX=PYTHON benches/ranked.py …                     PYTHON: an interpreter with benches/peers/requirements.txt

Writes OUT/ranked.csv: for each sweep and program the fastest of three rounds, in seconds of wall time and of CPU, and 10⁶ taps/s. Every
round runs all programs on a sweep one after the other. The sweeps lie beside the table."""
import csv
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ROUNDS = 3
PEERS = pathlib.Path(__file__).parent / "peers"
PRACTICAL = "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"
FRICTION = PRACTICAL.replace("[model]\n", "[model]\ncontact = { coulomb = 0.3 }\n")
# Name: designs, distances, model, drives of each design (0: its own), ranked by.
SWEEPS = {
    "ideal": (4_000_000, 10, "", 0, "K_sd"),
    "practical": (4_000_000, 10, PRACTICAL, 0, "K_sd"),
    "friction": (500_000, 10, FRICTION, 0, "K_sd"),
    "practical_200": (2_000_000, 200, PRACTICAL, 0, "K_sd"),
    "practical_1000": (500_000, 1000, PRACTICAL, 0, "K_sd"),
    "practical_30": (2_000_000, 30, PRACTICAL, 0, "K_sd"),
    "ideal_gridded": (1_000_000, 10, "", 100, "K_sd"),
    "practical_gridded": (1_000_000, 10, PRACTICAL, 100, "K_sd"),
    "ideal_gridded_total": (1_000_000, 10, "", 100, "total_rms_mm"),
    "practical_gridded_total": (1_000_000, 10, PRACTICAL, 100, "total_rms_mm"),
}


def spec(designs, distances, model, drives, by):
    theta = f"{{ from = 0.5, to = 10, steps = {drives} }}" if drives else f"{{ min = 0.5, max = 10, samples = {designs} }}"
    return f"""[whisker]
D = {{ min = 8, max = 12, samples = {designs} }}
d = {{ min = 2, max = 7, samples = {designs} }}
L_a = 50
[gauge]
x_ss = {{ min = 3, max = 15, samples = {designs} }}
l = 2
noise_strain = 2e-5
[tap]
a = {{ from = 21, to = 48, steps = {distances} }}
theta = {theta}
{model}[output]
tuples = false
distances = false
top = 100
by = "{by}"
"""


def timed(program, path, out):
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([program, "sweep", path, "--backend", "cpu", "--force", "--quiet", "--out", out], check=True, stderr=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def jax(python, program, work):
    """Taps/s of the finer of the two JAX solutions."""
    out = work / "reference"
    subprocess.run([program, "sweep", PEERS / "taps.toml", "--backend", "reference", "--quiet", "--force", "--out", out], check=True)
    lines = subprocess.run([python, "peer_jax.py", out / "tuples.csv"], cwd=PEERS, capture_output=True, text=True, check=True).stdout
    return next(j["taps_per_second"] for j in map(json.loads, lines.splitlines()) if "24 steps" in j["name"])


def main(out, *programs):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    programs = dict(p.split("=", 1) if "=" in p else (pathlib.Path(p).name, p) for p in programs)
    with tempfile.TemporaryDirectory() as work, open(out / "ranked.csv", "w", newline="") as file:
        work = pathlib.Path(work)
        unit = [jax(os.environ["JAX"], next(iter(programs.values())), work) for _ in range(ROUNDS)] if "JAX" in os.environ else []
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["sweep", "program", "taps", "wall_s", "cpu_s", "million_taps_per_s", "over_jax"])
        if unit:
            table.writerow(["(every tap solved)", "JAX f32, RK4 24 steps x 8", "", "", "", f"{max(unit) / 1e6:.3g}", 1])
        for name, sweep in SWEEPS.items():
            path = out / f"{name}.toml"
            path.write_text(spec(*sweep))
            rounds = [{p: timed(program, path, work / "out") for p, program in programs.items()} for _ in range(ROUNDS)]
            taps = sweep[0] * sweep[1] * max(1, sweep[3])
            for p in programs:
                wall, cpu = (min(r[p][k] for r in rounds) for k in (0, 1))
                over = f"{taps / wall / max(unit):.0f}" if unit else ""
                table.writerow([name, p, taps, f"{wall:.3f}", f"{cpu:.3f}", f"{taps / wall / 1e6:.4g}", over])
                file.flush()
    print((out / "ranked.csv").read_text())


main(*sys.argv[1:])
