"""`vibrissa.strain` as the objective of scipy.optimize: taper, gauge and tap angle with the least spread of K within the gauge's limit.

The library's own search (`vibrissa.optimise`) answers the same question; here it is for those who have an objective of their own.
    python scipy_search.py
"""

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution

import vibrissa

A = np.arange(21.0, 49.0, 3.0)
BOUNDS = [(3, 10), (3, 15), (2, 8)]  # d mm, x_ss mm, theta degrees
LIMIT = 0.05


def taps(x):
    """K at every distance, and the largest strain, of one candidate or of many: x has one column for each, as scipy's `vectorized` asks."""
    d, x_ss, theta = np.asarray(x)[..., None]
    tap = vibrissa.strain(10.0, d, 50.0, x_ss, 2.0, A, theta, full=True, precision="f64")
    return tap.K, np.abs(tap.strain).max(axis=-1)


def spread(x):
    """Sample standard deviation of K over the distances; a design that loses a tap is no answer."""
    return np.nan_to_num(taps(x)[0].std(axis=-1, ddof=1), nan=1.0)


def main(generations=60):
    limit = NonlinearConstraint(lambda x: np.nan_to_num(taps(x)[1], nan=1.0)[None], 0, LIMIT)
    found = differential_evolution(spread, BOUNDS, constraints=limit, vectorized=True, updating="deferred", maxiter=generations, rng=1, polish=False)
    own = vibrissa.optimise(whisker=dict(D=10, L_a=50), gauge=dict(l=2), tap=dict(a=A), run=dict(backend="cpu"), optimise=dict(
        objective="sd", variables=dict(d=BOUNDS[0], x_ss=BOUNDS[1], theta=BOUNDS[2]), limits=dict(strain=LIMIT)))
    print(f"scipy:    d = {found.x[0]:.4f} mm, x_ss = {found.x[1]:.4f} mm, theta = {found.x[2]:.4f} degrees: K_sd = {float(found.fun):.4e}")
    print(f"vibrissa: d = {own.best['d_tip_mm']:.4f} mm, x_ss = {own.best['x_ss_mm']:.4f} mm, theta = {own.best['theta_deg']:.4f} degrees: K_sd = {own.value:.4e}")
    return float(found.fun), own.value


if __name__ == "__main__":
    main()
