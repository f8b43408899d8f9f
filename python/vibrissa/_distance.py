"""Distances from strains by the exact model, without a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, short, warn
from ._keywords import keywords
from ._spec import document, number, section
from ._taps import ALLOWED, Status, _inputs, _solver_of, columns
from ._units import UNITS

_PLACES = {"whisker": ("D", "d", "L_a"), "gauge": ("x_ss", "l")}
# Places at which the strain of a drive is looked at, and steps of the search between two of them.
_LOOKS = 129
_STEPS = 40
# Relative slack of ends: that of the range of interest of a sweep.
_WIDENING = 1e-6
# A contact at the tip may show less than without noise, by so many standard deviations.
_BEYOND = 3.0


class Distance(NamedTuple):
    """Distances; each an array of the common shape, or a number. NaN where there is none: ``status`` says why."""

    distance_mm: Any
    """Contact distance, mm."""
    sigma_mm: Any
    """One standard deviation, mm, of ``gauge["noise_strain"]``: σ_ε/|∂ε/∂a|; NaN where no noise is said."""
    status: Any
    """Bits of :class:`vibrissa.Status`: ``no_root`` of a strain above that of every distance, ``ambiguous`` where a second distance in the range of interest
    gives it (with noise the tip does, too, where it shows at most 3 σ more), ``no_strain`` of a strain of 0, ``outside_calibration`` where a distance could lie beyond the whisker only, ``invalid_geometry``, ``bad_input`` of what is no
    finite number."""
    jacobian: Any = None
    """With ``grad``: derivatives of the distance, in the order asked, along one more axis."""


@keywords
def distance(strain: Any, theta: Any = None, *, delta: Any = None, whisker: Mapping[str, Any], gauge: Mapping[str, Any], model: Mapping[str, Any] | None = None,
             estimate: Mapping[str, Any] | None = None, grad: str | tuple[str, ...] | list[str] | None = None) -> Distance:
    """Distances at which a whisker shows these strains, by inverting the model of :func:`vibrissa.strain`.

    Beyond the peak of its strain a whisker shows less the farther it touches, and before it the nearer. Most strains have a distance on either side. The
    farther one is returned, up to ``L_a``, and ``ambiguous`` says that the nearer one lies in the range of interest. Where only one lies on the whisker, it
    is that one: here only distances count at which the whisker can be touched. A sweep with ``theory="exact"`` says ``ambiguous`` also where the second one
    lies beyond the tip, because the theories that it compares continue the taper.

    Args:
        strain: mean strain of the gauge; its sign plays no part. Number or array.
        theta: tap angle, degrees, number or array; or
        delta: displacement of the object, mm.
        whisker, gauge: one whisker, as of :func:`vibrissa.sweep`; ``gauge["noise_strain"]`` is the standard deviation of a strain.
        model: as of :func:`vibrissa.sweep`.
        estimate: ``range``, the distances of interest, ``(15, 45)`` in mm; those of the whole whisker where left out.
        grad: derivatives by these, too: ``"strain"``, and inputs as of :func:`vibrissa.strain`.

    Returns:
        :class:`Distance`.

    Raises:
        InputError: a whisker that is not one, shapes that do not broadcast, a key or value that is not allowed.

    Source: docs/model.md §3; derivatives by the implicit function theorem.

    >>> found = distance(0.02233, 4.0, whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=2e-5), estimate=dict(range=(15, 45)))
    >>> round(found.distance_mm, 2), round(found.sigma_mm, 2), found.status.words
    (30.0, 0.02, 'ok')
    """
    if (theta is None) == (delta is None):
        raise InputError("a tap has one drive", key="theta", allowed="theta (degrees) or delta (mm)")
    name, drive = ("theta", theta) if delta is None else ("delta", delta)
    curve, noise, reach = _asked(whisker, gauge, model, estimate, delta is not None)
    asked = [] if grad is None else _inputs(grad)
    shape, n, (readings, drives) = columns({"strain": strain, name: drive}, {"strain": "numbers", name: ALLOWED[name]}, {"strain": "", name: UNITS[f"tap.{name}"]})
    readings, drives = (x if len(x) == n else x.repeat(n) for x in (np.abs(readings), drives))
    if n == 0:
        none = shape.of(np.empty(0))
        return Distance(none, none, shape.of(np.empty(0, np.uint16)), shape.of(np.empty(0), asked) if asked else None)
    a, status = np.full(n, np.nan), np.zeros(n, np.uint16)
    bad = ~(np.isfinite(readings) & np.isfinite(drives))
    status[bad] = int(Status.bad_input)
    outside = ~bad & ((drives <= 0) | (drives >= (90 if name == "theta" else np.inf)) | (not curve.is_whisker()))
    status[outside] = int(Status.invalid_geometry)
    status[~bad & ~outside & (readings == 0)] = int(Status.no_strain)
    told = status == 0
    if told.any():
        a[told], status[told] = _solved(curve, readings[told], drives[told], reach, noise or 0.0)
    warn(curve.doubts)
    there = ~np.isnan(a)
    wanted = ["a", *(by for by in asked if by not in ("strain", "a"))]
    value, slopes = np.full(n, np.nan), np.full((n, len(wanted)), np.nan)
    if there.any() or asked:
        # Names of inputs are told by the model, also where there is no distance.
        at = there if there.any() else slice(0, 1)
        some = curve.slopes(np.where(there, a, 1.0)[at], np.where(np.isfinite(drives), drives, 1.0)[at], wanted)
        if there.any():
            value[at], slopes[at] = some
    by_a, sign = slopes[:, 0], np.sign(value)
    sigma = np.full(n, np.nan) if noise is None else noise / np.abs(by_a)
    of = dict(zip(wanted, -slopes.T / by_a), strain=sign / by_a)
    jacobian = shape.of(np.stack([of[by] for by in asked], axis=-1), asked) if asked else None
    if not shape:
        return Distance(float(a[0]), float(sigma[0]), Status(int(status[0])), jacobian)
    return Distance(shape.of(a), shape.of(sigma), shape.of(status), jacobian)


class _Curve:
    """|strain| of one whisker over its distances."""

    def __init__(self, text: str, fixed: dict[str, float]) -> None:
        self.solver, doubts = _solver_of(text)
        self.doubts = dict.fromkeys(doubts)
        self.numbers = list(fixed.values())
        self.near, self.far = fixed["x_ss"], fixed["L_a"]

    def _columns(self, a: NDArray[np.float64], drives: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        return [*(np.array([x]) for x in self.numbers), np.ascontiguousarray(a), np.ascontiguousarray(drives)]

    def __call__(self, a: NDArray[np.float64], drives: NDArray[np.float64]) -> NDArray[np.float64]:
        found, _, doubts = self.solver.many(len(a), self._columns(a, drives), False)
        self.doubts.update(dict.fromkeys(doubts))
        strains: NDArray[np.float64] = np.abs(found[0])
        return strains

    def slopes(self, a: NDArray[np.float64], drives: NDArray[np.float64], by: list[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Strains and their derivatives."""
        (values,), slopes, _ = self.solver.many(len(a), self._columns(a, drives), False, by)
        return values, slopes.reshape(len(a), len(by))

    def is_whisker(self) -> bool:
        """Whether a tap of it lies in the domain anywhere."""
        places = self.far * np.linspace(0, 1, 9)[1:]
        (_, statuses, _), *_ = self.solver.many(len(places), self._columns(places, np.ones(len(places))), True)
        return not all(int(status) & Status.invalid_geometry for status in statuses)


