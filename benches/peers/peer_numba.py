"""Numba, f64, parallel over taps on all cores: classical Runge-Kutta shooting with a fixed number of steps and corrections."""

import sys
from math import atan2, cos, hypot, sin

import numpy as np
from numba import njit, prange

from problem import Taps, best_time, report


@njit(inline="always")
def slope(tau, q, c, t, psi, x):
    u = 1 / (1 - tau * (c - t))
    return q * x * u**4, cos(psi), sin(psi), x * u**3


@njit(fastmath=True)
def march(tau, q, c, begin, end, n, psi, x, y, s):
    h = (end - begin) / n
    for i in range(n):
        t = begin + i * h
        a1, b1, c1, d1 = slope(tau, q, c, t, psi, x)
        a2, b2, c2, d2 = slope(tau, q, c, t + h / 2, psi + h / 2 * a1, x + h / 2 * b1)
        a3, b3, c3, d3 = slope(tau, q, c, t + h / 2, psi + h / 2 * a2, x + h / 2 * b2)
        a4, b4, c4, d4 = slope(tau, q, c, t + h, psi + h * a3, x + h * b3)
        psi += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        x += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        y += h / 6 * (c1 + 2 * c2 + 2 * c3 + c4)
        s += h / 6 * (d1 + 2 * d2 + 2 * d3 + d4)
    return psi, x, y, s


@njit(parallel=True, fastmath=True)
def shoot(steps, corrections, tau, a, theta, x1, x2, q0, c0, gauge):
    few = steps // 6
    for i in prange(len(a)):
        q, c = q0[i], c0[i]
        for _ in range(corrections):
            far = march(tau[i], q, c, 0.0, c - x2[i], steps - 2 * few, 0.0, 0.0, 0.0, 0.0)
            near = march(tau[i], q, c, c - x2[i], c - x1[i], few, far[0], far[1], far[2], far[3])
            base = march(tau[i], q, c, c - x1[i], c, few, near[0], near[1], near[2], near[3])
            gauge[i] = q * (near[3] - far[3])
            q *= theta[i] / (base[0] - atan2(base[2], base[1]))
            c += a[i] - hypot(base[1], base[2])


def main(path):
    taps = Taps(path)
    gauge = np.empty(len(taps))
    for steps, corrections in ((12, 5), (24, 8)):
        run = lambda: shoot(steps, corrections, *taps.inputs(), *taps.start(), gauge)
        _, seconds = best_time(run)
        report(f"numba f64 parallel, RK4 {steps} steps x {corrections}", taps, seconds, taps.strain_of(1, gauge))


main(sys.argv[1])
