"""Values that say their unit: converted to that of their key, or refused. No library of units is needed; those there are have an interface in common."""

from __future__ import annotations

import types
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _native
from ._errors import InputError, short

UNITS: dict[str, str] = dict(_native.units())
"""Unit of every key of a spec under its dotted name, "" where it has none."""

READ = frozenset(_native.read_columns())
"""Columns of measurements that are read as numbers."""

PROPERTIES = {
    "exponent": "", "bore_mm": "mm", "core_mm": "mm", "E_core_MPa": "MPa", "kappa_base_per_mm": "1/mm", "kappa_slope_per_mm2": "1/mm**2",
    "k_theta_Nmm_per_rad": "N*mm/rad", "k_y_N_per_mm": "N/mm", "k_x_N_per_mm": "N/mm", "hub_mm": "mm", "E_MPa": "MPa", "nu": "", "pole_radius_mm": "mm", "mu": "",
    "foil_N_per_mm": "N/mm", "noise": ""}
"""Columns of properties of the rig, with their units."""

# As the engine says of the keys of an axis.
_THAT_OF_THE_KEY = "that of the key"
_PLAIN = frozenset({float, int, bool, str, np.float64, np.float32, np.int64, np.int32, type(None)})
# As libraries read a unit; and as people write it beside a column.
_READ = {"degrees": "deg", "": "dimensionless"}
_WRITTEN = {
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "degrees": ("deg", "degree", "degrees", "°"),
    "MPa": ("MPa", "megapascal"), "N": ("N", "newton", "newtons"), "s": ("s", "second", "seconds"), "": ("", "1", "-", "dimensionless", "strain"),
}
_NO_UNITS = (type(None), types.FunctionType, types.MethodType, types.BuiltinMethodType)
_ANGLES = ("rad", "deg", "arcmin", "arcsec")


def unit_of(key: str) -> str | None:
    """Unit of the value under the dotted ``key`` of a spec, "" where it has none; None of a key that is not known."""
    found = UNITS.get(key)
    if found is None and "." in key:
        parent, last = key.rsplit(".", 1)
        found = UNITS.get(f"axis.{last}")
        if found == _THAT_OF_THE_KEY:
            return unit_of(parent)
    return found


def unit_of_column(name: str) -> str | None:
    """Unit of a column of measurements, which its name says; "" where it has none, None where the name says nothing."""
    for end, unit in (("_mm", "mm"), ("_deg", "degrees"), ("_N", "N"), ("_MPa", "MPa"), ("_s", "s"), ("_mV_per_V", "mV/V"), ("_mV_per_V_2", "mV/V")):
        if name.endswith(end):
            return unit
    return {"strain": "", "strain_2": "", "microstrain": "microstrain", "microstrain_2": "microstrain"}.get(name)


def _said(value: Any) -> tuple[Any, Any]:
    """What holds the numbers of ``value``, and the unit that it says; None where it says none."""
    if getattr(value, "quantity", None) is not None and hasattr(value.quantity, "units"):
        value = value.quantity  # A column of pint.
    elif hasattr(getattr(value, "array", None), "quantity"):
        value = value.array.quantity
    elif hasattr(value, "dims") and _said(getattr(value, "data", None))[1] is not None:
        value = value.data  # xarray round a quantity.
    elif hasattr(value, "compute") and _said(getattr(value, "_meta", None))[1] is not None:
        value = value.compute()  # dask round quantities.
    if hasattr(value, "iloc"):
        said = None  # An attribute of a frame may be one of its columns.
    else:
        said = next((x for x in (getattr(value, name, None) for name in ("units", "unit")) if not isinstance(x, _NO_UNITS)), None)
    attributes = getattr(value, "attrs", None)
    if said is None and isinstance(attributes, Mapping):
        said = next((attributes[name] for name in ("units", "unit") if attributes.get(name) is not None), None)
    if isinstance(said, Mapping):  # Of all columns of a frame.
        said = said.get(getattr(value, "name", None))
    return value, said.decode(errors="replace") if isinstance(said, bytes) else said


def is_labelled(value: Any) -> bool:
    """Whether ``value`` is of plain numbers beside which a unit is written."""
    return isinstance(_said(value)[1], str)