def _asked(whisker: Any, gauge: Any, model: Any, estimate: Any, displaced: bool) -> tuple[_Curve, float | None, tuple[float, float]]:
    """The whisker, the noise of its gauge, and the range of interest. Every other key is checked as that of a spec."""
    said = {name: dict(section(name, given) or {}) for name, given in (("whisker", whisker), ("gauge", gauge), ("model", model), ("estimate", estimate))}
    fixed = {}
    for name, keys in _PLACES.items():
        for key in keys:
            if said[name].get(key) is None:
                raise InputError("this is missing", key=f"{name}.{key}", allowed=ALLOWED[key])
            value = said[name].pop(key)
            if np.ndim(value):
                raise InputError("one whisker has one number", key=f"{name}.{key}", value=short(value), allowed=ALLOWED[key])
            fixed[key] = number(f"{name}.{key}", value, UNITS[f"{name}.{key}"])
    for key in said["estimate"]:
        if key != "range":
            raise InputError("a distance is told by the model itself", key=f"estimate.{key}", value=short(said["estimate"][key]), allowed="range")
    noise = said["gauge"].get("noise_strain")
    noise = None if noise is None else number("gauge.noise_strain", noise, UNITS["gauge.noise_strain"])
    curve = _Curve(document({**said, **({"tap": {"drive": "displacement"}} if displaced else {})}), fixed)
    wide = said["estimate"].get("range")
    lo, hi = (curve.near, curve.far) if wide is None else (number("estimate.range", x, "mm") for x in wide)
    return curve, noise, (lo * (1 - _WIDENING), hi * (1 + _WIDENING))


