"""Full model against what --model-error leaves of it: CPU time of the whole process and what was left off.

python3 results/2026-11-22-model-error/measure.py target/release/vibrissa > results/2026-11-22-model-error/measured.md
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(__file__).parent
CHARTS = ROOT / "results/2026-11-22-charts"
SPECS = [
    *(("sweep", ROOT / "sweeps" / name) for name in ["prototypes.toml", "practical.toml", "effects.toml", "million.toml"]),
    *(("optimise", ROOT / "sweeps" / name) for name in ["design.toml", "robust.toml", "pareto.toml"]),
    ("tap", ROOT / "sweeps/best-tap.toml"),
    *(("sweep", CHARTS / name) for name in ["independent.toml", "grid.toml", "designs.toml", "friction.toml"]),
    *(("sweep", HERE / name) for name in ["small.toml", "slippery.toml", "table.toml", "slippery-table.toml"]),
    ("tap", HERE / "tap.toml"),
    ("optimise", HERE / "search.toml"),
]
BOUNDS = ["1e-2", "1e-3", "1e-4"]
REPEATS = 3


def run(command, spec, flags):
    """Least CPU time of some runs, s, and run.json."""
    best = float("inf")
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder:
            arguments = [PROGRAM, command, spec, "--backend", "cpu", "--quiet", "--out", f"{folder}/out", *flags]
            process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL)
            _, status, used = os.wait4(process.pid, 0)
            if status != 0:
                sys.exit(f"{arguments} failed")
            document = json.loads(pathlib.Path(folder, "out/run.json").read_text())
        seconds = used.ru_utime + used.ru_stime
        best = min(best, seconds)
        if seconds > 2:
            break
    return best, document


def short(checked):
    return "" if checked is None else f"{checked['error']:.1e}"


def planned(command, spec, bound):
    """What would be left off."""
    arguments = [PROGRAM, command, spec, "--backend", "cpu", "--plan", "--json", "--model-error", bound]
    done = subprocess.run(arguments, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return json.loads(done.stdout)["result"]["model_error"]


def names(told):
    left = ", ".join(part["effect"] for part in told["left_off"])
    return left or ("nothing" if told["needed"] else "nothing: no effect is on")


print("| spec | E | left off | CPU s, full model | CPU s, what is left | largest change: spread | own taps | rows kept | K_sd of these | choosing and checking, s |")
print("|---|---|---|---|---|---|---|---|---|---|")
for command, spec in SPECS:
    full = None
    for bound in BOUNDS:
        told, seconds, kept = planned(command, spec, bound), None, None
        if told["left_off"]:
            full = full or run(command, spec, [])[0]
            seconds, document = run(command, spec, ["--model-error", bound])
            told = document["model_error"]
            kept = told["rows_kept"]
        moved = "" if kept is None else f"{100 * kept['K_sd_changed']:.2g} %"
        choosing = sum(told["seconds"][key] for key in ("choosing", "checking"))
        time_of = lambda s: "" if s is None else f"{s:.3g}"
        cells = [f"`{command} {spec.relative_to(ROOT)}`", bound, names(told), time_of(full if seconds else None), time_of(seconds)]
        cells += [short(told["spread"]), short(told["own_taps"]), short(kept), moved, f"{choosing:.2g}"]
        print("| " + " | ".join(cells) + " |", flush=True)
