"""Figures to scale: objects and what traced them, bent whiskers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, short
from ._plots import _COLOURS, _axes, _drive, _shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._results import Contour, Shapes

_Array = NDArray[np.float64]

# Standard deviations that ellipses and the band reach.
_WIDE = 2.0
# Points of which the ellipses are drawn; of more, one in so many.
_ELLIPSES = 150
_TURN = np.linspace(0.0, 2.0 * np.pi, 33)
# Whiskers in one figure, and lines that tell more of them apart than there are colours.
_WHISKERS = 4
_STYLES = ("-", "--", "-.", ":")


def _known(kind: Any, kinds: tuple[str, ...]) -> None:
    if not isinstance(kind, str) or kind not in kinds:
        raise InputError("there is no such figure", key="kind", value=short(kind), allowed=", ".join(kinds))


def _to_scale(ax: Axes) -> None:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x (mm)", ylabel="y (mm)")
    ax.legend(fontsize="small")


def contour(result: Contour, kind: str, ax: Axes | None) -> Axes:
    """Points with their ellipses, the curve with its band, both of two standard deviations."""
    _known(kind, ("closer", "where"))
    ax, points, curve = _axes(ax), result.points, result.curve
    if result.outline is not None:
        ax.plot(result.outline["x_mm"], result.outline["y_mm"], color="grey", linestyle="--", linewidth=0.9, label="the object")
    x, y = points["x_mm"], points["y_mm"]
    there = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    every = max(1, -(-len(there) // _ELLIPSES))
    _ellipses(result, there[::every], ax)
    cx, cy, across = curve["x_mm"], curve["y_mm"], _WIDE * curve["sigma_mm"]
    if len(curve) == 1:
        ax.fill(cx + across * np.cos(_TURN), cy + across * np.sin(_TURN), color=_COLOURS[1], alpha=0.25, linewidth=0)
    elif len(curve):
        direction = np.radians(curve["direction_deg"])
        beside = np.stack([-across * np.sin(direction), across * np.cos(direction)])
        left, right = (np.stack([cx, cy]) + side * beside for side in (1.0, -1.0))
        ax.fill(*np.concatenate([left, right[:, ::-1]], axis=1), color=_COLOURS[1], alpha=0.25, linewidth=0)
    off = np.array(["outlier" in (word or "") for word in points["status"][there]], dtype=bool)
    ax.plot(x[there[~off]], y[there[~off]], ".", color=_COLOURS[0], markersize=4, label="points")
    if off.any():
        ax.plot(x[there[off]], y[there[off]], "x", color=_COLOURS[6], label="outliers")
    if len(curve) == 1:
        ax.plot(cx, cy, "+", color=_COLOURS[1], markersize=9, label="one point")
    elif len(curve):
        ax.plot(cx, cy, color=_COLOURS[1], linewidth=1.2, label=result.kind)
    if kind == "where":
        bases = np.unique(np.column_stack([points["base_x_mm"][there], points["base_y_mm"][there]]), axis=0)
        ax.plot(*bases.T, "x", color=_COLOURS[2], markersize=5, label="motor's axis")
    _to_scale(ax)
    return ax


def _ellipses(result: Contour, rows: NDArray[np.int_], ax: Axes) -> None:
    from matplotlib.collections import PolyCollection

    major, minor, axis = (result.points[name][rows, None] for name in ("sigma_major_mm", "sigma_minor_mm", "axis_deg"))
    u, v = _WIDE * major * np.cos(_TURN), _WIDE * minor * np.sin(_TURN)
    cos, sin = np.cos(np.radians(axis)), np.sin(np.radians(axis))
    edge = np.stack([result.points["x_mm"][rows, None] + cos * u - sin * v, result.points["y_mm"][rows, None] + sin * u + cos * v], axis=-1)
    ax.add_collection(PolyCollection(list(edge), facecolors=_COLOURS[0], alpha=0.2, linewidths=0))


def shapes(result: Shapes, kind: str, taps: Any, ax: Axes | None) -> Axes:
    """Bent whiskers to scale, or strain along them."""
    _known(kind, ("whisker", "strain"))
    contacts = result.contacts
    numbers = contacts["tap"].astype(int)
    solved = numbers[np.isfinite(contacts["contact_x_mm"])]
    if taps is None:
        chosen = _shown(solved, _WHISKERS).astype(int)
    else:
        chosen = np.atleast_1d(np.asarray(taps))
        if chosen.dtype.kind not in "iu" or chosen.ndim > 1 or not np.isin(chosen, solved).all():
            raise InputError("there is no shape of such a tap", key="taps", value=short(taps), allowed="numbers of taps with a shape (column tap)")
        if len(chosen) > len(_COLOURS) * len(_STYLES):
            raise InputError("so many taps cannot be told apart in one figure", key="taps", value=short(taps), allowed=f"at most {len(_COLOURS) * len(_STYLES)}")
    ax = _axes(ax)
    draw = _whisker if kind == "whisker" else _strain
    draw(result, [int(tap) for tap in chosen], ax)
    return ax


def _label(result: Shapes, tap: int) -> str:
    """What tells a tap from the others."""
    column, _ = _drive(result.contacts)
    units = {"tilt_deg": "°", "lean_deg": "°", "theta_deg": "°"}
    symbols = {"theta_deg": "θ", "delta_mm": "δ"}
    names = [c for c in ("D_mm", "d_tip_mm", "L_a_mm", "a_mm", "tilt_deg", "lean_deg") if c in result.contacts and len(np.unique(result.contacts[c])) > 1]
    parts = [f"{symbols.get(c, c.removesuffix('_mm').removesuffix('_tip'))} = {result.contacts[c][tap]:g}{units.get(c, ' mm')}" for c in (*names, column)]
    return ", ".join(parts)


def _whisker(result: Shapes, taps: list[int], ax: Axes) -> None:
    """Outline, gauge, contact and pole of each."""
    from matplotlib.colors import to_rgba

    shape, contacts = result.shape, result.contacts
    far = any(said["key"] == "gauge.side" and "far" in said["value"] for said in result.run["in_force"])
    if taps:
        hub, length = contacts["hub_mm"][taps[0]], contacts["L_a_mm"][taps[0]]
        ax.plot([hub, hub + length], [0, 0], color="grey", linestyle="--", linewidth=0.9, label="at first touch")
    for k, tap in enumerate(taps):
        rows = np.flatnonzero(shape["tap"] == tap)
        x, y, s, turn = (shape[c][rows] for c in ("x_mm", "y_mm", "s_mm", "direction_deg"))
        D, d, length = (contacts[c][tap] for c in ("D_mm", "d_tip_mm", "L_a_mm"))
        wide = shape["diameter_mm"][rows] if "diameter_mm" in shape else D + (d - D) * s / length
        radius, turn = 0.5 * wide, np.radians(turn)
        across = np.stack([-radius * np.sin(turn), radius * np.cos(turn)])
        upper, lower = np.stack([x, y]) + across, np.stack([x, y]) - across
        colour, style = _COLOURS[k % 7], _STYLES[k // 7 % 4]
        ax.fill(*np.concatenate([upper, lower[:, ::-1]], axis=1), facecolor=to_rgba(colour, 0.15), edgecolor=colour, linestyle=style, linewidth=0.9, label=_label(result, tap))
        near, end = contacts["gauge_from_mm"][tap], contacts["gauge_to_mm"][tap]
        under = (s >= near) & (s <= end)
        ax.plot(*(lower if far else upper)[:, under], color=_COLOURS[4], linewidth=2.0, label="gauge" if k == 0 else None)
        pole, rho = np.array([contacts["pole_x_mm"][tap], contacts["pole_y_mm"][tap]]), contacts["pole_radius_mm"][tap]
        if rho > 0:
            ax.plot(pole[0] + rho * np.cos(_TURN), pole[1] + rho * np.sin(_TURN), color="grey", linewidth=0.9)
        ax.plot(contacts["contact_x_mm"][tap], contacts["contact_y_mm"][tap], "o", color=_COLOURS[6], markersize=4, label="contact" if k == 0 else None)
    ax.plot([0], [0], "x", color=_COLOURS[6], label="motor's axis")
    _to_scale(ax)


def _strain(result: Shapes, taps: list[int], ax: Axes) -> None:
    """Strain of the side that touches, the gauge shaded."""
    for k, tap in enumerate(taps):
        rows = np.flatnonzero(result.shape["tap"] == tap)
        ax.plot(result.shape["s_mm"][rows], result.shape["strain"][rows], color=_COLOURS[k % 7], linestyle=_STYLES[k // 7 % 4], label=_label(result, tap))
    if taps:
        ax.axvspan(result.contacts["gauge_from_mm"][taps[0]], result.contacts["gauge_to_mm"][taps[0]], color=_COLOURS[4], alpha=0.3, linewidth=0, label="gauge")
    ax.set(xlabel="arc length from the clamp s (mm)", ylabel="strain of the contact side")
    ax.legend(fontsize="small")
