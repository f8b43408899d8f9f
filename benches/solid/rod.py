"""Closed forms of the rod at small angles, and the corrections of the reduced model. Units: mm, N, MPa."""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
BONDED_FOUR = dict(c0=0.0532, k=1.1157, b=-0.7278, c=-0.6836)
NEAR_CLAMP = dict(A=0.576, p=7.137, B=-0.1616, c1=0.5508, c2=-0.0084)


def integral(f, lo, hi):
    x = 0.5 * (hi - lo) * NODES + 0.5 * (hi + lo)
    return 0.5 * (hi - lo) * (WEIGHTS @ f(x))


def cowper(nu):
    return 6 * (1 + nu) / (7 + 6 * nu)


def terms(w, a, c0, b):
    """The integrals of the clamp formula: bending, shear, axial; each divided by the lever, rad per N."""
    cos, sin = np.cos(w.alpha), np.sin(w.alpha)
    Ra = float(w.R(a))
    m = lambda s: (a - s) * cos - Ra * sin
    G = w.E / (2 * (1 + w.nu))
    area = lambda s: np.pi * w.R(s) ** 2
    lever = a * cos - Ra * sin
    bending = integral(lambda s: m(s) ** 2 / (w.E * np.pi * w.R(s) ** 4 / 4), c0 * w.D, a)
    shear = integral(lambda s: cos**2 / (G * area(s)), b * w.D, a)
    axial = integral(lambda s: sin**2 / (w.E * area(s)), 0.0, a)
    return bending / lever, shear / lever, axial / lever, lever


def theta(w, a, c0=0.0, k=None, b=None, c=0.0):
    """rad per N. k None: Euler's rod, no shear."""
    bend, shear, axial, lever = terms(w, a, c0, c0 if b is None else b)
    return bend + (shear / k if k else 0.0) + axial + c / (w.E * float(w.R(a))) / lever


def strain(w, a, x1, x2, near=None):
    """Bending strain per N, mean over [x1, x2]; `near`: the factors of the strain near the clamp."""
    cos, sin = np.cos(w.alpha), np.sin(w.alpha)
    Ra, t = float(w.R(a)), np.tan(w.alpha)

    def point(x):
        R = w.R(x)
        eps = ((a - x) * cos - Ra * sin) * 4 / (np.pi * w.E * R**3)
        if near:
            e = np.exp(-near["p"] * x / w.D)
            eps = eps * (1 - near["A"] * e + near["c2"] * t**2)
            eps = eps + 4 * cos / (np.pi * w.E * R**3) * (near["B"] * w.D * e + near["c1"] * t * R)
        return eps

    return integral(point, x1, x2) / (x2 - x1)


def clamp_shift(w, a, theta_3d, k):
    """c0 (in D) that makes the one-number formula (b = c0, c = 0) give theta_3d."""
    from scipy.optimize import brentq

    return brentq(lambda c0: theta(w, a, c0=c0, k=k) - theta_3d, -1.5, 0.5)
