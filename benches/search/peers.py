#!/usr/bin/env python3
"""The searches of this program compared with scipy's differential evolution and pymoo's NSGA-II on the same problem.

All see the same model: the peers hand each generation to `vibrissa sweep` as a tuple file, on the CPU kernels, and read designs.csv.
Constraints are strain <= 0.05, force <= 1 N and d <= D. Run `benches/search/run`; it prints one table in Markdown.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize
from scipy.optimize import NonlinearConstraint, differential_evolution

PROGRAM = sys.argv[1]
SEEDS = range(1, 1 + int(sys.argv[2]) if len(sys.argv) > 2 else 4)
LOW = np.array([8.0, 2.0, 3.0, 1.0, 0.5])  # D, d, x_ss, l, theta
HIGH = np.array([12.0, 10.0, 15.0, 4.0, 10.0])
DISTANCES = np.arange(21, 49, 3)
FOLDER = pathlib.Path(tempfile.mkdtemp())

SEARCH = """[whisker]
L_a = 50
[gauge]
noise_strain = 20e-6
[tap]
a = {{ from = 21, to = 48, step = 3 }}
[optimise]
objective = "{objective}"
seed = {seed}
variables = {{ D = [8, 12], d = [2, 10], x_ss = [3, 15], l = [1, 4], theta = [0.5, 10] }}
limits = {{ force_N = 1.0, tip_not_wider = true }}
"""


def ours(objective, seed, backend):
    spec = FOLDER / "search.toml"
    spec.write_text(SEARCH.format(objective=objective, seed=seed))
    command = [PROGRAM, "optimise", spec, "--json", "--quiet", "--force", "--backend", backend, "--out", FOLDER / "found"]
    begun = time.perf_counter()
    answer = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return answer, time.perf_counter() - begun


class Model:
    """Figures of a population: one sweep over a tuple file."""

    def __init__(self):
        self.evaluations = 0
        (FOLDER / "sweep.toml").write_text(
            '[gauge]\nnoise_strain = 20e-6\n[tuples]\nfile = "tuples.csv"\n[output]\ntuples = false\ndistances = false\n'
        )

    def __call__(self, x):
        x = np.atleast_2d(x)
        self.evaluations += len(x)
        with open(FOLDER / "tuples.csv", "w") as file:
            file.write("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n")
            for base, tip, place, grid, theta in x.tolist():
                file.writelines(f"{base!r},{tip!r},50,{place!r},{grid!r},{a},{theta!r}\n" for a in DISTANCES)
        command = [PROGRAM, "sweep", FOLDER / "sweep.toml", "--quiet", "--force", "--backend", "cpu", "--out", FOLDER / "swept"]
        subprocess.run(command, check=True, capture_output=True)
        with open(FOLDER / "swept" / "designs.csv") as file:
            rows = {tuple(float(r[k]) for k in ("D_mm", "d_tip_mm", "x_ss_mm", "l_mm", "theta_deg")): r for r in csv.DictReader(file)}
        rows = [rows[tuple(point)] for point in x.tolist()]
        number = lambda row, key: float(row[key]) if row[key] else 1e3
        figures = np.array([[number(r, "K_sd"), number(r, "total_rms_mm")] for r in rows])
        limits = np.array([[number(r, "strain_max") / 0.05 - 1, number(r, "force_max_N") - 1] for r in rows])
        return figures, np.column_stack([limits, x[:, 1] / x[:, 0] - 1])


def evolution(seed):
    model, known = Model(), {}

    def all_of(x):  # scipy hands columns, objective and constraint one after the other
        key = x.tobytes()
        if key not in known:
            known.clear()
            known[key] = model(x.T)
        return known[key]

    begun = time.perf_counter()
    result = differential_evolution(
        lambda x: all_of(x)[0][:, 1] if x.ndim > 1 else all_of(x[:, None])[0][0, 1],
        list(zip(LOW, HIGH)),
        constraints=NonlinearConstraint(lambda x: all_of(x)[1].T if x.ndim > 1 else all_of(x[:, None])[1][0], -np.inf, 0),
        seed=seed, popsize=15, maxiter=200, tol=1e-8, polish=False, vectorized=True, updating="deferred",
    )
    return float(np.ravel(result.fun)[0]), model.evaluations, time.perf_counter() - begun


def nsga2(seed, evaluations):
    model = Model()

    class Tradeoff(Problem):
        def __init__(self):
            super().__init__(n_var=5, n_obj=2, n_ieq_constr=3, xl=LOW, xu=HIGH)

        def _evaluate(self, x, out, *_, **__):
            out["F"], out["G"] = model(x)

    begun = time.perf_counter()
    result = minimize(Tradeoff(), NSGA2(pop_size=128), ("n_eval", evaluations), seed=seed)
    return result.F, model.evaluations, time.perf_counter() - begun


def main():
    print("| search | seed | best total_rms_mm | evaluations | seconds |\n|---|---|---|---|---|")
    for seed in SEEDS:
        for backend in ("gpu", "cpu"):
            answer, seconds = ours("distance", seed, backend)
            print(f"| this program, {backend} | {seed} | {answer['result']['value']:.6e} | {answer['counts']['evaluations']} | {seconds:.2f} |", flush=True)
        value, evaluations, seconds = evolution(seed)
        print(f"| scipy differential_evolution | {seed} | {value:.6e} | {evaluations} | {seconds:.2f} |", flush=True)
    print("\n| front | seed | points | hypervolume | evaluations | seconds |\n|---|---|---|---|---|---|")
    for seed in SEEDS:
        answer, seconds = ours("pareto", seed, "cpu")
        front = np.array([[r["K_sd"], r["total_rms_mm"]] for r in answer["result"]["front"]["rows"]])
        low, corner = front.min(axis=0), front.max(axis=0)
        # Scaled to the extent of this front; 1 would be a front with a single ideal corner.
        volume = lambda f: HV(ref_point=np.ones(2))((np.asarray(f) - low) / (corner - low))
        spent = answer["counts"]["evaluations"]
        print(f"| this program, cpu | {seed} | {len(front)} | {volume(front):.5f} | {spent} | {seconds:.2f} |", flush=True)
        other, evaluations, seconds = nsga2(seed, spent)
        print(f"| pymoo NSGA-II | {seed} | {len(other)} | {volume(other):.5f} | {evaluations} | {seconds:.2f} |", flush=True)


main()
