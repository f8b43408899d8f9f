"""Objects that whiskers touch: points and curves, and points of several whiskers in one frame."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any, Union

import numpy as np

from ._errors import InputError, short
from ._frames import measured, text_of
from ._keywords import keywords
from ._locate import calibration_text, roles, told_together
from ._native import Table
from ._request import asked
from ._results import Calibration, Contour
from ._spec import Section, _name, _whole_text, document, flag, given, number, section, whole, word
from ._units import UNITS, bare

# As [run] threads.
_MOST_THREADS = 4096


def _zero(zero: Any) -> list[float] | None:
    """What a sensor shows without contact: of one signal, or of two."""
    if zero is None:
        return None
    numbers = [number("zero", x) for x in (zero if isinstance(zero, (list, tuple, np.ndarray)) and np.ndim(zero) == 1 else [zero])]
    if len(numbers) not in (1, 2) or not np.isfinite(numbers).all():
        raise InputError("this is no zero of such a signal", key="zero", value=", ".join(map(repr, numbers)), allowed="a number, or one for each of two signals")
    return numbers


def _path(key: str, path: Any) -> str:
    try:
        os.fsencode(path)
        return os.fsdecode(path)
    except (TypeError, UnicodeError):
        raise InputError("this is no path", key=key, value=short(path), allowed="str or os.PathLike") from None


def course(said: Any, key: str) -> tuple[str, list[tuple[str, str]]]:
    """An object to stroke: the name of its file, and that file where it is in memory."""
    if not isinstance(said, Mapping):
        return _path(key, said), []
    lines: list[str] = []
    starts: list[str] = []
    sections: dict[str, Any] = {}
    for name, value in said.items():
        if name == "start":
            for start in value if isinstance(value, (list, tuple)) else [value]:
                if not isinstance(start, Mapping):
                    raise InputError("a start is a dict of its keys", key="start", value=short(start), allowed="dict(x=…, y=…, heading=…)")
                starts += ["[[start]]", *(f"{_name(k)} = {_whole_text(f'start.{k}', v)}" for k, v in start.items() if v is not None)]
        elif isinstance(value, Mapping):
            sections[name] = value
        elif value is not None:
            lines.append(f"{_name(name)} = {_whole_text(str(name), value)}")
    name = f"{key}.keywords"
    return name, [(name, "\n".join([*lines, document(sections), *starts, ""]))]


@keywords
def contour(data: Any, calibration: Calibration | str | os.PathLike[str], *, estimator: str | None = None, angle_noise: float = 0.1,
            base_noise: float = 0.0, touch_noise: float | None = None, contact: str | None = None, taps: bool = False,
            curve: str | None = None, truth: str | os.PathLike[str] | Mapping[str, Any] | None = None, zero: float | tuple[float, float] | None = None,
            columns: dict[str, str] | str | None = None, threads: int | None = None, trust: bool = False) -> Contour:
    """Traces an object from taps and strokes of a calibrated whisker at several base poses: points with their ellipses, and a curve.

    A row of ``data`` is a reading: the motor's axis ``base_x_mm``, ``base_y_mm`` (``base_z_mm`` is passed on), ``heading_deg``, the direction
    of the undeflected whisker at first touch, counterclockwise from +x (and ``contact_deg``, which is added to it), perhaps ``sense`` (1:
    it turns counterclockwise, the default; -1) and ``stroke`` (number of the sweep); then those of :meth:`Locator.table`: ``theta_deg``
    since first touch (or ``delta_mm``) and the signal. Rows with drive 0 are zero readings.

    Args:
        data: DataFrame (pandas, polars), pyarrow Table, dict of columns, or path of a CSV file.
        calibration: what :func:`calibrate` gave, or the path of a calibration.toml.
        estimator: ``"learned"``, the default, ``"paper"``, ``"exact"`` or ``"curve"``.
        angle_noise: standard deviation of the heading at first touch, degrees.
        base_noise: standard deviation of each coordinate of the base, mm.
        touch_noise: standard deviation of the motor's angle at which a touch is noticed, degrees; None: 0 for a tap, 0.5 for a stroke,
            which finds its touch itself.
        contact: which place of the whisker touches, ``"surface"`` or ``"centreline"``; as the calibration's model has it by default.
        taps: each row is a tap, whatever its stroke.
        curve: ``"point"``, ``"line"``, ``"circle"`` or ``"smooth"``; by default the one that tells best where points lie that were left out.
        truth: the object, as :func:`simulate` takes it: ``run`` says how far from it the points are.
        zero: what the sensor shows without contact, in the unit of the signal, where no row says it; two numbers of two signals.
        columns: columns of readings under other names, ``dict(theta="angle", reading="ch3")``.
        threads: as many; all cores by default.
        trust: use a calibration that was edited by hand.

    Returns:
        :class:`Contour`: tables ``points`` and ``curve``, ``run``.

    Raises:
        InputError: data without poses or that do not fit the calibration, with ``key``, ``value``, ``allowed`` and, of a file, its line.

    Source: docs/contour.md.
    """
    table = measured(data, "data", columns)
    whisker, text = calibration_text(calibration)
    known, files = (None, []) if truth is None else course(truth, "truth")
    said = dict(
        data=table.label, calibration=whisker, estimator=given(word, "estimator", estimator), angle_noise=number("angle_noise", angle_noise, "degrees"),
        base_noise=number("base_noise", base_noise, "mm"), touch_noise=given(number, "touch_noise", touch_noise, "degrees"), contact=given(word, "contact", contact), taps=flag("taps", taps),
        curve=given(word, "curve", curve), truth=known, zero=_zero(zero), columns=roles(columns),
        force=flag("trust", trust), threads=None if threads is None else whole("threads", threads, _MOST_THREADS, 1))
    found = asked("contour", said, files=[*table.held(), (whisker, text), *files])
    return Contour([(name, table.keep(held) if name == "points" else held) for name, held in found.tables], found.run)


Whiskers = Union[str, "os.PathLike[str]", Iterable[Section]]


def _text(whiskers: Iterable[Section]) -> tuple[str, list[tuple[str, str]]]:
    """Whiskers as the text of a file, and the calibrations among them that are in no file, with the names by which it names them."""
    lines: list[str] = []
    known: list[tuple[str, str]] = []
    for said in whiskers:
        whisker = section("whisker", said) or {}
        lines.append("[[whisker]]")
        for key, value in whisker.items():
            if key == "calibration" and isinstance(value, Calibration):
                value = f"calibration {len(known) + 1}.keywords"
                known.append((value, calibration_text(whisker[key])[1]))
            if value is not None:
                lines.append(f"{_name(key)} = {_whole_text(f'whisker.{key}', bare(f'whisker.{key}', value, UNITS.get(f'array.{key}')))}")
    return "\n".join([*lines, ""]), known


@keywords
class Array:
    """Several calibrated whiskers, whose readings become points in one frame, as ``vibrissa locate --array`` tells them.

    Args:
        array: path of an array.toml, or a list of dicts with its keys: ``name``, ``calibration`` (a path, or what :func:`calibrate` gave),
            ``x``, ``y``, ``z`` of the motor's axis, mm (z is 0 by default), ``heading`` of the undeflected whisker with its motor at 0,
            degrees, ``sense`` (1, counterclockwise, by default; -1).
        angle_noise: standard deviation of the heading, degrees; goes before what the file says, 0.1 if neither says it.
        base_noise: standard deviation of each coordinate of the base, mm; likewise, 0.
        estimator: of every whisker; by default that which won in each one's calibration.
        zero: what every sensor shows without contact, in the unit of the signal; readings with drive 0 say it, too, each whisker's own.
        trust: use calibrations that were edited by hand.

    Raises:
        InputError: a key or a file that cannot be used, with ``key``, ``value`` and ``allowed``.

    Source: docs/contour.md §6.
    """

    def __init__(self, array: Whiskers, *, angle_noise: float | None = None, base_noise: float | None = None, estimator: str | None = None,
                 zero: float | tuple[float, float] | None = None, trust: bool = False) -> None:
        known: list[tuple[str, str]] = []
        if isinstance(array, (str, os.PathLike)):
            label, text = text_of(array, "array")
        else:
            if isinstance(array, (Mapping, bytes)) or not isinstance(array, Iterable):
                raise InputError("this is no array", key="array", value=short(array), allowed="a path, or a list of dicts")
            label, (text, known) = "array.keywords", _text(array)
        self._said = dict(
            array=label, angle_noise=given(number, "angle_noise", angle_noise, "degrees"), base_noise=given(number, "base_noise", base_noise, "mm"),
            estimator=given(word, "estimator", estimator), zero=_zero(zero), force=flag("trust", trust))
        files = [(label, text), *known]
        found = asked("array", self._said, files=files)
        # What was read of files goes along.
        self._files = list({**dict(files), **found.texts}.items())
        self._estimators = {w["name"]: w["estimator"] for w in json.loads(found.run)["result"]}

    @property
    def names(self) -> list[str]:
        """Names of the whiskers."""
        return list(self._estimators)

    @property
    def estimators(self) -> dict[str, str]:
        """Name of the estimator of each whisker."""
        return dict(self._estimators)

    def __repr__(self) -> str:
        return f"<Array of {', '.join(f'{name} by {estimator}' for name, estimator in self.estimators.items())}>"

    def locate(self, data: Any, columns: dict[str, str] | str | None = None, *, object: str | None = None, same: bool = False) -> Table:
        """Points of readings as ``located.csv``: their own columns, distance_mm, sigma_mm, x_mm, y_mm, z_mm and their sigmas, status.

        Args:
            data: a path, a DataFrame, a dict of columns, with ``whisker`` (its name), ``contact_deg`` where the motor was not at 0 at first
                touch, degrees, and drive and signal as of :meth:`Locator.table`.
            columns: columns of readings under other names, ``dict(theta="angle", reading="ch3")``.
            object: the column that says which object a tap is of, as of :meth:`Locator.table`: what the taps of it by one whisker tell together.
            same: all taps are of one object.

        Raises:
            InputError: a whisker that is not there, readings that do not fit a calibration.
        """
        word_, column = told_together(object, same) or (None, None)
        table = measured(data, "data", columns)
        said = dict(self._said, readings=table.label, columns=roles(columns), object=column, same=word_ == "same")
        return table.keep(asked("array", said, files=[*self._files, *table.held()]).tables[0][1])
