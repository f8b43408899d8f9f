#!/usr/bin/env python3
"""Whole processes of ranked sweeps, several programs in turn, and JAX if it is installed.

    benches/ranked.py OUT PROGRAM [PROGRAM …]          PROGRAM: a path to `vibrissa`, or NAME=PATH
    JAX=PYTHON benches/ranked.py …                     PYTHON: an interpreter with benches/peers/requirements.txt
    ONLY=hooke,root,core benches/ranked.py …           these sweeps
    benches/ranked.py OUT "cpu=PATH" "gpu=PATH --backend gpu"      flags after the path; without any, --backend cpu

Writes OUT/ranked.csv: for each sweep and program the fastest of three rounds (ROUNDS=1: of one), in seconds of wall time and of CPU, and 10⁶ taps/s. Every
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

ROUNDS = int(os.environ.get("ROUNDS", 3))
PEERS = pathlib.Path(__file__).parent / "peers"
PRACTICAL = "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"
FRICTION = PRACTICAL.replace("[model]\n", "[model]\ncontact = { coulomb = 0.3 }\n")
HOOKE = PRACTICAL.replace("neo-hookean", "hooke")
SOBOL = "D = {{ min = 8, max = 12, samples = {n} }}\nd = {{ min = 2, max = 7, samples = {n} }}\nL_a = 50\n"
# Whiskers other than these cones, and the start of their gauges. Gauges of the profile lie between two of its knots.
WHISKERS = {
    "root": (SOBOL + "root = {{ k_theta = 942.5, k_y = 20 }}\n", (3, 15)),
    "core": (SOBOL + "core = {{ diameter = 0.5, modulus = 60000 }}\n", (3, 15)),
    "one_cone": ("D = 10\nd = 4\nL_a = 50\n", (11, 16)),
    "one_profile": ("profile = [[0, 10], [10, 8.9], [20, 7.6], [31, 6.5], [40, 5.1], [50, 4]]\n", (11, 16)),
}
# Name: designs, distances, model, drives of each design (0: its own), ranked by.
SWEEPS = {
    "ideal": (4_000_000, 10, "", 0, "K_sd"),
    "practical": (4_000_000, 10, PRACTICAL, 0, "K_sd"),
    "friction": (500_000, 10, FRICTION, 0, "K_sd"),
    "practical_200": (2_000_000, 200, PRACTICAL, 0, "K_sd"),
    "practical_1000": (500_000, 1000, PRACTICAL, 0, "K_sd"),
    "practical_30": (2_000_000, 30, PRACTICAL, 0, "K_sd"),
    "hooke": (4_000_000, 10, HOOKE, 0, "K_sd"),
    "root": (4_000_000, 10, PRACTICAL, 0, "K_sd"),
    "core": (4_000_000, 10, HOOKE, 0, "K_sd"),
    "one_cone": (4_000_000, 10, PRACTICAL, 0, "K_sd"),
    "one_profile": (4_000_000, 10, PRACTICAL, 0, "K_sd"),
    "practical_solved": (400_000, 10, PRACTICAL, 0, "K_sd"),
    "friction_solved": (100_000, 10, FRICTION, 0, "K_sd"),
    "practical_large": (40_000_000, 10, PRACTICAL, 0, "K_sd"),
    "practical_gridded_large": (10_000_000, 10, PRACTICAL, 100, "K_sd"),
    "ideal_gridded": (1_000_000, 10, "", 100, "K_sd"),
    "practical_gridded": (1_000_000, 10, PRACTICAL, 100, "K_sd"),
    "ideal_gridded_total": (1_000_000, 10, "", 100, "total_rms_mm"),
    "practical_gridded_total": (1_000_000, 10, PRACTICAL, 100, "total_rms_mm"),
}


def spec(designs, distances, model, drives, by, whisker=(SOBOL, (3, 15))):
    theta = f"{{ from = 0.5, to = 10, steps = {drives} }}" if drives else f"{{ min = 0.5, max = 10, samples = {designs} }}"
    shape, (first, last) = whisker
    return f"""[whisker]
{shape.format(n=designs)}[gauge]
x_ss = {{ min = {first}, max = {last}, samples = {designs} }}
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
    program, *flags = program.split()
    flags = flags or ["--backend", "cpu"]
    subprocess.run([program, "sweep", path, *flags, "--force", "--quiet", "--out", out], check=True, stderr=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def jax(python, program, work):
    """Taps/s of the finer of the two JAX solutions."""
    out = work / "reference"
    subprocess.run([program.split()[0], "sweep", PEERS / "taps.toml", "--backend", "reference", "--quiet", "--force", "--out", out], check=True)
    lines = subprocess.run([python, "peer_jax.py", out / "tuples.csv"], cwd=PEERS, capture_output=True, text=True, check=True).stdout
    return next(j["taps_per_second"] for j in map(json.loads, lines.splitlines()) if "24 steps" in j["name"])


def main(out, *programs):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    programs = dict(p.split("=", 1) if "=" in p else (pathlib.Path(p).name, p) for p in programs)
    with tempfile.TemporaryDirectory() as work, open(out / "ranked.csv", "w", newline="") as file:
        work = pathlib.Path(work)
        unit = [jax(os.environ["JAX"], next(iter(programs.values())), work) for _ in range(ROUNDS)] if os.environ.get("JAX") else []
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["sweep", "program", "taps", "wall_s", "cpu_s", "million_taps_per_s", "over_jax"])
        if unit:
            table.writerow(["(every tap solved)", "JAX f32, RK4 24 steps x 8", "", "", "", f"{max(unit) / 1e6:.3g}", 1])
        only = os.environ.get("ONLY", ",".join(s for s in SWEEPS if not s.endswith(("_large", "_solved")))).split(",")
        for name, sweep in ((name, SWEEPS[name]) for name in only):
            path = out / f"{name}.toml"
            path.write_text(spec(*sweep, *[WHISKERS[name]] if name in WHISKERS else []))
            rounds = [{p: timed(program, path, work / "out") for p, program in programs.items()} for _ in range(ROUNDS)]
            taps = sweep[0] * sweep[1] * max(1, sweep[3])
            for p in programs:
                wall, cpu = (min(r[p][k] for r in rounds) for k in (0, 1))
                over = f"{taps / wall / max(unit):.0f}" if unit else ""
                table.writerow([name, p, taps, f"{wall:.3f}", f"{cpu:.3f}", f"{taps / wall / 1e6:.4g}", over])
                file.flush()
    print((out / "ranked.csv").read_text())


main(*sys.argv[1:])
