"""Speed and memory of the Python package compared with the engine. Prints a table; with an argument writes it there too.

Times are the fastest of several; CPU times are those of all threads, which other work on the machine hardly changes.
"""

import os
import pathlib
import platform
import subprocess
import sys
import time
import timeit

import numpy as np

import vibrissa
from vibrissa._taps import _solver

TAPS = 1_000_000
ONE = (10.0, 4.0, 50.0, 5.0, 2.0, 30.0, 4.0)
REPEATS = 5


def random_taps(n, seed=1):
    """Whiskers, gauges, distances and angles of a search, all different."""
    g = np.random.default_rng(seed)
    low, high = [8, 3, 50, 3, 1, 21, 0.5], [12, 10, 50, 8, 4, 48, 10]
    return [np.ascontiguousarray(c) for c in g.uniform(low, high, (n, 7)).T]


def spent(work, repeats=REPEATS):
    """Least wall and CPU seconds."""
    walls, cpus = [], []
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return min(walls), min(cpus)


def arrays():
    columns = random_taps(TAPS)
    rows = []
    for name, model in (("f32, 1e-5", {}), ("f64, 1e-8", dict(precision="f64"))):
        taps = _solver(model, False)
        call = spent(lambda: vibrissa.strain(*columns, **model))
        once = spent(lambda: taps.seconds(TAPS, columns, 1))[1]
        cpu = (spent(lambda: taps.seconds(TAPS, columns, 4), 2)[1] - once) / 3
        engine = min(taps.seconds(TAPS, columns, 1) for _ in range(REPEATS)), cpu
        for what, (wall, cpu) in (("the engine, in Rust", engine), ("`strain`", call)):
            rows.append((f"{what}, {name}", f"{wall:.2f}", f"{cpu:.2f}", f"{cpu / engine[1]:.2f}"))
    return ["1e6 random taps", "wall s", "CPU s", "CPU, engine = 1"], rows


def one():
    rows = []
    for name, model in (("plain, f32", {}), ("plain, f64", dict(precision="f64")), ("neo-hookean, surface, f32", dict(material={"neo-hookean": 3.2}, surface=True))):
        taps = _solver(model, False)
        columns = [np.array([x]) for x in ONE]
        n = 3000
        call = min(timeit.repeat(lambda: vibrissa.strain(*ONE, **model), timer=time.thread_time, number=n, repeat=9)) / n
        engine = min(timeit.repeat(lambda: taps.seconds(1, columns, n), timer=time.thread_time, number=1, repeat=9)) / n
        rows.append((name, f"{1e6 * call:.1f}", f"{1e6 * engine:.1f}", f"{1e6 * (call - engine):.1f}"))
    return ["one tap", "`strain` µs", "the engine µs", "call overhead µs"], rows


LARGE = """
import sys, time
import numpy as np, pandas
import vibrissa
# Not ru_maxrss: a process begins with that of the one that started it.
peak = lambda: int(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))) / 1024
pandas.DataFrame({"x": pandas.Categorical(["a"])}, copy=False)
rows, base = int(sys.argv[1]), peak()
result = vibrissa.sweep(whisker=dict(D=vibrissa.axis(9, 11, steps=rows // 1000), d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(
    a=vibrissa.axis(21, 48, steps=10), theta=vibrissa.axis(1, 10, steps=100)), output=dict(designs=False, distances=False), run=dict(backend="cpu"))
swept, start = peak(), time.perf_counter()
frame = result.tuples.to_pandas()
seconds, framed = time.perf_counter() - start, peak()
assert len(frame) == rows and np.shares_memory(frame["strain"].to_numpy(), result.tuples["strain"])
print(rows * 144 / 2**20, swept - base, framed - swept, seconds, result.run["seconds"]["total"])
"""


def memory(rows=10_000_000):
    done = subprocess.run([sys.executable, "-c", LARGE, str(rows)], capture_output=True, text=True, check=True)
    table, swept, framed, seconds, total = map(float, done.stdout.split())
    return ["rows", "table MB", "peak of the sweep above the interpreter, MB", "more for the DataFrame, MB", "`to_pandas` s", "sweep s"], [
        (f"{rows:.0e}", f"{table:.0f}", f"{swept:.0f}", f"{framed:.0f}", f"{seconds:.3f}", f"{total:.1f}")]


def table(head, rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)) + "\n"


def main():
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")] if os.path.exists("/proc/cpuinfo") else [platform.processor()]
    text = f"{names[0]}, {len(os.sched_getaffinity(0))} cores, load {os.getloadavg()[0]:.1f}; Python {platform.python_version()}, numpy {np.__version__}, vibrissa {vibrissa.__version__}.\n"
    for part in (arrays, one, memory):
        text += "\n" + table(*part())
        print(text, flush=True)
    if len(sys.argv) > 1:
        pathlib.Path(sys.argv[1]).write_text(text)


if __name__ == "__main__":
    main()
