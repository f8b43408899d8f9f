#!/usr/bin/env python3
"""Calibrations judged by what they have not seen: whole positions, and whole runs, left out of measured and of simulated rigs.

    python3 benches/real/judge.py PROGRAM [--data FOLDER] [--against OLD_PROGRAM] [--fresh SEED] [--only NAME,…] > table.md

Each fold is calibrated by PROGRAM from the other rows and located by it, without any option. Beside it stand fits that know nothing of
whiskers: a cubic of a in ln s, scikit-learn's Gaussian process of a over (ln s, ln drive), and PCHIP of a over ln s, of each drive; and
another PROGRAM. Simulated rigs start from `PROGRAM simulate`; --fresh draws them anew. Needs numpy, scipy and scikit-learn.
"""

import argparse
import csv
import pathlib
import subprocess
import tempfile
import warnings

import numpy as np
from scipy.interpolate import PchipInterpolator
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

SPEC = """[whisker]
D = {D}
d = {d}
L_a = {L}
[gauge]
x_ss = 5
l = 2
{gauge}
[tap]
a = {a}
theta = {theta}
[model]
surface = true
shear = true
extension = true
{model}
"""


class Set:
    """Rows of a rig: a, drive, signal, run (or None), sound; the spec of its whisker as the user believes it is."""

    def __init__(self, name, drive, signal, a, u, y, run=None, spec=None, sound=None):
        self.name, self.drive, self.signal, self.spec = name, drive, signal, spec
        self.a, self.u, self.y = np.asarray(a, float), np.asarray(u, float), np.asarray(y, float)
        self.run = None if run is None else np.asarray(run)
        self.truth = self.a.copy()
        self.sound = np.ones(len(self.a), bool) if sound is None else sound

    def rows(self, keep, path):
        with open(path, "w") as f:
            head = ["a_mm"] + ([self.drive] if self.drive else []) + [self.signal] + (["run"] if self.run is not None else [])
            f.write(",".join(head) + "\n")
            for i in np.flatnonzero(keep):
                row = [repr(float(self.a[i]))] + ([repr(float(self.u[i]))] if self.drive else []) + [repr(float(self.y[i]))]
                f.write(",".join(row + ([str(self.run[i])] if self.run is not None else [])) + "\n")


def load(path):
    rows = list(csv.DictReader(open(path)))
    drive = next((c for c in ("theta_deg", "delta_mm") if c in rows[0]), None)
    signal = next(c for c in ("strain", "microstrain", "bridge_mV_per_V", "reading") if c in rows[0])
    n = lambda c: [float(r[c]) for r in rows]
    run = [r["run"] for r in rows] if "run" in rows[0] else None
    return Set(path.stem, drive, signal, n("a_mm"), n(drive) if drive else np.ones(len(rows)), n(signal), run)


