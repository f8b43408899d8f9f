"""scipy.integrate.solve_bvp, one process per core."""

import os
import sys
from multiprocessing import Pool

import numpy as np
from scipy.integrate import solve_bvp

from problem import Taps, best_time, report

GAUGE, WEIGHTS = np.polynomial.legendre.leggauss(4)


def solve(task):
    """q (S(x1) - S(x2)) of one tap; the unknowns q a^2 and c/a are parameters, lengths are in units of a."""
    tolerance, tau, a, theta, x1, x2, q, c = task
    tau, x1, x2 = tau * a, x1 / a, x2 / a

    def slope(w, y, p):
        s = p[1] * (1 - w)
        return p[1] * np.vstack([p[0] * y[1] / (1 - tau * s) ** 4, np.cos(y[0]), np.sin(y[0])])

    def ends(contact, clamp, p):
        angle = clamp[0] - np.arctan2(clamp[2], clamp[1]) - theta
        return np.array([*contact, angle, clamp[1] ** 2 + clamp[2] ** 2 - 1])

    w = np.linspace(0, 1, 9)
    guess = np.vstack([1.5 * theta * (1 - (1 - w) ** 2), w, 0.5 * theta * w])
    found = solve_bvp(slope, ends, w, guess, p=[q * a**2, c / a], tol=tolerance, max_nodes=20_000)
    if not found.success:
        return np.nan
    load, arc = found.p
    s = 0.5 * (x1 + x2) + 0.5 * (x2 - x1) * GAUGE
    lever = found.sol(1 - s / arc)[1]
    return load * 0.5 * (x2 - x1) * np.sum(WEIGHTS * lever / (1 - tau * s) ** 3)


def main(path):
    for tolerance, count in ((1e-3, 1000), (1e-6, 400)):
        taps = Taps(path, count)
        tasks = list(zip(np.full(count, tolerance), *taps.inputs(), *taps.start()))
        with Pool(len(os.sched_getaffinity(0))) as pool:
            gauge, seconds = best_time(lambda: pool.map(solve, tasks, chunksize=20), repeats=1)
        report(f"scipy solve_bvp tol {tolerance:g}", taps, seconds, taps.strain_of(1, np.array(gauge)))


if __name__ == "__main__":
    main(sys.argv[1])
