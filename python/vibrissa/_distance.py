"""Distances from strains by the exact model, without a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _taps
from ._errors import InputError, short
from ._spec import section
from ._taps import _SECTION, ALLOWED, Status, _inputs, columns
from ._units import UNITS

_PLACES = {"whisker": ("D", "d", "L_a"), "gauge": ("x_ss", "l")}
# Places at which the strain of a drive is looked at, and steps of the search between two of them.
_LOOKS = 129
_STEPS = 40
_strain: Any = _taps.strain


class Distance(NamedTuple):
    """Distances; each an array of the common shape, or a number. NaN where there is none: ``status`` says why."""

    distance_mm: Any
    """Contact distance, mm."""
    sigma_mm: Any
    """One standard deviation, mm, of ``gauge["noise_strain"]``: σ_ε/|∂ε/∂a|; NaN where no noise is said."""
    status: Any
    """Bits of :class:`vibrissa.Status`: ``no_root`` of a strain that no distance gives, ``ambiguous`` of the nearer of two distances."""
    jacobian: Any = None
    """With ``grad``: derivatives of the distance, in the order asked, along one more axis."""


def distance(strain: Any, theta: Any = None, *, delta: Any = None, whisker: Mapping[str, Any], gauge: Mapping[str, Any], model: Mapping[str, Any] | None = None,
             grad: str | tuple[str, ...] | list[str] | None = None) -> Distance:
    """Distances at which a whisker shows these strains, by inverting the model of :func:`vibrissa.strain`.

    Beyond the peak of its strain a whisker shows less the farther it touches. The distance is sought there, up to ``L_a``; where only the nearer side of
    the peak shows the strain, it is that one, and ``ambiguous``.

    Args:
        strain: mean strain of the gauge; its sign plays no part. Number or array.
        theta: tap angle, degrees, number or array; or
        delta: displacement of the object, mm.
        whisker, gauge: one whisker, as of :func:`vibrissa.sweep`; ``gauge["noise_strain"]`` is the standard deviation of a strain.
        model: as of :func:`vibrissa.sweep`.
        grad: derivatives by these, too: ``"strain"``, and inputs as of :func:`vibrissa.strain`.

    Returns:
        :class:`Distance`.

    Raises:
        InputError: a whisker that is not one, shapes that do not broadcast, a key or value that is not allowed.

    Source: docs/model.md §3; derivatives by the implicit function theorem.

    >>> found = distance(0.02233, 4.0, whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=2e-5))
    >>> round(found.distance_mm, 2), round(found.sigma_mm, 2)
    (30.0, 0.02)
    """
    if (theta is None) == (delta is None):
        raise InputError("a tap has one drive", key="theta", allowed="theta (degrees) or delta (mm)")
    name, drive = ("theta", theta) if delta is None else ("delta", delta)
    fixed, others, noise = _whisker(whisker, gauge, model)
    asked = [] if grad is None else _inputs(grad)
    shape, n, (readings, drives) = columns({"strain": strain, name: drive}, {"strain": "numbers", name: ALLOWED[name]}, {"strain": "", name: UNITS[f"tap.{name}"]})
    readings, drives = (x if len(x) == n else x.repeat(n) for x in (np.abs(readings), drives))
    if n == 0:
        none = shape.of(np.empty(0))
        return Distance(none, none, shape.of(np.empty(0, np.uint16)), shape.of(np.empty(0), asked) if asked else None)

    def shown(a: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
        found: NDArray[np.float64] = np.abs(_strain(**fixed, a=a, **{name: at}, **others))
        return found

    a, status = _solved(shown, readings, drives, fixed)
    outside = (drives <= 0) | (drives >= 90) if name == "theta" else drives <= 0
    a[outside], status[outside] = np.nan, Status.invalid_geometry
    wanted = ["a", *(by for by in asked if by not in ("strain", "a"))]
    value, slopes = _strain(**fixed, a=np.where(np.isnan(a), 1.0, a), **{name: drives}, **others, grad=wanted)
    slopes[np.isnan(a)] = np.nan
    by_a, sign = slopes[:, 0], np.sign(value)
    sigma = np.full(n, np.nan) if noise is None else noise / np.abs(by_a)
    of = dict(zip(wanted, -slopes.T / by_a), strain=sign / by_a)
    jacobian = shape.of(np.stack([of[by] for by in asked], axis=-1), asked) if asked else None
    if not shape:
        return Distance(float(a[0]), float(sigma[0]), Status(int(status[0])), jacobian)
    return Distance(shape.of(a), shape.of(sigma), shape.of(status), jacobian)


def _whisker(whisker: Any, gauge: Any, model: Any) -> tuple[dict[str, Any], dict[str, Any], float | None]:
    """The five numbers of a whisker, keywords of :func:`strain`, and the noise."""
    said = {"whisker": dict(section("whisker", whisker) or {}), "gauge": dict(section("gauge", gauge) or {}), "model": dict(section("model", model) or {})}
    fixed = {}
    for name, keys in _PLACES.items():
        for key in keys:
            if key not in said[name]:
                raise InputError("this is missing", key=f"{name}.{key}", allowed=ALLOWED[key])
            fixed[key] = said[name].pop(key)
            if np.ndim(fixed[key]):
                raise InputError("one whisker has one number", key=f"{name}.{key}", value=short(fixed[key]), allowed=ALLOWED[key])
    noise = said["gauge"].pop("noise_strain", None)
    said["gauge"].pop("factor", None)
    for name in ("whisker", "gauge"):
        for key in said[name]:
            if _SECTION.get(key) != name:
                raise InputError("unknown key", key=f"{name}.{key}", allowed=", ".join([*_PLACES[name], *(k for k, s in _SECTION.items() if s == name)]))
    return fixed, {**said["whisker"], **said["gauge"], **said["model"]}, noise


def _solved(shown: Any, readings: NDArray[np.float64], drives: NDArray[np.float64], fixed: dict[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Distances and statuses."""
    near, far = float(fixed["x_ss"]), float(fixed["L_a"])
    different, which = np.unique(drives, return_inverse=True)
    places = near + (far - near) * np.linspace(0, 1, _LOOKS)[1:]
    curves = np.asarray(shown(np.tile(places, len(different)), different.repeat(len(places)))).reshape(len(different), -1)
    # The peak, more closely.
    top = np.nanargmax(np.where(np.isnan(curves), -1, curves), axis=1)
    step = places[1] - places[0]
    around = np.minimum(places[top][:, None] + step * np.linspace(-1, 1, 66)[None, 1:-1], far)
    close = np.asarray(shown(around.reshape(-1), different.repeat(around.shape[1]))).reshape(around.shape)
    best = np.nanargmax(np.where(np.isnan(close), -1, close), axis=1)
    rows = np.arange(len(different))
    peak, height = around[rows, best], close[rows, best]
    # From the end of the curve back: the last place that shows a value.
    last = places.size - 1 - np.argmax(~np.isnan(curves[:, ::-1]), axis=1)
    end, low = places[last], curves[rows, last]
    reading, status = readings, np.zeros(readings.size, np.uint16)
    on_far, on_near = (reading <= height[which]) & (reading >= low[which]), reading < low[which]
    status[~(on_far | on_near)] = int(Status.no_root)
    status[on_near] = int(Status.ambiguous)
    # f(lo) ≥ reading ≥ f(hi), or the other way round next to the gauge.
    lo, hi = np.where(on_far, peak[which], near), np.where(on_far, end[which], peak[which])
    f_lo = np.where(on_far, height[which], 0.0) - reading
    f_hi = np.where(on_far, low[which], height[which]) - reading
    open_ = np.flatnonzero(on_far | on_near)
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
    found = np.where(on_far | on_near, hi, np.nan)
    return found, status