def simulated(program, seed):
    """Thirteen rigs; each draws what is wrong with it."""
    rng = np.random.default_rng(seed)
    out = []

    def taps(a, theta, model="", gauge="", D=10.0, d=None, L=60.0):
        spec = SPEC.format(D=D, d=d or D, L=L, gauge=gauge, a=list(map(float, a)), theta=list(map(float, theta)), model=model)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "spec.toml"
            path.write_text(spec)
            subprocess.run([program, "simulate", path, "--out", folder + "/o", "--noise", "0", "--quiet"], check=True, capture_output=True)
            rows = list(csv.DictReader(open(folder + "/o/measurements.csv")))
        return np.array([[float(r["a_mm"]), float(r["theta_deg"]), float(r["strain"])] for r in rows]), spec

    def spec_of(a, theta, **with_):
        with_.setdefault("model", "")
        return SPEC.format(D=with_.get("D", 10.0), d=with_.get("d", with_.get("D", 10.0)), L=60.0, gauge=with_.get("gauge", ""), a=list(map(float, a)), theta=list(map(float, theta)), model=with_["model"])

    far = np.linspace(20, 50, 11) + rng.uniform(-0.3, 0.3)
    some = [1.0, 2.0, 4.0, 6.0]
    noise = lambda y, rel=1e-3, floor=2e-6: y * (1 + rel * rng.normal(size=len(y))) + floor * rng.normal(size=len(y))
    def repeated(t, n):
        return np.concatenate([t[rng.permutation(len(t))] for _ in range(n)])

    mu = rng.uniform(0.2, 0.5)
    t, _ = taps(far, some, f"contact = {{ coulomb = {mu} }}")
    t = repeated(t, 3)
    out.append(Set("friction", "theta_deg", "strain", t[:, 0], t[:, 1], noise(t[:, 2]), spec=spec_of(far, some)))

    D = 10 * (1 + rng.choice([-1, 1]) * rng.uniform(0.05, 0.12))
    t, _ = taps(far, some, D=D, d=0.7 * D)
    t = repeated(t, 2)
    out.append(Set("wrong D", "theta_deg", "strain", t[:, 0], t[:, 1], noise(t[:, 2]), spec=spec_of(far, some, d=6.0)))

    t, _ = taps(far, some)
    base = repeated(t, 2)
    y = noise(base[:, 2]) + rng.uniform(2e-4, 1e-3)
    out.append(Set("offset", "theta_deg", "strain", base[:, 0], base[:, 1], y))

    base = repeated(t, 3)
    y = noise(base[:, 2]) + rng.uniform(1, 4) * 1e-6 * np.arange(len(base))
    out.append(Set("drift", "theta_deg", "strain", base[:, 0], base[:, 1], y, spec=spec_of(far, some)))

    base = repeated(t, 2)
    step = rng.uniform(1, 3) * 1e-4
    out.append(Set("quantised", "theta_deg", "reading", base[:, 0], base[:, 1], 1e3 * step * np.round(noise(base[:, 2]) / step)))

    out.append(Set("no repeats", "theta_deg", "strain", t[:, 0], t[:, 1], noise(t[:, 2], 3e-3), spec=None))

    one, _ = taps(far, [4.0])
    out.append(Set("one angle", "theta_deg", "strain", one[:, 0], one[:, 1], noise(one[:, 2], 3e-3), spec=None))

    three = rng.uniform(22, 26), rng.uniform(31, 37), rng.uniform(44, 50)
    t3, _ = taps(three, some)
    base = repeated(t3, 3)
    out.append(Set("three positions", "theta_deg", "strain", base[:, 0], base[:, 1], noise(base[:, 2]), spec=spec_of(three, some)))

    base = repeated(t, 2)
    y, sound = noise(base[:, 2]), np.ones(len(base), bool)
    labels = base[:, 0].copy()
    for k in rng.choice(len(base), 2, replace=False):
        others = far[np.abs(far - labels[k]) > 5]
        labels[k], sound[k] = rng.choice(others), False
    s = Set("two wrong labels", "theta_deg", "strain", labels, base[:, 1], y, sound=sound)
    s.truth = base[:, 0]
    out.append(s)

    parts = []
    for r in range(4):
        z, g = rng.normal() * 3e-4, 1 + rng.normal() * 0.02
        p = t[rng.permutation(len(t))]
        parts.append(np.column_stack([p[:, :2], g * noise(p[:, 2]) + z, np.full(len(p), r)]))
    base = np.concatenate(parts)
    out.append(Set("four runs", "theta_deg", "strain", base[:, 0], base[:, 1], base[:, 2], run=base[:, 3].astype(int), spec=spec_of(far, some)))

    contact, _ = taps(far, some)
    other, _ = taps(far, some, gauge='side = "far"')
    base = repeated(np.concatenate([contact, other]), 2)
    rest = rng.normal() * 1e-4
    y = noise(base[:, 2]) + rest
    a, u = base[:, 0], base[:, 1]
    k = np.arange(0, len(a), 30)
    out.append(Set("both sides", "theta_deg", "strain", np.insert(a, k, 30.0), np.insert(u, k, 0.0), np.insert(y, k, rest + 2e-6 * rng.normal(size=len(k)))))

    t2, _ = taps(far, some, "contact = { coulomb = 0.2 }", D=9.0, d=6.0)
    base = repeated(t2, 2)
    out.append(Set("no whisker", "theta_deg", "reading", base[:, 0], base[:, 1], noise(2e3 * base[:, 2], 2e-3, 1e-2)))

    foil = "foil = { stiffness = 300, length = 4, width = 3 }"
    t4, _ = taps(far, some, "pole_radius = 1", gauge=foil)
    base = repeated(t4, 2)
    out.append(Set("foil", "theta_deg", "strain", base[:, 0], base[:, 1], noise(base[:, 2], floor=2e-7), spec=spec_of(far, some, model="pole_radius = 1", gauge="foil = { stiffness = 450, length = 4, width = 3 }")))
    return out


