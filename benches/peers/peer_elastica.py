"""PyElastica: one tap, relaxed dynamically until its strain stays within 1e-3 of the static answer.

A clamped Cosserat rod is pushed by a frictionless point at the place of the object in the base frame. Its shear and stretching stiffness are
those of an E and G 100 times larger than bending has, so that it approaches the unshearable, inextensible rod. Units: mm, g, ms (N, MPa).
"""

import sys
import time

import elastica as ea
import numpy as np

from problem import Taps, report

ELEMENTS = 25
STIFF = 100.0
TIME_LIMIT = 120.0


class Point(ea.NoForces):
    """A frictionless point that pushes the rod sideways, with a penalty stiffness (N/mm)."""

    def __init__(self, place, stiffness):
        super().__init__()
        self.place, self.stiffness = place, stiffness

    def apply_forces(self, system, time=np.float64(0.0)):
        x, y = system.position_collection[0], system.position_collection[1]
        i = int(np.clip(np.searchsorted(x, self.place[0]) - 1, 0, len(x) - 2))
        along = np.array([x[i + 1] - x[i], y[i + 1] - y[i]])
        length = np.hypot(*along)
        along /= length
        gap = self.place - np.array([x[i], y[i]])
        share = float(gap @ along) / length
        normal = np.array([-along[1], along[0]])
        force = self.stiffness * float(gap @ normal) * normal
        for node, weight in ((i, 1 - share), (i + 1, share)):
            system.external_forces[0, node] += weight * force[0]
            system.external_forces[1, node] += weight * force[1]


class Simulation(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    pass


def gauge_strain(rod, tau, D, x1, x2):
    """Mean bending strain over the gauge, from the curvature at the inner nodes."""
    kappa = np.hypot(rod.kappa[0], rod.kappa[1])
    s = np.cumsum(rod.rest_lengths)[:-1] - 0.5 * rod.rest_lengths[0]
    at = np.linspace(x1, x2, 9)
    return float(np.mean(np.interp(at, s, kappa) * 0.5 * D * (1 - tau * at)))


def main(path):
    taps = Taps(path)
    # An ordinary tap: 5° in the middle of the whisker. Nearer the tip, the rod would slip off while it oscillates.
    taps = taps.take([np.argmin(np.abs(taps.a - 33) / 10 + np.abs(np.degrees(taps.theta) - 5))])
    tau, a, theta, x1, x2 = (float(x[0]) for x in taps.inputs())
    D, length, E, density = float(taps.D[0]), 50.0, 3.2, 1.2e-3
    simulation = Simulation()
    # The first element is fixed; the rod bends from the middle of it, which is placed at the clamp.
    element = length / (ELEMENTS - 0.5)
    s = np.arange(ELEMENTS) * element
    rod = ea.CosseratRod.straight_rod(
        ELEMENTS, np.array([-0.5 * element, 0, 0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), ELEMENTS * element,
        0.5 * D * (1 - tau * s), density, youngs_modulus=E, shear_modulus=E * STIFF,
    )
    rod.shear_matrix[2, 2, :] *= STIFF
    simulation.append(rod)
    simulation.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    place = a * np.array([np.cos(theta), -np.sin(theta)])
    simulation.add_forcing_to(rod).using(Point, place=place, stiffness=200.0)
    # The fastest wave along an element bounds the step.
    dt = 0.3 * element * np.sqrt(density / (STIFF * E))
    simulation.dampen(rod).using(ea.AnalyticalLinearDamper, translational_damping_constant=0.05, rotational_damping_constant=0.05, time_step=dt)
    simulation.finalize()
    stepper = ea.PositionVerlet()
    now, answer, last, settled, start = 0.0, float(taps.strain[0]), np.nan, None, None
    while True:
        for _ in range(1000):
            now = stepper.step(simulation, now, dt)
        if start is None:
            # The first batch includes compilation.
            start = time.perf_counter()
            continue
        spent = time.perf_counter() - start
        last = gauge_strain(rod, tau, D, x1, x2)
        if abs(last / answer - 1) > 1e-3:
            settled = None
        elif settled is None:
            settled = spent
        # Settled if within the bound for as long again as it took to reach it.
        if (settled is not None and spent > 2 * settled + 0.5) or spent > TIME_LIMIT:
            break
    seconds = settled if settled is not None else float("inf")
    report(f"PyElastica, {ELEMENTS} elements, to 1e-3", taps, seconds, np.array([last]))


main(sys.argv[1])
