"""Cost of a sweep that can stop anywhere: whole processes that keep their state every two seconds (the default) against the same that never do, in turn.
Prints a Markdown table: fastest and median seconds of each, and the differences; of CPU time too (all threads, user and system), which other
work on the machine disturbs less.

    python3 benches/safety.py PROGRAM [ROUNDS] [NAME…]"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

GRID = """[whisker]
D = {{ from = 8, to = 12, steps = {D} }}
d = {{ from = 4, to = 7, steps = {d} }}
L_a = 50
[gauge]
x_ss = 5
l = 2
noise_strain = 1e-6
[tap]
a = {{ from = 21, to = 48, steps = 10 }}
theta = {{ from = 1, to = 6, steps = 40 }}
[output]
{output}
"""
# Name, spec, arguments.
RUNS = [
    ("short, CSV", GRID.format(D=3, d=100, output=""), []),
    ("short, ranked", GRID.format(D=300, d=300, output='top = 50\nby = "total_rms_mm"'), []),
    ("CSV", GRID.format(D=200, d=300, output=""), ["--precision", "f64"]),
    ("Parquet", GRID.format(D=200, d=300, output='format = "parquet"'), ["--precision", "f64"]),
    ("designs only", GRID.format(D=200, d=400, output="tuples = false"), ["--precision", "f64"]),
    ("ranked, taps solved", GRID.format(D=200, d=400, output='top = 1000\nby = "total_rms_mm"'), ["--precision", "f64"]),
    ("ranked from charts", GRID.format(D=4000, d=16000, output='top = 1000\nby = "total_rms_mm"'), []),
]


def main():
    program, rounds = os.path.realpath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    names = sys.argv[3:]
    print("| sweep | rounds | s never kept: fastest, median | s kept | difference | CPU s never kept | CPU s kept | difference |")
    print("|---|---|---|---|---|---|---|---|")
    for name, text, arguments in RUNS:
        if names and name not in names:
            continue
        folder = tempfile.mkdtemp(prefix="vibrissa-safety-")
        with open(f"{folder}/spec.toml", "w") as file:
            file.write(text)
        seconds = {"86400": [], "2": []}
        for round in range(rounds + 1):
            for every in sorted(seconds, reverse=round % 2 == 1):
                begun = time.perf_counter()
                line = [program, "sweep", "spec.toml", "--backend", "cpu", "--quiet", "--out", "out", "--keep-every", every, *arguments]
                child = subprocess.Popen(line, cwd=folder)
                _, status, used = os.wait4(child.pid, 0)
                assert status == 0, status
                # The first round warms the caches.
                if round > 0:
                    seconds[every].append((time.perf_counter() - begun, used.ru_utime + used.ru_stime))
                shutil.rmtree(f"{folder}/out")
        shutil.rmtree(folder)
        cells = []
        for which in (0, 1):
            never, kept = ([times[which] for times in seconds[every]] for every in ("86400", "2"))
            median, least = statistics.median(kept) - statistics.median(never), min(kept) - min(never)
            cells += [f"{min(all):.2f}, {statistics.median(all):.2f}" for all in (never, kept)]
            shares = 100 * least / min(never), 100 * median / statistics.median(never)
            cells.append(f"{1e3 * least:+.0f}, {1e3 * median:+.0f} ms; {shares[0]:+.1f}, {shares[1]:+.1f} %")
        print(f"| {name} | {rounds} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
