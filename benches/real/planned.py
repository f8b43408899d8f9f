#!/usr/bin/env python3
"""A planned calibration against even grids of the same taps, on measured data: what both leave in a run that neither has seen.

    python3 benches/real/planned.py PROGRAM DATA.csv [--contact DRIVE] > table.md

DATA.csv has the columns a_mm, delta_mm, reading and run, each run with all positions and drives. One run is left out after the other; PROGRAM plans
taps for a bar that is pushed between the same distances and drives (drives from DRIVE on, where contact begins), with more and more taps. Each planned
tap is taken from the nearest measured position, each even grid from positions evenly apart, all or some of the drives, in both runs or by turns. Errors are
root mean squares over all taps of the run that was left out. Needs nothing but Python."""

import argparse
import csv
import itertools
import json
import math
import pathlib
import subprocess
import tempfile

SPEC = """[whisker]
D = 3
d = 3
L_a = {length}
[gauge]
x_ss = 5
l = 2
[sensor]
signal = "moment"
noise = 1e-4
[tap]
a = {{ from = {near}, to = {far}, steps = 7 }}
drive = "displacement"
delta = {drives}
"""


class Rig:
    def __init__(self, program, data, contact, folder):
        self.program, self.contact, self.folder = program, contact, folder
        with open(data) as file:
            lines = [line for line in file if not line.startswith("#")]
        rows = [{k: float(v) if k != "run" else v for k, v in row.items() if k in ("a_mm", "delta_mm", "reading", "run")} for row in csv.DictReader(lines)]
        self.zeros = [r for r in rows if r["delta_mm"] == 0.0]
        self.taps = [r for r in rows if r["delta_mm"] != 0.0]
        self.runs = sorted({r["run"] for r in rows})
        self.places = sorted({r["a_mm"] for r in self.taps})
        self.drives = sorted({r["delta_mm"] for r in self.taps})

    def run(self, *words):
        return subprocess.run([self.program, *map(str, words), "--force", "--quiet"], capture_output=True, text=True, cwd=self.folder)

    def write(self, name, rows):
        with open(pathlib.Path(self.folder) / name, "w") as file:
            writer = csv.DictWriter(file, ["a_mm", "delta_mm", "reading", "run"])
            writer.writeheader()
            writer.writerows(rows)

    def planned(self, error, runs):
        """Taps of the plan for this error, from the measured ones of these runs."""
        done = self.run("plan", "spec.toml", "--error", error, "--runs", len(runs), "--place", 0.2, "--relative", 0.01, "--gain", 0.003, "--out", "plan")
        if done.returncode:
            return None
        with open(pathlib.Path(self.folder) / "plan/plan.csv") as file:
            wanted = [r for r in csv.DictReader(line for line in file if not line.startswith("#")) if float(r["delta_mm"]) > 0]
        free, found = [r for r in self.taps if r["run"] in runs], []
        for tap in wanted:
            run, drive = runs[(int(tap["run"]) - 1) % len(runs)], float(tap["delta_mm"]) + self.contact
            own = [r for r in free if r["run"] == run and abs(r["delta_mm"] - drive) < 1e-6]
            if own:
                best = min(own, key=lambda r: abs(r["a_mm"] - float(tap["a_mm"])))
                free.remove(best)
                found.append(best)
        return found

    def even(self, positions, drives, runs, each):
        spread = lambda k, of, n: k * (n - 1) // (of - 1) if of > 1 else n - 1
        found = []
        for r, run in enumerate(runs):
            for k in range(positions):
                if each or k % len(runs) == r:
                    a = self.places[spread(k, positions, len(self.places))]
                    us = {self.drives[spread(j, drives, len(self.drives))] for j in range(drives)}
                    found += [t for t in self.taps if t["run"] == run and t["a_mm"] == a and t["delta_mm"] in us]
        return found

    def error(self, taps, runs, unseen):
        """Root mean square over the unseen run, mm; None where it is not calibrated or a tap has no distance."""
        self.write("taps.csv", [z for z in self.zeros if z["run"] in runs] + taps)
        if self.run("calibrate", "taps.csv", "--out", "cal").returncode:
            return None
        rows = [r for r in self.zeros + self.taps if r["run"] == unseen]
        self.write("new.csv", sorted(rows, key=lambda r: r["delta_mm"] != 0.0))
        if self.run("locate", "cal/calibration.toml", "new.csv", "--out", "told").returncode:
            return None
        with open(pathlib.Path(self.folder) / "told/located.csv") as file:
            told = [r for r in csv.DictReader(line for line in file if not line.startswith("#")) if float(r["delta_mm"]) != 0.0]
        # A missing distance counts as an error of a quarter of the range.
        miss = 0.25 * (self.places[-1] - self.places[0])
        off = [float(r["distance_mm"]) - float(r["a_mm"]) if r["distance_mm"] else miss for r in told]
        return math.sqrt(sum(x * x for x in off) / len(off))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("data")
    parser.add_argument("--contact", type=float, default=0.0)
    said = parser.parse_args()
    mean = lambda all: math.sqrt(sum(x * x for x in all) / len(all))
    with tempfile.TemporaryDirectory() as folder:
        rig = Rig(str(pathlib.Path(said.program).resolve()), said.data, said.contact, folder)
        drives = [u - said.contact for u in rig.drives]
        text = SPEC.format(length=round(rig.places[-1] + 25), near=rig.places[0], far=rig.places[-1], drives=drives)
        (pathlib.Path(folder) / "spec.toml").write_text(text)
        pairs = [([r for r in rig.runs if r != unseen], unseen) for unseen in rig.runs]
        print("| design | taps | errors in the runs left out, mm | their rms |\n|---|---|---|---|")
        show = lambda name, n, errors: print(f"| {name} | {n} | {', '.join(f'{e:.2f}' for e in errors)} | {mean(errors):.2f} |", flush=True)
        seen = set()
        for step in range(40):
            error = 3.0 * 0.93**step
            taps = [rig.planned(f"{error:.4g}", runs) for runs, _ in pairs]
            if any(t is None for t in taps) or len(taps[0]) in seen or len(taps[0]) > 40:
                continue
            seen.add(len(taps[0]))
            errors = [rig.error(t, runs, unseen) for t, (runs, unseen) in zip(taps, pairs)]
            if None not in errors:
                show(f"planned for {error:.2g} mm", len(taps[0]), errors)
        for positions, some, each in itertools.product(range(2, len(rig.places) + 1), (len(rig.drives), 3, 2), (False, True)):
            taps = [rig.even(positions, some, runs, each) for runs, _ in pairs]
            if not 8 <= len(taps[0]) <= 60:
                continue
            errors = [rig.error(t, runs, unseen) for t, (runs, unseen) in zip(taps, pairs)]
            if None not in errors:
                show(f"even: {positions} positions, {some} drives, {'in both runs' if each else 'by turns'}", len(taps[0]), errors)


if __name__ == "__main__":
    main()