def _solved(shown: _Curve, reading: NDArray[np.float64], drives: NDArray[np.float64], reach: tuple[float, float],
            noise: float) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Distances and statuses of readings > 0 at drives of a whisker."""
    near, far = shown.near, shown.far
    different, which = np.unique(drives, return_inverse=True)
    rows = np.arange(len(different))
    places = near + (far - near) * np.linspace(0, 1, _LOOKS)[1:]
    curves = shown(np.tile(places, len(different)), different.repeat(len(places))).reshape(len(different), -1)
    # The peak, more closely.
    top = np.nanargmax(np.where(np.isnan(curves), -1, curves), axis=1)
    step = places[1] - places[0]
    around = np.minimum(places[top][:, None] + step * np.linspace(-1, 1, 66)[None, 1:-1], far)
    close = shown(around.reshape(-1), different.repeat(around.shape[1])).reshape(around.shape)
    best = np.nanargmax(np.where(np.isnan(close), -1, close), axis=1)
    peak, height = around[rows, best], close[rows, best]
    higher = ~(height >= curves[rows, top])
    peak, height = np.where(higher, places[top], peak), np.where(higher, curves[rows, top], height)
    # From the end of the curve back: the last place that shows a value.
    last = places.size - 1 - np.argmax(~np.isnan(curves[:, ::-1]), axis=1)
    end, low = places[last], curves[rows, last]
    # Before the gauge there is no strain; a gauge at the very base shows nearly the same strain of all contacts on it.
    first, least = (near, np.zeros(len(different))) if near > 0 else (places[0], curves[:, 0])
    # A contact at the end is one, whatever rounding makes of it.
    # Where the strain rises up to the tip there is no farther side.
    falls = (peak < end)[which]
    on_far = falls & (reading <= height[which]) & (reading >= low[which] * (1 - _WIDENING))
    on_near = (reading <= height[which]) & (reading >= least[which])
    status = np.zeros(reading.size, np.uint16)
    status[~(on_far | on_near)] = int(Status.outside_calibration)
    status[~(reading <= height[which])] = int(Status.no_root)

    def before(x: float) -> NDArray[np.float64]:
        """The strain up to which the nearer distance is at most ``x``: before the peak it rises."""
        if x <= near:
            return np.zeros(reading.size)
        return np.where(x < peak, np.nan_to_num(shown(np.full(len(different), min(x, far)), different)), np.inf)[which]

    inside = (reading >= before(reach[0])) & (reading <= before(reach[1]))
    at_tip = falls & ~on_far & (low[which] - reading <= _BEYOND * noise) & (end[which] >= reach[0]) & (end[which] <= reach[1])
    status[on_near & (on_far & inside | at_tip)] = int(Status.ambiguous)
    only_near = on_near & ~on_far
    # f(lo) ≥ reading ≥ f(hi), or the other way round before the peak.
    lo, hi = np.where(only_near, first, peak[which]), np.where(only_near, peak[which], end[which])
    f_lo = np.where(only_near, least[which], height[which]) - reading
    f_hi = np.minimum(np.where(only_near, height[which], low[which]) - reading, np.where(only_near, np.inf, 0.0))
    open_ = np.flatnonzero((on_far | on_near) & (f_hi != 0))
    for k in range(_STEPS):
        if open_.size == 0:
            break
        l, h, fl, fh = lo[open_], hi[open_], f_lo[open_], f_hi[open_]
        with np.errstate(invalid="ignore", divide="ignore"):
            x = h - fh * (h - l) / (fh - fl)
        middle = 0.5 * (l + h)
        x = np.where((k % 3 == 2) | ~((x > np.minimum(l, h)) & (x < np.maximum(l, h))), middle, x)
        fx = np.nan_to_num(shown(x, drives[open_]), nan=-np.inf) - reading[open_]
        same = (fx > 0) == (fh > 0)
        with np.errstate(invalid="ignore", divide="ignore"):
            keep = 1 - fx / fh
        lo[open_] = np.where(same, l, h)
        f_lo[open_] = np.where(same, fl * np.where(keep > 0, keep, 0.5), fh)
        hi[open_], f_hi[open_] = x, fx
        open_ = open_[(np.abs(lo[open_] - x) > 1e-12 * far) & (fx != 0)]
    return np.where(on_far | on_near, hi, np.nan), status
