"""Small angles over taper, distance, Poisson's ratio and clamp: linear.csv, mesh.csv, clamp_constants.csv.

Linear elasticity scales: only d/D, L_a/D, a/D, x/D matter, so D 10 mm stands for every D with the same ratios."""

import pathlib
import sys

import numpy as np
from scipy.optimize import least_squares

import clamp
import rod
import tables
from fourier import Whisker

PLACES = (3.0, 5.0, 8.0, 12.0)  # x_ss, mm; grid length 2 mm
SHAPES = [(d, 50.0) for d in (1.0, 2.0, 4.0, 7.0, 10.0, 12.0)] + [(4.0, 100.0), (4.0, 25.0), (7.0, 25.0)]
DISTANCES = (15.0, 18.0, 21.0, 27.0, 36.0, 48.0)
# Clamp, socket length in mm, c0 of the reduced model (one number).
CLAMPS = [("bonded", 0.0), ("glued", 5.0), ("glued", 10.0), ("glued", 20.0), ("socket", 5.0), ("socket", 10.0), ("socket", 20.0)]


def case(w, a, how="bonded", socket=0.0, h=1.0, n_r=6):
    cos = np.cos(w.alpha)
    places = [x for x in PLACES if x + 2 * cos < a - 1.0]
    theta, strains, unknowns = clamp.solve(w, a, [(x, x + 2 * cos) for x in places], how, socket, h, n_r)
    k = rod.cowper(w.nu)
    four = dict(rod.BONDED_FOUR, k=rod.BONDED_FOUR["k"] * k / rod.cowper(0.5))
    reduced = rod.theta(w, a, **four) if how == "bonded" else float("nan")
    rows = []
    for x, e in zip(places, strains):
        rows.append(
            dict(
                clamp=how, socket_mm=socket, nu=w.nu, D_mm=w.D, d_mm=w.d, L_a_mm=w.L_a, a_mm=a, x_ss_mm=x, l_mm=2.0, unknowns=unknowns,
                theta_rad_per_N=theta, strain_per_N=e,
                theta_3d_over_euler=theta / rod.theta(w, a), theta_3d_over_timoshenko=theta / rod.theta(w, a, k=k),
                theta_3d_over_reduced=theta / reduced,
                strain_per_N_3d_over_rod=e / rod.strain(w, a, x, x + 2 * cos),
                strain_per_N_3d_over_reduced=e / rod.strain(w, a, x, x + 2 * cos, rod.NEAR_CLAMP),
                c0=rod.clamp_shift(w, a, theta, 1.011 * k / rod.cowper(0.5)),
            )
        )  # fmt: skip
    return rows


def fit_four(group):
    """(c0, k, b, c) least squares in relative theta over cases (whisker, a, theta)."""

    def miss(q):
        return [rod.theta(w, a, c0=q[0], k=q[1], b=q[2], c=q[3]) / th - 1 for w, a, th in group]

    best = least_squares(miss, [0.05, 1.1, -0.7, -0.7], x_scale=[0.1, 1, 1, 1])
    return best.x, np.max(np.abs(miss(best.x)))


def fit_one(group, k):
    """c0 alone (b = c0, c = 0), k fixed: smallest worst error."""
    grid = np.linspace(-0.8, 0.2, 2001)
    worst = [max(abs(rod.theta(w, a, c0=c, k=k) / th - 1) for w, a, th in group) for c in grid]
    return grid[int(np.argmin(worst))], min(worst)


def main(out, quick=False):
    out = pathlib.Path(out)
    rows, mesh = [], []
    shapes = [(4.0, 50.0), (10.0, 50.0)] if quick else SHAPES
    distances = (21.0, 36.0) if quick else DISTANCES
    for nu in (0.499,) if quick else (0.45, 0.49, 0.499, 0.49992):
        for d, L_a in shapes:
            for a in distances:
                if a < 0.97 * L_a:
                    rows += case(Whisker(d=d, L_a=L_a, nu=nu), a)
                    tables.write(out / "linear.csv", rows)
    for how, socket in CLAMPS[2::3] if quick else CLAMPS[1:]:
        for d in (4.0, 10.0) if quick else (1.0, 4.0, 7.0, 10.0, 12.0):
            for a in distances:
                rows += case(Whisker(d=d), a, how, socket)
                tables.write(out / "linear.csv", rows)
    # The same taps on three meshes: what the mesh leaves.
    for d in (4.0, 10.0):
        for a in (21.0, 48.0):
            for h, n_r in ((2.0, 3), (1.0, 6)) if quick else ((2.0, 3), (1.0, 6), (0.5, 12)):
                mesh += [{"h_mm": h, **r} for r in case(Whisker(d=d), a, h=h, n_r=n_r)]
    tables.write(out / "mesh.csv", mesh)
    constants = []
    for how, socket in CLAMPS:
        for nu in sorted({r["nu"] for r in rows}):
            seen, group = set(), []
            for r in rows:
                key = (r["d_mm"], r["L_a_mm"], r["a_mm"])
                if (r["clamp"], r["socket_mm"], r["nu"]) == (how, socket, nu) and key not in seen:
                    seen.add(key)
                    group.append((Whisker(d=r["d_mm"], L_a=r["L_a_mm"], nu=nu), r["a_mm"], r["theta_rad_per_N"]))
            far = [g for g in group if g[1] >= 21.0]
            if len(far) < 4:
                continue
            k = 1.011 * rod.cowper(nu) / rod.cowper(0.5)
            one, worst_one = fit_one(far, k)
            four, worst_four = fit_four([g for g in group if g[1] >= 18.0])
            constants.append(
                dict(clamp=how, socket_mm=socket, nu=nu, cases=len(group), one_k=k, one_c0=float(one), one_worst=float(worst_one),
                     **{f"four_{n}": float(v) for n, v in zip(("c0", "k", "b", "c"), four)}, four_worst=float(worst_four))
            )  # fmt: skip
    tables.write(out / "clamp_constants.csv", constants)


if __name__ == "__main__":
    main(sys.argv[1], "--quick" in sys.argv)
