"""Runs ours and the peers one after another on one machine and makes the table: taps/s, p99 and worst strain error, ratio."""

import csv
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

from problem import Taps

HERE = pathlib.Path(__file__).parent
PROGRAM = HERE.parent.parent / "target" / "release" / "vibrissa"
PEERS = ["vibrissa", "jax", "diffrax", "numba", "scipy", "elastica"]
# Output of the timed sweeps: rows per distance of solved taps, or the 100 best designs, ranked from charts.
SOLVED, RANKED = "distances = true", "distances = false\ntop = 100"
# Name, flags, output, whiskers of the timed sweep (10 taps each).
OURS = [
    ("vibrissa gpu f32, ranked", ["--backend", "gpu"], RANKED, 10_000_000),
    ("vibrissa cpu f32, ranked", ["--backend", "cpu"], RANKED, 10_000_000),
    ("vibrissa gpu f32", ["--backend", "gpu"], SOLVED, 1_000_000),
    ("vibrissa cpu f32", ["--backend", "cpu"], SOLVED, 1_000_000),
    ("vibrissa cpu f64", ["--backend", "cpu", "--precision", "f64"], SOLVED, 1_000_000),
    ("vibrissa reference", ["--backend", "reference"], SOLVED, 10_000),
]
# Random taps of a timed sweep, solved again by the reference.
SAMPLES = 100_000
COLUMNS = ["name", "taps", "solved", "interpolated", "taps_per_second", "p99", "worst", "ratio"]


def sweep(spec, flags, out):
    """Seconds of a whole process, start to last byte."""
    start = time.perf_counter()
    subprocess.run([PROGRAM, "sweep", spec, "--quiet", "--force", "--out", out, *flags], check=True)
    return time.perf_counter() - start


def ours(work, name, flags, output, whiskers):
    """Speed of a whole process, and errors of random taps of the same sweep."""
    text = (HERE / "taps.toml").read_text().replace("samples = 10000,", f"samples = {whiskers},")
    text = text.replace("designs = false\ndistances = false", "tuples = false\ndesigns = false\n" + SOLVED)
    if output == RANKED:
        text = text.replace("designs = false\n" + SOLVED, RANKED)
    spec = work / "speed.toml"
    spec.write_text(text)
    seconds = min(sweep(spec, flags, work / "speed") for _ in range(3))
    run = json.loads((work / "speed" / "run.json").read_text())
    counts = run["counts"]
    assert counts["taps"] == 10 * whiskers and (counts["interpolated"] > 0) == (output == RANKED), counts
    row = {"taps": counts["taps"], "solved": counts["solved"], "interpolated": counts["interpolated"]}
    if run["backend"]["adapter"]:
        name += f" ({run['backend']['adapter']})"
    return {"name": name, **row, "taps_per_second": counts["taps"] / seconds, **errors(work, spec, flags, output)}


def errors(work, spec, flags, output):
    """p99 and worst strain error of the census, or of the chart for a ranked sweep; a GPU reads the same chart as the CPU."""
    if "reference" in flags:
        return {"p99": 0.0, "worst": 0.0}
    if output == RANKED and "gpu" in flags:
        return {}
    command = [PROGRAM, "verify", spec, "--samples", str(SAMPLES), "--quiet", "--force", "--out", work / "census"]
    precision = [] if "--precision" in flags else ["--precision", "f32"]
    subprocess.run([*command, *flags, *precision], check=True)
    with open(work / "census" / "verify.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    row = next(r for r in rows if r["configuration"].endswith(" chart") == (output == RANKED))
    assert int(row["compared"]) > 0.9 * SAMPLES, row
    return {"p99": float(row["strain_error_p99"]), "worst": float(row["strain_error_worst"])}


def peer(work, name):
    """The lines of one peer; a peer that fails is a line that says so."""
    command = [sys.executable, HERE / f"peer_{name}.py", work / "reference" / "tuples.csv"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=HERE)
    if done.returncode:
        print(done.stderr[-2000:], file=sys.stderr)
        return [{"name": f"{name}: failed"}]
    return [json.loads(line) for line in done.stdout.splitlines()]


def processor():
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines() if os.path.exists("/proc/cpuinfo") else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.processor()}, {len(os.sched_getaffinity(0))} cores"


def table(rows):
    text = "| program | taps | solved | interpolated | taps/s | p99 error | worst error | JAX (24 x 8) = 1 |\n" + "|---" * 8 + "|\n"
    for row in rows:
        shown = [f"{row[c]:.2g}" if c in row else "" for c in COLUMNS[1:]]
        text += f"| {row['name']} | " + " | ".join(shown) + " |\n"
    return text


def main(out):
    out = pathlib.Path(out)
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        print("answers of the reference", file=sys.stderr)
        sweep(HERE / "taps.toml", ["--backend", "reference"], work / "reference")
        rows = []
        for entry in OURS:
            print(entry[0], file=sys.stderr)
            rows.append(ours(work, *entry))
        for name in PEERS:
            print(name, file=sys.stderr)
            rows += peer(work, name)
    unit = next((r["taps_per_second"] for r in rows if "24 steps" in r["name"] and "JAX" in r["name"]), None)
    for row in rows:
        if unit and "taps_per_second" in row:
            row["ratio"] = row["taps_per_second"] / unit
    machine = processor()
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "peers.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    text = (
        f"Machine: {machine}. Command: `benches/peers/run`.\n\n{table(rows)}\n"
        "Error: |strain - reference| / max(|reference|, 1e-3 theta f_max): ours on 100 000 random taps of the timed sweep, peers' on the taps of\n"
        "`benches/peers/taps.toml` (diffrax, scipy and PyElastica on some of them). Ours: whole processes, start to last byte; `ranked`: the 100\n"
        "best designs by K_sd, read from the chart of the rod; the others: every tap solved, statistics per distance. The GPU ranks from the same\n"
        "chart, compared with the CPU's ranks and words by `tests/charted.rs`. Peers: the solve alone, already compiled, on all cores. The\n"
        "error of the reference's own row is 0 by definition; verified apart, it is about 1e-11.\n"
    )
    (out / "peers.md").write_text(text)
    print(text)
    if any("taps_per_second" not in row for row in rows):
        sys.exit(1)


main(sys.argv[1])