def has_quantities(column: Any) -> bool:
    """Whether a column of a frame is of quantities, or some of its objects are."""
    said = _said(column)[1]
    if said is not None and not isinstance(said, str):
        return True
    return str(getattr(column, "dtype", "")) == "object" and any(_said(x)[1] is not None for x in column if type(x) not in _PLAIN)


def _same_kind(before: Any, after: Any, unit: str) -> bool:
    """Whether a conversion made no angle of a pure number, and none of an angle: some libraries count radians as ones."""
    if hasattr(before, "to_base_units"):
        return bool(before.to_base_units().units == after.to_base_units().units)
    if hasattr(before, "dimensionality") and unit in ("degrees", "", "mV/V"):
        return any(name in str(before.dimensionality) for name in _ANGLES) == (unit == "degrees")
    return True


def _converted(value: Any, unit: str) -> Any:
    """The numbers of a quantity in ``unit``; None where it cannot be told in it."""
    if unit == "microstrain":
        strain = _converted(value, "")
        return None if strain is None else 1e6 * strain
    convert = getattr(value, "to", None) or getattr(value, "rescale", None)
    if not callable(convert):
        return None
    try:
        found = convert(_READ.get(unit, unit) if unit or hasattr(value, "rescale") else "")
        if not _same_kind(value, found, unit):
            return None
    except Exception:  # Every library has exceptions of its own.
        return None
    numbers = getattr(found, "magnitude", None)
    return getattr(found, "value", None) if numbers is None else numbers


def _read(key: str, value: Any, unit: str | None) -> Any:
    """The numbers of what may say a unit."""
    holder, said = _said(value)
    if said is None:
        return value
    numbers = None if unit is None else _converted(holder, unit)
    if numbers is None and unit is not None and isinstance(said, str) and said.strip() in _WRITTEN.get(unit, (unit,)):
        numbers = value
    if numbers is not None:
        return numbers[()] if isinstance(numbers, np.ndarray) and numbers.ndim == 0 else numbers
    said = str(said) or "none"
    if unit is None:
        why, allowed = f"it has a unit ({said}), and none is known here", "a number without a unit"
    elif unit == "":
        why, allowed = f"its unit ({said}) is not that of a pure number", "a number, or a quantity without dimension"
    else:
        why, allowed = f"its unit ({said}) is not {unit}", f"a number in {unit}, or a quantity that converts to it"
    raise InputError(why, key=key, value=short(value), allowed=allowed)


def bare(key: str, value: Any, unit: str | None) -> Any:
    """``value`` with every quantity in it as a number in ``unit``; whatever says no unit is as it was.

    ``unit`` is "" where quantities are pure numbers, None where no unit is known.

    Raises:
        InputError: a quantity that cannot be told in this unit.
    """
    kind = type(value)
    if kind in _PLAIN or kind is np.ndarray and value.dtype.kind != "O":
        return value
    if isinstance(value, (list, tuple)):
        return value if set(map(type, value)) <= _PLAIN else [bare(key, x, unit) for x in value]
    if isinstance(value, np.ndarray) and value.dtype.kind == "O" and not isinstance(value, np.ma.MaskedArray):
        read = np.empty(value.shape, dtype=object)
        for place, x in enumerate(value.flat):
            read.flat[place] = bare(key, x, unit)
        return read
    return _read(key, value, unit)


def has_flags(value: Any) -> bool:
    """Whether truth values stand in a list, of which numpy would make numbers beside others."""
    if not isinstance(value, (list, tuple)):
        return False
    kinds = set(map(type, value))
    return bool(kinds & {bool, np.bool_}) or bool(kinds & {list, tuple}) and any(map(has_flags, value))


def filled(value: Any) -> tuple[Any, Any]:
    """The values of a column, anything where they are missing, and where they are, if that stands beside them."""
    if isinstance(value, np.ma.MaskedArray):
        return np.asarray(value.data), np.ma.getmaskarray(value)
    if hasattr(value, "unmasked") and hasattr(value, "mask"):  # astropy
        return np.asarray(value.unmasked), np.asarray(value.mask)
    kind: Any = getattr(value, "dtype", None)
    if hasattr(kind, "numpy_dtype") and hasattr(value, "isna") and kind.kind in "fiub":  # pandas
        return value.to_numpy(dtype=kind.numpy_dtype, na_value=0), np.asarray(value.isna())
    return value, None
