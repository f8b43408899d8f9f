"""Compliance of a patch of the skin, harmonic by harmonic: what foil and contact need.

Harmonics 0 to 3 see the whole whisker; the higher ones die out within about a radius, so a short piece of it serves."""

import numpy as np

from fourier import Body, radial, stations

FAR = 4  # first harmonic that is solved on the short piece


def build(w, whole, short, eta, lo, hi, components, distances, harmonics, carried=False):
    """`whole`, `short`: mesh lines along z, the same inside [lo, hi]. `components`: list of (U, V, W) directions of the unit loads.
    Returns nodes (z), C[m] with index (node, direction) flattened, and per distance the displacement of the patch G[m] under a unit normal
    force at (a, phi = 0) and the section's own motion against that force, mm per N. `carried`: C leaves out the rigid motion of the section at
    distances[0], so that the patch is seen from that section (normal loads only)."""
    long_body, short_body = Body(w, whole, eta), Body(w, short, eta)
    if short[0] > 0:
        short_body.clamp = "free"
        short_body.fixed = lambda m: (short_body.r < 1e-12)  # m >= 2 only: no rigid motion is left
    C, G, z = [], [], None
    rigid = np.zeros(len(distances))
    cos, sin = np.cos(w.alpha), np.sin(w.alpha)
    for m in range(harmonics + 1):
        b = long_body if m < FAR else short_body
        inside = np.flatnonzero((b.skin_z > lo - 1e-9) & (b.skin_z < hi + 1e-9))
        z = b.skin_z[inside]
        n = len(inside) * len(components)
        pick = np.zeros((b.u.N, n))
        for j, direction in enumerate(components):
            for k in range(3):
                pick[b.skin[k][inside], np.arange(len(inside)) * len(components) + j] = direction[k]
        if m == 0:
            pick[b.skin[1]] = 0
        loads = np.hstack([pick] + [b.point_load(a) for a in distances]) if m < FAR else pick
        raw, skin = b.solve(m, loads)
        C.append(pick.T @ skin[:, :n])
        G.append(pick.T @ skin[:, n:] if m < FAR else np.zeros((n, len(distances))))
        if m < 2 and carried:
            for j in range(n):
                lateral, turn, axial = b.section(m, raw[:, j], distances[0])
                C[m][:, j] += cos * (lateral - turn * (z - distances[0])) + sin * (axial + turn * w.R(z))
        if m < 2:
            for i, a in enumerate(distances):
                lateral, turn, axial = b.section(m, raw[:, n + i], a)
                rigid[i] -= lateral * cos + (turn * float(w.R(a)) + axial) * sin
    return z, C, G, rigid


__all__ = ["build", "radial", "stations"]
