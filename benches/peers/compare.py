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
PEERS = ["jax", "diffrax", "numba", "scipy", "elastica"]
# Name, flags, whiskers of the timed sweep (10 taps each).
OURS = [
    ("vibrissa gpu f32", ["--backend", "gpu"], 1_000_000),
    ("vibrissa cpu f32", ["--backend", "cpu"], 1_000_000),
    ("vibrissa cpu f64", ["--backend", "cpu", "--precision", "f64"], 1_000_000),
    ("vibrissa reference", ["--backend", "reference"], 10_000),
]
COLUMNS = ["name", "taps", "taps_per_second", "p99", "worst", "ratio"]


def sweep(spec, flags, out):
    """Seconds of a whole process, start to last byte."""
    start = time.perf_counter()
    subprocess.run([PROGRAM, "sweep", spec, "--quiet", "--force", "--out", out, *flags], check=True)
    return time.perf_counter() - start


def ours(work, name, flags, whiskers):
    """Errors on the common taps; speed of a whole process on more taps of the same kind, reduced to the 100 best designs."""
    sweep(HERE / "taps.toml", flags, work / "errors")
    taps = Taps(work / "reference" / "tuples.csv")
    p99, worst = taps.errors(Taps(work / "errors" / "tuples.csv").strain)
    text = (HERE / "taps.toml").read_text().replace("samples = 10000,", f"samples = {whiskers},")
    text = text.replace("designs = false", "tuples = false\ntop = 100")
    (work / "speed.toml").write_text(text)
    seconds = min(sweep(work / "speed.toml", flags, work / "speed") for _ in range(2))
    run = json.loads((work / "speed" / "run.json").read_text())
    assert run["counts"]["taps"] == 10 * whiskers, run["counts"]
    if run["backend"]["adapter"]:
        name += f" ({run['backend']['adapter']})"
    return {"name": name, "taps": 10 * whiskers, "taps_per_second": 10 * whiskers / seconds, "p99": p99, "worst": worst}


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
    text = "| program | taps | taps/s | p99 error | worst error | JAX (24 x 8) = 1 |\n|---|---|---|---|---|---|\n"
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
        "Error: |strain - reference| / max(|reference|, 1e-3 theta f_max), on the taps of `benches/peers/taps.toml` (diffrax, scipy and\n"
        "PyElastica on some of them). Ours: whole processes, start to last byte, reduced to the best designs. Peers: the solve alone, already\n"
        "compiled, on all cores. The error of the reference's own row is 0 by definition; verified apart, it is about 1e-11.\n"
    )
    (out / "peers.md").write_text(text)
    print(text)
    if any("taps_per_second" not in row for row in rows):
        sys.exit(1)


main(sys.argv[1])
