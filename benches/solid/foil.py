"""A foil gauge glued on the skin: an isotropic membrane over a rectangle of the skin: foil.csv.

The foil is a membrane of stiffness E_g h_g (N/mm, uniaxial, per mm of width) that follows the skin exactly (no glue layer, no bending stiffness).
With B the strain of the skin at the foil's Gauss points and C the skin's compliance, the membrane forces N solve
(D^-1 + B C B^T W) N = bare strain: exact for every stiffness and width at the cost of one dense solve."""

import pathlib
import sys

import numpy as np

import patch
import rod
import tables
from fourier import Whisker

POISSON_FOIL = 0.34
CENTRE = 6.0  # mm from the wall
GRID = 2.0  # mm
SIX = np.polynomial.legendre.leggauss(6)
TWO = np.polynomial.legendre.leggauss(3)
T_FIT = [-1.0578, 0.0075, 0.1299, 0.0304, -0.0008, 0.2012, -0.42, 0.0449, 0.0458, -0.3125, 0.2399, -0.4013]


class Base:
    """The skin under a foil of one length, for one whisker and some distances."""

    def __init__(self, w, length, distances, h=0.3, harmonics=36, n_r=7, centre=CENTRE):
        k, cos = w.D / 10, np.cos(w.alpha)
        # Lengths are along the skin; the foil is centred on the grid's centre.
        lo, hi = centre - length * cos / 2, centre + length * cos / 2
        g0, g1 = centre - GRID * k * cos / 2, centre + GRID * k * cos / 2
        edge, mid = h * k / 2.5, h * k * 1.6
        inner = [lo, g0, g1, hi] if lo < g0 - 0.4 * k else [lo, hi]
        near = patch.stations([0.0] + inner, [0.5 * k] + ([edge, mid, mid, edge] if len(inner) == 4 else [edge, edge]))
        short = np.concatenate([near, patch.stations([hi, hi + 7 * k], [edge, 2 * k])[1:]])
        whole = list(short)
        for a in distances:
            whole += list(patch.stations([whole[-1], a], [2 * k, 1.5 * k])[1:])
        whole += list(patch.stations([whole[-1], min(w.L_a, whole[-1] + 0.9 * w.D)], [1.5 * k, 2 * k])[1:])
        components = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
        self.z, self.C, self.G, self.rigid = patch.build(w, np.array(whole), short, patch.radial(n_r, 8.0), lo, hi, components, distances, harmonics)
        self.w, self.length, self.distances, self.grid, self.lo, self.hi = w, length, distances, (g0, g1), lo, hi

    def forms(self, m, x):
        """Strain of the skin at stations x from (U, V, W) of the nodes: along, round, shear; index (x, node * 3 + k)."""
        z, w = self.z, self.w
        c, s = np.cos(w.alpha), np.sin(w.alpha)
        N, dN = shape(z, x)
        R = w.R(x)[:, None]
        n = len(z)
        along, round_, shear = (np.zeros((len(x), n, 3)) for _ in range(3))
        along[:, :, 0], along[:, :, 2] = -s * c * dN, c * c * dN  # d/dt = cos d/dz, u_t = -sin U + cos W
        round_[:, :, 0], round_[:, :, 1] = N / R, m * N / R
        shear[:, :, 1] = c * dN + s * N / R
        shear[:, :, 0], shear[:, :, 2] = m * s * N / R, -m * c * N / R
        return [f.reshape(len(x), -1) for f in (along, round_, shear)]

    def glue(self, stiffness, width, poisson=POISSON_FOIL):
        """Per distance: bare strain of the grid (first harmonic), mean strain of the foil's grid, both per N; relative change of theta."""
        w = self.w
        ends = self.z[::2]
        x = np.concatenate([0.5 * (b - a) * TWO[0] + 0.5 * (a + b) for a, b in zip(ends, ends[1:])])
        wx = np.concatenate([0.5 * (b - a) * TWO[1] for a, b in zip(ends, ends[1:])]) / np.cos(w.alpha)
        y = 0.5 * (SIX[0] + 1) * width / 2  # half of the width
        wy = SIX[1] * width / 2  # both halves
        phi = y[None, :] / w.R(x)[:, None]
        n = phi.size
        A, bare = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, len(self.distances)))
        first = np.zeros((len(x), len(self.distances)))
        for m, (C, G) in enumerate(zip(self.C, self.G)):
            cosine, sine = np.cos(m * phi).ravel(), np.sin(m * phi).ravel()
            F = self.forms(m, x)
            B = np.vstack([np.repeat(f, len(y), axis=0) * t[:, None] for f, t in zip(F, (cosine, cosine, sine))])
            A += B @ C @ B.T
            bare += B @ G
            if m == 1:
                first = F[0] @ G
        weight = np.tile(np.outer(wx, wy).ravel(), 3)
        D = stiffness / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
        S = np.kron(np.linalg.inv(D), np.eye(n))
        N = np.linalg.solve(S + A * weight, bare)
        eps = (S @ N)[:n].reshape(len(x), len(y), -1)
        inside = (x > self.grid[0]) & (x < self.grid[1])
        g = wx[inside] / wx[inside].sum()
        # A grid of half the foil's width reads; 2.8 mm foils carry grids of 1 to 1.5 mm.
        narrow = y < width / 4
        gy = wy[narrow] / wy[narrow].sum()
        reading = np.einsum("x,xyd,y->d", g, eps[inside][:, narrow], gy)
        push = -np.einsum("id,i,id->d", bare, weight, N)
        lever = [a * np.cos(w.alpha) - float(w.R(a)) * np.sin(w.alpha) for a in self.distances]
        return g @ first[inside], reading, push / self.rigid, np.array(lever)


