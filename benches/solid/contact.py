"""The skin gives way: a rigid frictionless cylinder across the whisker, small strain, unilateral contact: indentation.csv."""

import pathlib
import sys

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import patch
import tables
from fourier import Whisker

BETA = 0.185


def hertz(P, R, rho, E_star):
    """Approach of crossed cylinders of radius R and rho (elliptic contact), mm."""
    if R == rho:
        return (9 * P**2 / (16 * E_star**2 * R)) ** (1 / 3)
    big, small = max(R, rho), min(R, rho)
    # e^2 = 1 - (b/a)^2; ratio of the curvatures (Johnson, Contact Mechanics, 4.2).
    ratio = lambda m: ((ellipe(m) / (1 - m)) - ellipk(m)) / (ellipk(m) - ellipe(m)) - big / small
    m = brentq(ratio, 1e-9, 1 - 1e-9)
    # p0 = 3P/(2 pi a b); (B) = p0 b / (E* e^2 a^2) ((a/b)^2 E - K); delta = p0 b K / E*
    q = np.sqrt(1 - m)  # b / a
    A_long = 1 / (2 * big)  # the smaller curvature, along the long half-axis
    # A = p0 / E* * b / (e^2 a^2) (K - E) with p0 = 3P/(2 pi a^2 q)
    a = (3 * P / (2 * np.pi * E_star) * (ellipk(m) - ellipe(m)) / (m * A_long)) ** (1 / 3)
    return 3 * P / (2 * np.pi * a * E_star) * ellipk(m) if q > 0 else float("nan")


class Skin:
    """Normal compliance of the skin round the contact of one whisker and distance."""

    def __init__(self, w, a, h=0.12, half=1.7, harmonics=120, n_r=9, grade=12.0):
        R = float(w.R(a))
        k = R / 4
        h, half = h * k, half * k
        lo, hi = a - half, a + half
        end = min(w.L_a, a + 1.5 * R)
        short = patch.stations([a - 2.5 * R, lo, hi, max(end, hi + 0.3 * R)], [0.6 * R, h, h, 0.6 * R])
        whole = np.concatenate([patch.stations([0.0, a - 2.5 * R], [0.15, 0.6 * R])[:-1], short])
        n = (-np.cos(w.alpha), 0.0, -np.sin(w.alpha))
        x, C, G, rigid = patch.build(w, whole, short, patch.radial(n_r, grade), lo, hi, [n], [a], harmonics, carried=True)
        self.w, self.a, self.x, self.rigid = w, a, x, rigid[0]
        step = np.pi / harmonics
        self.phi = np.arange(0, 0.42 + step, step)
        cosines = np.cos(np.outer(np.arange(harmonics + 1), self.phi))
        # Forces come in pairs +-phi (one at phi 0): the number is the pair's sum.
        full = np.einsum("mxy,mp,mq->xpyq", np.array(C), cosines, cosines, optimize=True)
        self.C = full.reshape(len(x) * len(self.phi), -1)

    def gap(self, rho):
        a, R, s, c = self.a, float(self.w.R(self.a)), np.sin(self.w.alpha), np.cos(self.w.alpha)
        X, PHI = np.meshgrid(self.x, self.phi, indexing="ij")
        Y = self.w.R(X) * np.cos(PHI)
        return (np.hypot(X - (a + rho * s), Y - (R + rho * c)) - rho).ravel()

    def press(self, rho, depth):
        """Force for a cylinder that has moved `depth` (mm) beyond first touch, seen from the section at a; active set."""
        gap = self.gap(rho)
        active = gap < depth * 0.05 + 1e-9
        for _ in range(60):
            idx = np.flatnonzero(active)
            f = np.linalg.solve(self.C[np.ix_(idx, idx)], depth - gap[idx])
            open_ = idx[f < 0]
            u = self.C[:, idx] @ f
            closed = np.flatnonzero((u < depth - gap - 1e-9) & ~active)
            if len(open_) == 0 and len(closed) == 0:
                break
            if len(open_):
                active[open_] = False
            else:
                active[closed] = True
        P = f.sum()
        return P, depth, len(idx), np.max(np.abs(self.x[idx // len(self.phi)] - self.a)) / (self.x[-1] - self.a)

    def press_to(self, rho, P):
        """The indentation at force P (secant in depth)."""
        d = 0.9 * hertz(P, float(self.w.R(self.a)), rho, self.w.E / (1 - self.w.nu**2))
        d = [d, 1.05 * d]
        r = [self.press(rho, v) for v in d]
        for _ in range(6):
            if abs(r[1][0] / P - 1) < 1e-4:
                break
            new = d[1] + (P - r[1][0]) * (d[1] - d[0]) / (r[1][0] - r[0][0])
            d, r = [d[1], new], [r[1], self.press(rho, new)]
        return r[1]


def main(out, quick=False):
    rows = []
    whiskers = [(10.0, 21.0), (4.0, 21.0), (4.0, 48.0)]
    meshes = [("coarse", 0.2, 60, 7), ("fine", 0.12, 120, 9)]
    for mesh, h, harmonics, n_r in meshes[:1] if quick else meshes:
        for d, a in whiskers[:1] if quick else whiskers[:2] if mesh == "coarse" else whiskers:
            w = Whisker(d=d)
            skin = Skin(w, a, h=h, harmonics=harmonics, n_r=n_r)
            R, E_star = float(w.R(a)), w.E / (1 - w.nu**2)
            for ratio in (0.3, 0.75, 1.5, 3.0):
                for load in (0.002, 0.006, 0.02):  # P / (E R^2)
                    rho = ratio * R
                    P, delta, points, filled = skin.press_to(rho, load * w.E * R**2)
                    if filled > 0.97 or points < 20:
                        continue  # the contact leaves the fine patch, or is smaller than its mesh
                    H = hertz(P, R, rho, E_star)
                    rows.append(
                        dict(
                            mesh=mesh, D_mm=w.D, d_mm=d, a_mm=a, R_mm=R, pole_radius_mm=rho, force_N=P, force_over_ER2=P / (w.E * R**2),
                            points=points, indentation_mm=delta, hertz_mm=H, indentation_over_hertz=delta / H,
                            beta=(H - delta) * w.E * R / P, indentation_over_reduced=delta / (H - BETA * P / (w.E * R)),
                            section_motion_mm=skin.rigid * P,
                        )
                    )  # fmt: skip
        tables.write(pathlib.Path(out) / "indentation.csv", rows)


if __name__ == "__main__":
    main(sys.argv[1], "--quick" in sys.argv)
