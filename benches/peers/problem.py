"""The frictionless Hooke rod of docs and README: taps, equations, error measure; shared by all peers.

Seen from the contact, t = c - s runs from the contact (t = 0) to the clamp (t = c). With q = 64 P / (pi E D^4):
    psi' = q X / (1 - tau s)^4,   X' = cos psi,   Y' = sin psi,   S' = X / (1 - tau s)^3,
and the object is where it was if psi_b - atan(Y/X) = theta and X^2 + Y^2 = a^2 at the clamp; unknown are q and c.
The mean gauge strain is q D/2 (S(x1) - S(x2)) / (x2 - x1).
"""

import copy
import json
import sys
import time

import numpy as np


class Taps:
    """Columns of a tuples.csv that the reference wrote."""

    def __init__(self, path, count=None):
        table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
        rows = np.random.default_rng(1).permutation(len(table))[: count or len(table)]
        table = table[rows]
        # genfromtxt makes D and d two columns of one name; it keeps their order.
        names = table.dtype.names
        self.D, self.d, length, place, grid, self.a = (table[n].astype(float) for n in names[:6])
        self.length, self.place, self.grid = length, place, grid
        self.theta = np.radians(table["theta_deg"])
        self.tau = (self.D - self.d) / (self.D * length)
        half_angle = np.arctan((self.D - self.d) / (2 * length))
        self.x1, self.x2 = place, place + grid * np.cos(half_angle)
        self.strain = table["strain"]

    def take(self, rows):
        """These taps only."""
        taps = copy.copy(self)
        taps.__dict__.update({name: column[rows] for name, column in self.__dict__.items()})
        return taps

    def __len__(self):
        return len(self.a)

    def inputs(self):
        """tau, a, theta, x1, x2."""
        return self.tau, self.a, self.theta, self.x1, self.x2

    def start(self):
        """q and c of the linear theory."""
        return 3 * self.theta * (1 - self.tau * self.a) / self.a**2, self.a

    def strain_of(self, q, s):
        """Mean gauge strain from q and S(x1) - S(x2)."""
        return 0.5 * self.D * q * s / (self.x2 - self.x1)

    def errors(self, strain):
        """p99 (nearest rank, as everywhere) and worst of |strain - reference| / max(|reference|, 1e-3 theta f_max)."""
        b1, b2 = 1 / (1 - self.tau * self.x1), 1 / (1 - self.tau * self.x2)
        total, moment = b1 + b2, self.x1 * b1 + self.x2 * b2
        u = np.minimum(0.5 * (total / moment + self.tau), 1 / self.x2)
        peak = 0.75 * self.D * b1 * b2 * (u - self.tau) * (total - moment * u)
        error = np.abs(strain - self.strain) / np.maximum(np.abs(self.strain), 1e-3 * self.theta * peak)
        error = np.where(np.isfinite(error), error, np.inf)
        return float(np.quantile(error, 0.99, method="inverted_cdf")), float(error.max())


def best_time(run, repeats=3):
    """Result and seconds of the fastest of some runs; the first, which may compile, does not count."""
    run()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = run()
        seconds.append(time.perf_counter() - start)
    return result, min(seconds)


def report(name, taps, seconds, strain):
    """One line of JSON on stdout."""
    p99, worst = taps.errors(np.asarray(strain, dtype=float))
    print(json.dumps({"name": name, "taps": len(taps), "taps_per_second": len(taps) / seconds, "p99": p99, "worst": worst}))
    sys.stdout.flush()