def grouped(x):
    order = np.argsort(x)
    steps = np.diff(x[order]) > 0.012 * x[order][:-1]
    group = np.empty(len(x), int)
    group[order] = np.concatenate([[0], np.cumsum(steps)])
    return group


def program(exe, s, train, test):
    """Errors in mm and σ of the test rows, NaN without an answer; and the lines called suspect."""
    with tempfile.TemporaryDirectory() as folder:
        f = pathlib.Path(folder)
        s.rows(train, f / "train.csv")
        s.rows(test, f / "test.csv")
        command = [exe, "calibrate", f / "train.csv", "--out", f / "c", "--quiet"]
        if s.spec:
            (f / "spec.toml").write_text(s.spec)
            command += ["--whisker", f / "spec.toml"]
        done = subprocess.run(command, capture_output=True, text=True)
        empty = np.full(test.sum(), np.nan)
        if done.returncode:
            return empty, empty, [], done.stderr.strip()
        done = subprocess.run([exe, "locate", f / "c/calibration.toml", f / "test.csv", "--out", f / "l", "--quiet"], capture_output=True, text=True)
        if done.returncode:
            return empty, empty, [], done.stderr.strip()
        number = lambda x: float(x) if x else np.nan
        rows = list(csv.DictReader(open(f / "l/located.csv")))
        a, sigma = (np.array([number(r[c]) for r in rows]) for c in ("distance_mm", "sigma_mm"))
        suspects = [int(r["line"]) for r in csv.DictReader(open(f / "c/rows.csv")) if r["use"] == "suspect"]
        return a - s.truth[test], sigma, suspects, ""


def tared(s):
    y = s.y.copy()
    rest = s.u <= 0
    if rest.any():
        i = np.arange(len(y))
        y = y - np.interp(i, i[rest], y[rest])
    elif (y > 0).any() and (y < 0).any() or (len(np.unique(s.u)) > 1 and np.polyfit(s.u, y, 1)[0] * np.median(y) < 0):
        rising = np.polyfit(s.u, y, 1)[0] > 0
        y = y - (y.min() - 0.1 * np.ptp(y) if rising else y.max() + 0.1 * np.ptp(y))
    return y


def by_drive(fit, degree):
    def run(a, d, y, D, Y):
        out = np.full(len(D), np.nan)
        groups = grouped(np.concatenate([d, D]))
        sign, SIGN = np.sign(y), np.sign(Y)
        for g in np.unique(groups):
            for one in (-1, 1):
                i, k = (groups[: len(d)] == g) & (sign == one), (groups[len(d):] == g) & (SIGN == one)
                if k.any() and i.sum() > 1:
                    out[k] = fit(np.log(np.abs(y[i])), a[i], np.log(np.abs(Y[k])), degree)
        return out
    return run


def polynomial(x, a, X, degree):
    return np.polyval(np.polyfit(x, a, min(degree, len(np.unique(a)) - 1)), X)


def pchip(x, a, X, _):
    levels = np.unique(a)
    centre = np.array([np.mean(x[a == v]) for v in levels])
    order = np.argsort(centre)
    keep = np.concatenate([[True], np.diff(centre[order]) > 1e-9])
    if keep.sum() < 2:
        return np.full(len(X), np.nan)
    return PchipInterpolator(centre[order][keep], levels[order][keep])(X)


def process(a, d, y, D, Y):
    out = np.full(len(D), np.nan)
    for one in (-1, 1):
        i, k = np.sign(y) == one, np.sign(Y) == one
        if not k.any() or i.sum() < 3:
            continue
        X = lambda d, y: np.stack([np.log(np.abs(y)), np.log(d)], 1)
        x = X(d[i], y[i])
        mean, sd = x.mean(0), np.where(x.std(0) > 0, x.std(0), 1)
        kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF([1.0, 1.0], (0.1, 1e3)) + WhiteKernel(0.01, (1e-8, 1e3))
        gp = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            gp.fit((x - mean) / sd, a[i])
        out[k] = gp.predict((X(D[k], Y[k]) - mean) / sd)
    return out


