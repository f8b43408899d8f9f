#!/usr/bin/env python3
"""Distance as moment over force at the root, M0/F_y, compared with distance from strain and from the moment by K.

    python3 benches/moment_over_force.py target/release/vibrissa > results/FOLDER/moment_over_force.csv

A cone of 10 to 4 mm, 50 mm long (shear, stretch, contact on the surface, a pole of 3 mm), clamped and on a root of 100 E I/L, is tapped at 21 … 48 mm. Each
sensor has the same noise relative to its largest signal over these distances. For each angle and sensor: bias (rms over the distances), noise (rms of the
standard deviation), both in quadrature, in mm. Strain and moment are read with f and the mean K of the row, which only a calibration tells; M0/F_y needs
neither K nor f nor E: linear theory has it equal to a.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

NOISE = 1e-3
DISTANCES = (21, 48, 10)
ANGLES = (1, 2, 4, 6, 8, 10)
SPEC = """format = 1
[whisker]
D = 10.0
d = 4.0
L_a = 50.0
{root}
[gauge]
x_ss = 5.0
l = 2.0
[sensor]
signal = "{signal}"
[tap]
a = {{ from = {a[0]}, to = {a[1]}, steps = {a[2]} }}
theta = {angles}
[model]
shear = true
extension = true
surface = true
pole_radius = 3.0
material = {{ hooke = 3.2 }}
[output]
wrench = true
"""


def rows(program, folder, root, signal):
    spec = pathlib.Path(folder) / "spec.toml"
    spec.write_text(SPEC.format(root=root, signal=signal, a=DISTANCES, angles=list(ANGLES)))
    out = pathlib.Path(folder) / "out"
    subprocess.run([program, "sweep", spec, "--out", out, "--force", "--quiet", "--backend", "reference"], check=True)
    with open(out / "tuples.csv", newline="") as file:
        return [{k: v if k in ("status", "contact_state") else float(v or "nan") for k, v in row.items()}
                for row in csv.DictReader(file)]


def rms(values):
    values = list(values)
    return (sum(x * x for x in values) / len(values)) ** 0.5


def slopes(a, x):
    """dx/da at every a, by parabolas through three neighbours."""
    found = []
    for i in range(len(a)):
        k = min(max(i, 1), len(a) - 2)
        (p, q, r), (u, v, w) = a[k - 1:k + 2], x[k - 1:k + 2]
        at = a[i]
        found.append(u * (2 * at - q - r) / ((p - q) * (p - r)) + v * (2 * at - p - r) / ((q - p) * (q - r))
                     + w * (2 * at - p - q) / ((r - p) * (r - q)))
    return found


def main(program):
    table = csv.writer(sys.stdout)
    table.writerow(["root", "sensor", "theta_deg", "bias_rms_mm", "noise_rms_mm", "total_rms_mm"])
    for name, root in (("clamped", ""), ("100 EI/L", "root = { k_theta = 3141.593 }")):
        with tempfile.TemporaryDirectory() as folder:
            taps = {signal: rows(program, folder, root, signal) for signal in ("strain", "moment")}
        for theta in ANGLES:
            def put(sensor, bias, noise):
                both = rms(bias), rms(noise)
                table.writerow([name, sensor, theta, *(f"{x:.5f}" for x in (*both, (both[0] ** 2 + both[1] ** 2) ** 0.5))])

            for signal, column in (("strain", "strain"), ("moment", "signal")):
                of = [row for row in taps[signal] if row["theta_deg"] == theta]
                a, x = [row["a_mm"] for row in of], [row[column] for row in of]
                noise = NOISE * max(abs(v) for v in x)
                put(f"{signal} by K", [row["error_mm"] for row in of], [noise / abs(s) for s in slopes(a, x)])
            of = [row for row in taps["strain"] if row["theta_deg"] == theta]
            moments, forces = [row["base_moment_Nmm"] for row in of], [row["base_fy_N"] for row in of]
            ends = [NOISE * max(abs(v) for v in x) for x in (moments, forces)]
            ratio = [m / f for m, f in zip(moments, forces)]
            put("M0/F_y", [q - row["a_mm"] for q, row in zip(ratio, of)],
                [q * ((ends[0] / m) ** 2 + (ends[1] / f) ** 2) ** 0.5 for q, m, f in zip(ratio, moments, forces)])


if __name__ == "__main__":
    main(sys.argv[1])
