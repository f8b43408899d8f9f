"""CPU seconds of sweeps with and without tilt and second gauge, in turn. Argument: the program. Leaves its work in ./work."""

import resource
import statistics
import subprocess
import sys
from pathlib import Path

PROGRAM = Path(sys.argv[1]).resolve()
ROUNDS = 10
SPEC = """[whisker]
D = {{ from = 8, to = 12, steps = 40 }}
d = {{ from = 3, to = 7, steps = 20 }}
L_a = 50
[gauge]
x_ss = 5
l = 2
noise_strain = 1e-5
{gauge}
[tap]
a = [24, 33, 45]
theta = {{ from = 0.5, to = 10, steps = 200 }}
{tap}
[model]
{model}
[output]
tuples = false
designs = false
"""
NEO = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }"
SECOND = "second = true"
RUNS = {
    "neo-hookean, surface, shear, extension": (NEO, {
        "no key": ("", ""), "tilt = lean = 0": ("", "tilt = 0\nlean = 0"), "tilt 20": ("", "tilt = 20"),
        "tilt 20, two gauges": (SECOND, "tilt = 20"), "tilt -35, lean 10, two gauges": (SECOND, "tilt = -35\nlean = 10"),
    }),
    "surface": ("surface = true", {
        "no key": ("", ""), "tilt = lean = 0": ("", "tilt = 0\nlean = 0"), "tilt 20, two gauges": (SECOND, "tilt = 20"),
    }),
    "ideal rod": ("", {
        "no key": ("", ""), "tilt = lean = 0": ("", "tilt = 0\nlean = 0"), "tilt 20": ("", "tilt = 20"), "tilt 20, two gauges": (SECOND, "tilt = 20"),
    }),
}


def seconds(spec):
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    command = [PROGRAM, "sweep", spec.name, "--backend", "cpu", "--quiet", "--force", "--threads", "1", "--out", spec.stem]
    subprocess.run(command, check=True, cwd=spec.parent)
    return used() - before


work = Path(__file__).parent / "work"
work.mkdir(exist_ok=True)
for model, (text, cases) in RUNS.items():
    specs = {}
    for i, (name, (gauge, tap)) in enumerate(cases.items()):
        specs[name] = work / f"cost-{i}.toml"
        specs[name].write_text(SPEC.format(gauge=gauge, tap=tap, model=text))
    times = {name: [] for name in specs}
    for turn in range(ROUNDS):
        for name in list(specs)[:: 1 if turn % 2 else -1]:
            times[name].append(seconds(specs[name]))
    for name, each in times.items():
        ratios = sorted(t / base for t, base in zip(each, times["no key"]))
        print(f"{model}; {name}: {statistics.median(each):.3f} s, {statistics.median(ratios):.3f} ({ratios[2]:.3f} … {ratios[7]:.3f})")
