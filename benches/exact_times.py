#!/usr/bin/env python3
"""Whole processes that read the exact model elsewhere than in a ranked sweep, several programs in turn.

    benches/exact_times.py NAME=PATH [NAME=PATH …]          PATH: a `vibrissa`; ROUNDS=N: rounds, 3 without

`tap`: the best angle of one whisker, 200 distances and 400 angles. `theory exact`: a designs table of 20 000 sampled whiskers, 10 distances each, with
the model inverted. `locate exact`: 183 000 readings of a calibrated prototype, each program by its own calibration. Prints the fastest
round of each, in seconds of wall time and of CPU."""
import os
import pathlib
import random
import resource
import subprocess
import sys
import tempfile
import time

EXAMPLES = pathlib.Path(__file__).parent.parent / "examples"
MODEL = "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n"
REST = "[gauge]\nx_ss = {x_ss}\nl = 2\nnoise_strain = 1e-5\n[tap]\na = {a}\ntheta = {theta}\n"
TAP = "[whisker]\nD = 10\nd = 4\nL_a = 50\n" + REST.format(
    x_ss=5, a="{ from = 21, to = 48, steps = 200 }", theta="{ from = 0.5, to = 10, steps = 400 }") + MODEL
SAMPLED = "{{ min = {}, max = {}, samples = 20000 }}".format
EXACT = f"[whisker]\nD = {SAMPLED(8, 12)}\nd = {SAMPLED(2, 7)}\nL_a = 50\n" + REST.format(
    x_ss=SAMPLED(3, 15), a="{ from = 21, to = 48, steps = 10 }", theta=SAMPLED(0.5, 10)) + MODEL + (
    '[estimate]\ntheory = "exact"\n[output]\ntuples = false\n')


def readings(path):
    """183 000 taps between those of the prototype: its own rows, moved by up to 2 % of their signal."""
    rows = [line.split(",") for line in (EXAMPLES / "prototype-d4.csv").read_text().splitlines()[1:]]
    rows = [(float(r[1]), float(r[2])) for r in rows if float(r[1]) > 0]
    draw = random.Random(1)
    with open(path, "w") as f:
        f.write("theta_deg,strain\n")
        for k in range(183_000):
            theta, strain = rows[k % len(rows)]
            f.write(f"{theta},{strain * draw.uniform(0.98, 1.02)!r}\n")


def main():
    programs = dict(p.split("=", 1) for p in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        (here / "tap.toml").write_text(TAP)
        (here / "exact.toml").write_text(EXACT)
        readings(here / "readings.csv")
        for name, path in programs.items():
            data, whisker = EXAMPLES / "prototype-d4.csv", EXAMPLES / "prototype-d4.toml"
            subprocess.run([path, "calibrate", data, "--whisker", whisker, "--out", here / f"cal-{name}", "--quiet"], check=True)
        commands = {
            "tap": lambda name: ["tap", "tap.toml"],
            "theory exact": lambda name: ["sweep", "exact.toml"],
            "locate exact": lambda name: ["locate", f"cal-{name}/calibration.toml", "readings.csv", "--estimator", "exact"],
        }
        print("command,program,wall_s,cpu_s")
        for what, arguments in commands.items():
            best = {}
            for _ in range(int(os.environ.get("ROUNDS", 3))):
                for name, path in programs.items():
                    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                    subprocess.run([path, *arguments(name), "--out", "out", "--force", "--quiet"], cwd=here, check=True, stderr=subprocess.DEVNULL)
                    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
                    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
                    best[name] = min(best.get(name, (wall, cpu)), (wall, cpu))
            for name, (wall, cpu) in best.items():
                print(f"{what},{name},{wall:.3f},{cpu:.3f}", flush=True)


main()
