"""Small angles: deflection and bending strain per newton of a tapered rod held in one of three ways; the clamp shift c0."""

import numpy as np

from fourier import Body, Whisker, radial, stations


def body(w, a, clamp="bonded", socket=0.0, h=0.6, n_r=8, extra=()):
    """Mesh fine at the wall and at the contact, coarse elsewhere. h: largest cell, mm per 10 mm of D."""
    k = w.D / 10
    h, end = h * k, min(a + 0.9 * w.D, max(w.L_a, a + 0.05 * w.D))
    pts, sz = [0.0], [h / 6]
    for x in sorted(extra):
        if x - pts[-1] > 0.4 * k:  # no slivers: strains are interpolated, a gauge need not end on a line
            pts.append(x), sz.append(h / 2)
    if a - pts[-1] < 0.4 * k:
        pts.pop(), sz.pop()
    pts += [a, end]
    sz += [h / 4, h]
    if socket > 0:
        pts, sz = [-socket] + pts, [h] + sz
    return Body(w, stations(pts, sz), radial(n_r, 3.0), clamp, socket)


def solve(w, a, gauges, clamp="bonded", socket=0.0, h=0.6, n_r=8):
    """theta (rad per N, from the motion of the section at a) and bending strain per N of every gauge (x1, x2)."""
    c, s = np.cos(w.alpha), np.sin(w.alpha)
    b = body(w, a, clamp, socket, h, n_r, extra=[x for g in gauges for x in g if 0 < x < a])
    raw, skin = b.solve(1, b.point_load(a))
    lateral, turn, _ = b.section(1, raw[:, 0], a)
    raw0, _ = b.solve(0, b.point_load(a))
    axial = b.section(0, raw0[:, 0], a)[2]
    # Motion of the contact point against its normal, as the section carries it.
    R = float(w.R(a))
    push = -(lateral * c + (turn * R + axial) * s)
    theta = push / (a * c - R * s)
    strains = []
    for x1, x2 in gauges:
        u1, u2 = b.skin_along(skin[:, 0], [x1, x2])
        strains.append((u2 - u1) / ((x2 - x1) / c))
    return theta, np.array(strains), b.u.N + b.p.N