FITS = {"cubic": by_drive(polynomial, 3), "process": process, "pchip": by_drive(pchip, 0)}


def rms(e):
    e = e[np.isfinite(e)]
    return float(np.sqrt(np.mean(e**2))) if len(e) else np.nan


def main():
    args = argparse.ArgumentParser()
    args.add_argument("program")
    args.add_argument("--data")
    args.add_argument("--against")
    args.add_argument("--fresh", type=int, default=37)
    args.add_argument("--only", default="")
    args = args.parse_args()
    sets = simulated(args.program, args.fresh)
    if args.data:
        sets += [load(p) for p in sorted(pathlib.Path(args.data).glob("*.csv"))]
    wanted = [w for w in args.only.split(",") if w]
    sets = [s for s in sets if not wanted or s.name in wanted]
    others = list(FITS) + (["today"] if args.against else [])
    print("| set | left out | rows | " + " | ".join(others) + " | learned | ratio | within 1 σ | beyond 3 σ | none | told |")
    print("|" + "---|" * (len(others) + 9))
    ratios, scaled, per_set = [], [], []
    for s in sets:
        rest, y = s.u <= 0, tared(s)
        folds = {"positions": grouped(s.truth)}
        if s.run is not None:
            folds["runs"] = np.unique(s.run, return_inverse=True)[1]
        for kind, group in folds.items():
            errors = {n: [] for n in others + ["learned"]}
            sigmas, none, told = [], 0, ""
            for g in np.unique(group[~rest]):
                test = (group == g) & ~rest & s.sound
                zeros = rest & (group == g) if kind == "runs" else rest
                train = ((group != g) | (rest if kind == "positions" else False)) & ~((group == g) & ~rest)
                asked = test | zeros
                e, sd, _, why = program(args.program, s, train, asked)
                answered = (~rest)[asked]
                e, sd = e[answered], sd[answered]
                errors["learned"].append(e)
                sigmas.append(sd)
                none += int(np.isnan(e).sum())
                told = told or why[:60].replace("\n", " ")
                if args.against:
                    errors["today"].append(program(args.against, s, train, asked)[0][answered])
                t = train & ~rest
                for n, fit in FITS.items():
                    try:
                        errors[n].append(fit(s.a[t], s.u[t], y[t], s.u[test], y[test]) - s.truth[test])
                    except (ValueError, np.linalg.LinAlgError):
                        errors[n].append(np.full(test.sum(), np.nan))
            each = {n: rms(np.concatenate(e)) for n, e in errors.items()}
            # A fit that leaves a tenth of the rows unanswered does not count.
            whole = [n for n in others if np.isfinite(np.concatenate(errors[n])).mean() > 0.9]
            best = min((each[n] for n in whole), default=np.nan)
            ratio = each["learned"] / best
            t = np.concatenate(errors["learned"]) / np.concatenate(sigmas)
            t = np.abs(t[np.isfinite(t)])
            ratios.append(ratio)
            scaled.append(t)
            cells = [f"{each[n]:.3f}" + ("" if n in whole else "*") for n in others] + [f"{each['learned']:.3f}", f"{ratio:.2f}"]
            share = [f"{100 * (t <= 1).mean():.0f} %", f"{100 * (t > 3).mean():.1f} %"] if len(t) else ["–", "–"]
            print("| " + " | ".join([s.name, kind, str(int((~rest).sum()))] + cells + share + [str(none), told]) + " |", flush=True)
        if not s.sound.all():
            _, _, lines, _ = program(args.program, s, np.ones(len(s.a), bool), np.ones(len(s.a), bool))
            wrong = set(np.flatnonzero(~s.sound) + 2)
            print(f"\n{s.name}: wrong lines {sorted(wrong)}, named {sorted(lines)}\n", flush=True)
    t = np.concatenate(scaled)
    r = np.array(ratios)[np.isfinite(ratios)]
    print(f"\nratio of rms to the best in hindsight: median {np.median(r):.3f}, worst {r.max():.3f}; {100 * (t <= 1).mean():.1f} % within 1 σ, {100 * (t > 3).mean():.2f} % beyond 3 σ of {len(t)}")
    print("\nIn mm. *: answers less than 90 % of the rows and is not counted among the best.")


main()