def shape(z, x):
    e = np.clip(np.searchsorted(z[::2], x, side="right") - 1, 0, (len(z) - 1) // 2 - 1)
    h = z[2 * e + 2] - z[2 * e]
    t = (x - z[2 * e]) / h
    N, dN = np.zeros((len(x), len(z))), np.zeros((len(x), len(z)))
    i = np.arange(len(x))
    for k, (f, g) in enumerate([((2 * t - 1) * (t - 1), 4 * t - 3), (4 * t * (1 - t), 4 - 8 * t), (t * (2 * t - 1), 4 * t - 1)]):
        N[i, 2 * e + k], dN[i, 2 * e + k] = f, g / h
    return N, dN


def transfer(w, stiffness, length, centre=CENTRE):
    """T of the reduced model."""
    y, q, u = np.log10(stiffness / (w.E * length)), np.log(length / 6.3), w.taper * length / float(w.R(centre))
    lam = length * np.exp(np.dot(T_FIT, [1, y, y**2, y**3, y**4, q, q * q, q * y, q * y * y, u, u * y, u * q]))
    return 1 / (1 + stiffness / (w.E * lam))


def stiffening(w, stiffness, length, a, centre=CENTRE):
    """Relative change of theta per N of the reduced model: EI -> EI / (1 - chi) over the foil."""
    T, z, t = transfer(w, stiffness, length), length / float(w.R(centre)), w.taper
    chi = (-0.008 + 0.229 * z - 0.0216 * z * z) * (1 - T) * (1 - 0.065 * T + 0.393 * T * T) * (1 + 1.446 * t)
    c, s, R = np.cos(w.alpha), np.sin(w.alpha), float(w.R(a))
    half = length * c / 2
    bend = rod.integral(lambda x: ((a - x) * c - R * s) ** 2 * 4 / (np.pi * w.E * w.R(x) ** 4), centre - half, centre + half)
    return -chi * bend / (a * c - R * s) / rod.theta(w, a, **rod.BONDED_FOUR)


def main(out, quick=False):
    rows = []
    distances = [21.0, 33.0, 48.0]
    jobs = [("fine", d, length, 0.4, 32, 6) for d, length in ((10.0, 6.3), (10.0, 3.0), (10.0, 10.0), (4.0, 6.3))]
    jobs = [("coarse", d, 6.3, 0.6, 20, 5) for d in (4.0, 10.0)] + jobs
    for mesh, d, length, h, harmonics, n_r in jobs[:2] if quick else jobs:
        w = Whisker(d=d)
        base = Base(w, length, distances, h, harmonics, n_r)
        for stiffness in (10.0, 100.0, 1000.0) if quick else (1.0, 10.0, 30.0, 100.0, 300.0, 1000.0):
            for width in (1.5, 2.8, 5.0):
                bare, reading, change, _ = base.glue(stiffness, width)
                for i, a in enumerate(distances):
                    T = transfer(w, stiffness, length)
                    rows.append(
                        dict(
                            mesh=mesh, D_mm=w.D, d_mm=d, a_mm=a, x_centre_mm=CENTRE, l_mm=GRID, foil_length_mm=length, foil_width_mm=width,
                            foil_stiffness_N_per_mm=stiffness, bare_strain_per_N=float(bare[i]), reading_per_N=float(reading[i]),
                            T_3d=float(reading[i] / bare[i]), T_reduced=float(T), T_3d_over_reduced=float(reading[i] / bare[i] / T),
                            theta_change_3d=float(change[i]), theta_change_reduced=float(stiffening(w, stiffness, length, a)),
                        )
                    )  # fmt: skip
            tables.write(pathlib.Path(out) / "foil.csv", rows)


if __name__ == "__main__":
    main(sys.argv[1], "--quick" in sys.argv)
