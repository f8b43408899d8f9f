"""Keywords and mappings as the text of a spec (TOML), which the library reads like any other."""

from __future__ import annotations

import numbers
import os
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, Union

import numpy as np

from ._errors import InputError, short
from ._keywords import keywords
from ._units import bare, unit_of

_T = TypeVar("_T")

Section = Mapping[str, Any]
Spec = Union[str, "os.PathLike[str]", Mapping[str, Section], None]

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_ESCAPES = {**{i: f"\\u{i:04x}" for i in (*range(32), 127)}, ord('"'): '\\"', ord("\\"): "\\\\"}


@keywords
def axis(start: float, stop: float, *, steps: int | None = None, step: float | None = None, scale: str = "linear") -> dict[str, Any]:
    """An even (``scale="linear"``) or logarithmic (``"log"``) axis from ``start`` to ``stop``, both ends included.

    Args:
        start, stop: ends, in the unit of the key it is given to (mm, degrees).
        steps: number of points; or
        step: their distance; ``stop`` is a point when a step falls on it.
    """
    given = {"steps": steps, "step": step, "scale": None if scale == "linear" else scale}
    return {"from": start, "to": stop, **{k: v for k, v in given.items() if v is not None}}


@keywords
def samples(low: float, high: float, n: int, *, sampler: str = "sobol", seed: int = 0, scale: str = "linear") -> dict[str, Any]:
    """``n`` points between ``low`` and ``high``, ``"sobol"`` (Owen-scrambled) or ``"random"``. Sampled axes of one spec share their points."""
    given = {"min": low, "max": high, "samples": n, "sampler": sampler, "seed": seed}
    return given if scale == "linear" else {**given, "scale": scale}


def _is_number(value: Any) -> bool:
    """A truth value is none, and a span of time is only of numpy's opinion."""
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_, np.timedelta64))


def _text(key: str, value: Any) -> str:
    """``value`` as TOML on one line; ``key`` names it in complaints, and says the unit of quantities."""
    if not isinstance(value, (list, tuple)):
        value = bare(key, value, unit_of(key))
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{plain(key, value).translate(_ESCAPES)}"'
    if _is_number(value):
        return str(int(value)) if isinstance(value, numbers.Integral) else repr(float(value))
    if isinstance(value, os.PathLike):
        return _text(key, os.fspath(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_name(k)} = {_text(f'{key}.{k}', v)}" for k, v in value.items() if v is not None) + " }"
    if isinstance(value, (list, tuple, range)):
        return "[" + ", ".join(_text(key, v) for v in value) + "]"
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise InputError("masked values are no numbers", key=key, allowed="an array without a mask")
    if hasattr(value, "__array__") and not isinstance(value, type):
        array = np.asarray(value)
        if array.ndim > 1:
            raise InputError(f"an axis has one dimension, not {array.ndim}", key=key, value=f"array of shape {array.shape}", allowed="a one-dimensional array")
        if array.dtype.kind in "mMcVS":
            raise InputError(f"{array.dtype} is nothing that a spec holds", key=key, value=short(value), allowed="an array of numbers or words")
        return _text(key, array.tolist())
    kind = type(value).__name__
    raise InputError(f"{kind} is nothing that a spec holds", key=key, value=short(value), allowed="numbers, words, true or false, lists, ranges, numpy arrays, dicts")


def _whole_text(key: str, value: Any) -> str:
    try:
        return _text(key, value)
    except RecursionError:
        raise InputError("this holds itself, or is nested too deep", key=key, value=short(value), allowed="numbers, words, lists of them") from None


def plain(key: str, text: str) -> str:
    """``text``, if it is one: halves of characters are none."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise InputError("this is no text: it holds half of a character", key=key, value=ascii(text), allowed="Unicode text") from None
    return text


def _name(key: Any) -> str:
    if not isinstance(key, str):
        raise InputError("a key must be a word", key=short(key), allowed="str")
    return key if _BARE.fullmatch(key) else _text("spec", key)


def number(key: str, value: Any, unit: str | None = None) -> float:
    """``value`` as a float; a quantity is told in ``unit``, and refused where there is none."""
    value = bare(key, value, unit)
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "fiu":
        value = value[()]
    if _is_number(value):
        try:
            return float(value)
        except OverflowError:
            pass
    raise InputError("this is no number", key=key, value=short(value), allowed="a number that a float holds")


def whole(key: str, value: Any, most: int = 2**63 - 1, least: int = 0) -> int:
    """``value`` as a whole number from ``least`` to ``most``."""
    if _is_number(value) and isinstance(value, numbers.Integral) and least <= int(value) <= most:
        return int(value)
    raise InputError("this is no such number", key=key, value=short(value), allowed=f"a whole number from {least} to {most}")


def flag(key: str, value: Any) -> bool:
    """``value`` if it is true or false."""
    if value is True or value is False:
        return bool(value)
    if isinstance(value, np.bool_) or _is_number(value) and value in (0, 1):
        return bool(value)
    raise InputError("this is neither true nor false", key=key, value=short(value), allowed="True, False")


def word(key: str, value: Any) -> str:
    """``value`` if it is a word."""
    if isinstance(value, str):
        return plain(key, value)
    raise InputError("this is no word", key=key, value=short(value), allowed="str")


def given(read: Callable[..., _T], key: str, value: Any, *unit: str | None) -> _T | None:
    """``value`` as ``read`` reads it, perhaps with a unit; nothing stays nothing."""
    return None if value is None else read(key, value, *unit)


def section(name: str, given: Any) -> Section | None:
    """What is ``given`` as a section."""
    if given is None or isinstance(given, Mapping):
        return given
    raise InputError("a section is a dict of its keys", key=name, value=short(given), allowed=f"{name}=dict(…)")


def document(sections: Mapping[str, Section | None]) -> str:
    """``sections`` as the text of a spec; None, as a section or a value, is not there."""
    lines = []
    for name, said in sections.items():
        if name == "format" and not (said is None or isinstance(said, Mapping)):
            lines.insert(0, f"format = {_whole_text(name, said)}")
            continue
        keys = section(name, said)
        if keys is None:
            continue
        lines.append(f"[{_name(name)}]")
        lines += [f"{_name(key)} = {_whole_text(f'{name}.{key}', value)}" for key, value in keys.items() if value is not None]
    return "\n".join([*lines, ""]) if lines else ""


def resolve(spec: Spec, sections: Mapping[str, Section | None]) -> tuple[str | None, str]:
    """Path of a spec, if one is named, and the text of what goes over it."""
    if isinstance(spec, Mapping):
        merged: dict[str, Any] = dict(spec)
        for name, section in sections.items():
            if section is not None:
                old = merged.get(name)
                merged[name] = {**old, **section} if isinstance(old, Mapping) and isinstance(section, Mapping) else section
        return None, document(merged)
    if spec is None:
        return None, document(sections)
    try:
        os.fsencode(spec)
        return os.fsdecode(spec), document(sections)
    except (TypeError, UnicodeError):
        raise InputError("this is no spec", key="spec", value=short(spec), allowed="a path, a dict of sections, or nothing") from None
