"""Taps given one by one, in place of axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._containers import named_columns
from ._errors import InputError
from ._spec import Section, Spec, resolve, section
from ._taps import ALLOWED, columns
from ._units import PROPERTIES, UNITS

_TUPLES = {"D_mm": "D", "d_mm": "d", "L_a_mm": "L_a", "x_ss_mm": "x_ss", "l_mm": "l", "a_mm": "a"}
_DIRECTIONS = {"tilt_deg": "tilt", "lean_deg": "lean"}
_SECTIONS = {"whisker": ("D", "d", "L_a"), "gauge": ("x_ss", "l"), "tap": ("a", "tilt", "lean", "theta", "delta")}


class Listed(NamedTuple):
    """What was asked of a sweep or of shapes."""

    path: str | None
    """Path of the spec, if it is in a file."""
    text: str
    """The spec that goes over it."""
    taps: tuple[list[str], list[NDArray[np.float64]]] | None
    """Taps given one by one: names of their columns, and these."""
    told: list[str]
    """What to warn of."""


def listed(spec: Spec, tuples: Any, sections: dict[str, Section | None]) -> Listed:
    """A spec with these sections, and taps given one by one."""
    if tuples is None or isinstance(tuples, Mapping) and set(tuples) == {"file"}:
        return Listed(*resolve(spec, {**sections, "tuples": tuples}), None, [])
    rows, n, told = _rows(tuples, sections)
    names = ["d_tip_mm" if name == "d_mm" else name for name in rows]
    return Listed(*resolve(spec, sections), (names, [np.array(np.broadcast_to(x, n)) for x in rows.values()]), told)


def _rows(tuples: Any, sections: dict[str, Section | None]) -> tuple[dict[str, NDArray[np.float64]], int, list[str]]:
    """Columns that are read, those of a tuple first, of one value or of as many as there are rows; that number; what to warn of."""
    said = {name: section(name, sections.get(name)) or {} for name in _SECTIONS}
    for name, keys in _SECTIONS.items():
        written = [key for key in keys if key in said[name]]
        if written:
            raise InputError("this comes from the tuples; remove one of the two", key=f"{name}.{written[0]}")
    drive = ("delta_mm", "delta") if said["tap"].get("drive") == "displacement" else ("theta_deg", "theta")
    wanted = {**_TUPLES, drive[0]: drive[1]}
    known = {**wanted, **_DIRECTIONS, **{name: name for name in PROPERTIES}}
    # As tables of results call it.
    named = [("d_mm" if name == "d_tip_mm" else name, column) for name, column in named_columns(tuples, "tuples", {*known, "d_tip_mm"})]
    names = [name for name, _ in named]
    for name in known:
        if names.count(name) > 1:
            raise InputError(f"column {name} is there {names.count(name)} times", key="tuples", value=", ".join(names), allowed="each column once")
    for name in wanted:
        if name not in names:
            raise InputError(f"column {name} is missing", key="tuples", value=", ".join(names), allowed=", ".join(wanted))
    held = dict(named)
    read = {known[name]: held[name] for name in known if name in held}
    units = {key: PROPERTIES.get(key, UNITS.get(f"tap.{key}", "mm")) for key in read}
    shape, n, flat = columns(read, {key: ALLOWED.get(key, "numbers") for key in read}, units, prefix="tuples.")
    if len(shape) > 1:
        raise InputError("columns of tuples have one dimension", key="tuples", value=f"shape {tuple(shape)}")
    for key, values in zip(read, flat):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise InputError("this is not a finite number", key=f"tuples.{key}", value=f"{values[bad[0]]} in row {bad[0]}", allowed=ALLOWED.get(key, "numbers"))
    ignored = ", ".join(name for name in names if name not in known)
    return dict(zip((name for name in known if name in held), flat)), n, [f"tuples: ignored columns {ignored}"] if ignored else []
