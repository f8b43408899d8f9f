"""Readings to distances."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Union

import numpy as np

from . import _native
from ._errors import InputError, short, warn
from ._frames import measured, text_of
from ._keywords import keywords
from ._labels import by_name
from ._request import asked
from ._results import Calibration, Simulation
from ._spec import flag, given, number, plain, word
from ._taps import _SCALARS, Status, columns
from ._units import unit_of_column


class Located(NamedTuple):
    """Distances; each a number, or an array of the common shape. NaN where there is none: ``status`` says why."""

    distance_mm: Any
    """Contact distance, mm."""
    sigma_mm: Any
    """One standard deviation, mm: noise of a reading, of the calibration, bias on distances left out."""
    status: Any
    """Bits of :class:`vibrissa.Status`."""


def told_together(object: str | None, same: bool, strokes: bool = False, free: str | None = None) -> tuple[str, str | None] | None:
    """Which readings of a table are told together."""
    column = given(word, "object", object)
    ways = {"object": column is not None, "same": flag("same", same), "strokes": flag("strokes", strokes)}
    said = [name for name, value in ways.items() if value]
    if len(said) > 1:
        raise InputError("readings are told together in one way", key=said[1], value=", ".join(said), allowed=f"one of {', '.join(ways)}")
    left = given(word, "free", free)
    if left is not None and said != ["strokes"]:
        raise InputError("only strokes leave something free", key="free", value=left, allowed="strokes=True beside it")
    return (said[0], left or column) if said else None


class About(NamedTuple):
    """What never changes of a locator."""

    estimator: str | None
    drive: str
    channels: list[str]
    only_drive: float | None
    noise: list[float]
    warnings: list[str]
    doubts: list[str]


class NextTap(NamedTuple):
    """What the taps of an object tell so far, and what one more would bring."""

    taps: int
    """Taps so far."""
    distance_mm: float | None
    """Distance that they tell; None without taps."""
    sigma_mm: float
    """Its standard deviation, mm."""
    near_mm: float | None
    """Another distance that fits as well."""
    drive: float | None
    """Best drive of the next tap, degrees or mm; None where none is within the limits of the sensor."""
    shift_mm: float | None
    """How much nearer to the object than where its distance is told from the base stands for it, mm."""
    expected_sigma_mm: float | None
    """Standard deviation that is expected after it, mm."""
    least_sigma_mm: float | None
    """What no number of such taps goes below, mm: the error of calibration and run, which all taps share."""
    status: Status
    """Words of the taps so far: ambiguous, outside_calibration, inconsistent."""
    drives: Any
    """Drives that were tried."""
    shifts_mm: Any
    """Where the base stands for each, mm nearer."""
    sigmas_mm: Any
    """Standard deviation that is expected after each."""
    statuses: Any
    """Bits of :class:`vibrissa.Status`: what forbids each."""


@keywords
class Locator:
    """Distances of readings of one calibrated whisker, as ``vibrissa locate`` tells them.

    Args:
        calibration: a :class:`vibrissa.Calibration`, or the path of a calibration.toml; of one signal or of several channels.
        estimator: ``"learned"``, the default, ``"paper"``, ``"exact"`` or ``"curve"``; of one signal.
        zero: what the sensor shows without contact, in the unit of the signal; readings with drive 0 say it, too. Of one signal.
        trust: use a file that was edited by hand.
        same_run: the readings are of a run of the calibration, whose zero and gain are known. Of one signal.

    Raises:
        InputError: a file that cannot be used, an estimator that the calibration does not hold.
    """

    def __init__(self, calibration: Calibration | str | os.PathLike[str], *, estimator: str | None = None,
                 zero: float | None = None, trust: bool = False, same_run: bool = False) -> None:
        label, text = calibration_text(calibration)
        self.__setstate__((label, text, given(word, "estimator", estimator), given(number, "zero", zero), flag("trust", trust), flag("same_run", same_run)))
        warn(self._about.warnings)

    def __setstate__(self, args: tuple[Any, ...]) -> None:
        self._args = args
        self._native = _native.Locator(*args)
        self._about = About(*self._native.about)
        self._channels, self._doubts = self._about.channels, self._about.doubts

    def __getstate__(self) -> tuple[Any, ...]:
        return self._args

    @property
    def estimator(self) -> str:
        """Name of the estimator in use; of several channels each has its own."""
        return self._about.estimator or "several channels"

    @property
    def channels(self) -> list[str]:
        """Columns of the signals of a reading."""
        return self._channels

    @property
    def noise(self) -> Any:
        """Standard deviation of one reading: strain, or the unit of the reading; of several channels one for each."""
        noise = self._about.noise
        return noise[0] if self._is_one() else np.array(noise)

    def __repr__(self) -> str:
        if not self._is_one():
            return f"<Locator of {', '.join(self.channels)}: {self._about.drive}>"
        return f"<Locator by {self.estimator}: {self._about.drive}, {self._channels[0]}>"

    def _is_one(self) -> bool:
        return self._about.estimator is not None

    def locate(self, drive: Any, reading: Any = None) -> Located:
        """Distances of readings.

        Args:
            drive: tap angle, degrees (or displacement, mm), number or array; left out where there is only one. Or what
                :func:`vibrissa.simulate` gave, or a :class:`vibrissa.Table` with columns of drive and signal.
            reading: signal in the unit of the calibration (strain, microstrain, mV/V, or what the sensor shows). Of several channels an array
                whose last axis holds them in the order of :attr:`channels`, or a dict or DataFrame of their numbers, above their zeros; the drive may
                then be None where it is not known.

        Returns:
            :class:`Located` of floats, or of arrays of the common shape, with the labels of the arguments (Series, DataArrays) if they have some. In arrays, readings with drive 0 are those of the zero
            and serve those after them.

        Raises:
            InputError: what is no number, shapes that do not broadcast, labels that differ.

        Warns:
            VibrissaWarning: the signal of the calibration was tared, and nothing says the zero of these readings.
        """
        if len(self._channels) > 1:
            return self._together(drive, reading)
        if reading is None:
            drive, reading = self._pair(drive)
        if {type(drive), type(reading)} <= _SCALARS:
            try:
                distance, sigma, status = self._native.one(drive, reading, False)
            except OverflowError as e:
                raise InputError(str(e), key="reading", allowed="numbers that a float holds") from None
            if self._doubts and status != Status.no_strain:
                warn(self._doubts)
            return Located(distance, sigma, Status(status))
        drive_unit, reading_unit = self._units()
        shape, n, flat = columns(
            {"drive": drive, "reading": reading}, {"drive": f"numbers, {drive_unit}", "reading": "numbers"}, {"drive": drive_unit, "reading": reading_unit})
        drives, readings = (x if len(x) == n else x.repeat(n) for x in flat)
        distances, sigmas, statuses, told = self._native.many(drives, readings.reshape(-1, 1))
        warn(told)
        return Located(shape.of(distances), shape.of(sigmas), shape.of(statuses))

    __call__ = locate

    def _together(self, drive: Any, reading: Any) -> Located:
        """Distances of readings of all channels."""
        names = self._channels
        allowed = f"a dict, or an array with a last axis of {len(names)}: {', '.join(names)}"
        channels = by_name(reading)
        if channels is not None:
            if sorted(map(str, channels)) != sorted(names):
                raise InputError("these are not the channels of the calibration", key="reading", value=", ".join(map(str, channels)), allowed=allowed)
            given = [channels[name] for name in names]
        else:
            try:
                values = np.asarray(reading, dtype=float)
            except (TypeError, ValueError):
                raise InputError("these are no readings", key="reading", value=short(reading), allowed=allowed) from None
            if values.ndim == 0 or values.shape[-1] != len(names):
                raise InputError("this is no reading of every channel", key="reading", value=f"shape {values.shape}", allowed=allowed)
            given = list(np.moveaxis(values, -1, 0))
        unit = unit_of_column(self._about.drive)
        named = {"drive": np.nan if drive is None else drive, **dict(zip(names, given))}
        shape, n, flat = columns(named, {name: "numbers" for name in named}, {name: unit if name == "drive" else unit_of_column(name) for name in named})
        drives, *signals = (x if len(x) == n else x.repeat(n) for x in flat)
        distance, sigma, status = (shape.of(x) for x in self._native.many(drives, np.stack(signals, axis=1))[:3])
        warn(self._doubts)
        return Located(distance, sigma, status if shape else Status(int(status)))

    def stream(self, readings: Iterable[Union[float, tuple[float, float]]]) -> Iterator[Located]:
        """Answers readings one by one, each a (drive, reading) (a tuple, a list, the row of an array) or, where there is only one drive, a
        reading. Zero readings among them (drive 0) serve those after them."""
        try:
            items = iter(readings)
        except TypeError:
            raise InputError("these are no readings", key="readings", value=short(readings), allowed="something to iterate over: (drive, reading), or readings") from None
        return self._answers(items)

    def next(self, readings: Iterable[tuple[float, float] | tuple[float, float, float]] = (), *, within: tuple[float, float] | None = None,
             shift: tuple[float, float] | None = None, same_run: bool = False) -> NextTap:
        """Which drive the next tap of an object should have, after these readings of it.

        Args:
            readings: (drive, reading) of each tap so far, in order; readings with drive 0 are those of the zero. A third number says how much
                nearer to the object the base stood than where its distance is told from, mm.
            within: least and largest drive that the motor may do, degrees or mm; the calibrated ones where left out.
            shift: the base may move along the whisker: least and largest such number, mm; it stays where it stood last where left out.
            same_run: the taps are of a run of the calibration, whose zero and gain are known; so are those of a locator that was told so.

        Returns:
            :class:`NextTap`.

        Raises:
            InputError: a calibration by another estimator than ``learned``, or of two gauges; readings that fit no distance; limits without a drive.
        """
        self._one_signal()
        units = *self._units(), "mm"
        rows = [tuple(number("readings", x, unit) for x, unit in zip(row, units)) for row in self._rows(readings)]
        lo, hi = (-np.inf, np.inf) if within is None else self._ends("within", within, units[0])
        shifts = None if shift is None else self._ends("shift", shift, "mm")
        label, calibration, estimator, zero, trust, known = self._args
        taps = np.array([(*row, 0.0)[:3] for row in rows], dtype=float).reshape(-1, 3).T
        table = [("readings", ([self._about.drive, self._channels[0], "shift_mm"], list(map(np.ascontiguousarray, taps))))] if rows else []
        found = asked("next", dict(
            calibration=label, readings="readings" if rows else None, within=None if within is None else [lo, hi], shift=shifts and list(shifts), same_run=same_run or known,
            zero=None if zero is None or not rows else [zero], estimator=estimator, force=trust), files=[(label, calibration), *table])
        said, tried = json.loads(found.run)["result"], dict(found.tables)["next"]
        keys = ("taps", "distance_mm", "sigma_mm", "near_mm", self._about.drive, "shift_mm", "expected_sigma_mm", "least_sigma_mm")
        statuses = np.array([_bits(words) for words in tried["status"]], dtype=np.uint16)
        return NextTap(*[*(said[key] for key in keys), _bits(said["status"]), tried[self._about.drive], tried["shift_mm"], tried["expected_sigma_mm"], statuses])

    @staticmethod
    def _ends(key: str, said: Any, unit: str | None) -> tuple[float, float]:
        try:
            lo, hi = (number(key, x, unit) for x in said)
        except (TypeError, ValueError) as e:
            if isinstance(e, InputError):
                raise
            lo, hi = np.nan, np.nan
        if not lo <= hi:
            raise InputError("these are no ends", key=key, value=short(said), allowed="(least, largest)")
        return lo, hi

    @staticmethod
    def _rows(readings: Any) -> list[tuple[Any, ...]]:
        try:
            rows = [tuple(row) for row in readings]
        except TypeError:
            rows = [()]
        if not all(len(row) in (2, 3) for row in rows):
            raise InputError("these are no readings", key="readings", value=short(readings), allowed="(drive, reading), or (drive, reading, shift) of each tap")
        return rows

    def _answers(self, readings: Iterator[Any]) -> Iterator[Located]:
        native, units, waits = _native.Locator(*self._args), self._units(), True
        for item in readings:
            try:
                pair = isinstance(item, (tuple, list)) or isinstance(item, np.ndarray) and item.ndim == 1
                drive, reading = item if pair else (self._only(), item)
                if not {type(drive), type(reading)} <= _SCALARS:
                    drive, reading = number("readings", drive, units[0]), number("readings", reading, units[1])
                distance, sigma, status = native.one(drive, reading, True)
            except (TypeError, ValueError, OverflowError) as e:
                if isinstance(e, InputError):
                    raise
                raise InputError("this is no reading", key="readings", value=short(item), allowed="(drive, reading), or a reading") from None
            if waits and (told := native.told()) is not None:
                warn(told)
                waits = False
            yield Located(distance, sigma, Status(status))

    def table(self, readings: Any, columns: dict[str, str] | str | None = None, *, object: str | None = None, same: bool = False,
              strokes: bool = False, free: str | None = None, interval: bool = False) -> _native.Table:
        """Readings of a table (a path, a DataFrame, a dict of columns) as ``located.csv``: their own columns, distance_mm, sigma_mm, status.

        Columns in memory come back as they were given: words as words (``"007"``), times as times, whole numbers as whole numbers; to_pandas()
        of what came from a DataFrame has its types and its index.

        Args:
            readings: the table.
            columns: columns under other names.
            object: the column that says which object a tap is of (a column ``object`` does without being named): ``object_distance_mm``,
                ``object_sigma_mm`` and ``object_status`` say what the taps of an object so far tell together. A column ``shift_mm`` says how much
                nearer to the object the base stood, mm.
            same: all taps are of one object.
            strokes: readings at growing drive are strokes along an object, told apart by a column ``stroke`` or by where the drive begins anew;
                ``touch``, ``stroke_distance_mm``, ``from_68_mm`` … say what a stroke so far tells.
            free: what a stroke leaves free, as words joined by commas: ``zero`` (that of the sensor), ``friction=SD`` of the object, ``tilt=SD`` of its
                edge in degrees.
            interval: adds ``from_95_mm`` and ``to_95_mm``, the interval that holds the distance with 95 %; of objects ``object_from_95_mm`` and
                ``object_to_95_mm``. Strokes tell it anyway.

        Raises:
            InputError: data that cannot be used; two of ``object``, ``same`` and ``strokes``; readings that are to be told together by another
                estimator than ``learned``, or of several signals.
        """
        together = told_together(object, same, strokes, free)
        if flag("interval", interval) and strokes:
            raise InputError("strokes tell their interval anyway", key="interval", value="True", allowed="strokes=True without it")
        data = measured(readings, "readings", columns)
        found, told = self._native.table(data.label, data.rows, roles(columns), together, interval)
        warn(told)
        return data.keep(found)

    def expected(self, a: float, drive: float, sign: float = 1.0) -> Any:
        """Signal expected of a tap at ``a`` mm, on the side of ``sign``, of several channels of each; NaN where none is."""
        found = self._native.expected(number("a", a, "mm"), number("drive", drive, unit_of_column(self._about.drive)), number("sign", sign))
        return found[0] if self._is_one() else np.array(found)

    def export(self, language: str = "c") -> str:
        """What answers readings as one file of C99 without dependencies, for a robot."""
        if word("language", language) != "c":
            raise InputError("this is gone" if language == "python" else "unknown language", key="language", value=language, allowed='"c"; in Python, Locator itself')
        return self._native.export()

    def _pair(self, readings: Any) -> tuple[Any, Any]:
        """Drives and signals where one thing holds both, or only signals."""
        table = readings.measurements if isinstance(readings, Simulation) else readings
        if not isinstance(table, _native.Table) and (hasattr(table, "iloc") and hasattr(table, "columns") or isinstance(table, Mapping)):
            raise InputError("this is a table", key="reading", value=type(table).__name__, allowed="numbers; Locator.table(…) takes tables")
        if not isinstance(table, _native.Table):
            return self._only(), readings
        wanted = (self._about.drive, self._channels[0])
        for name in wanted:
            if name not in table:
                raise InputError(f"column {name} is missing", key="reading", value=", ".join(table.columns), allowed=" and ".join(wanted))
        return table[wanted[0]], table[wanted[1]]

    def _units(self) -> tuple[str | None, str | None]:
        """Those of drive and signal; None of a reading, which has none that is known."""
        return unit_of_column(self._about.drive), unit_of_column(self._channels[0])

    def _one_signal(self) -> None:
        """Refuses readings of one signal where there are several."""
        self._native.one(np.nan, np.nan, False)

    def _only(self) -> float:
        self._one_signal()
        only = self._about.only_drive
        if only is None:
            raise InputError("the drive of the tap is missing", key="drive", allowed=f"{self._about.drive} of each reading")
        return only


def _bits(words: str) -> Status:
    """The status of these words."""
    return Status(sum(Status[word] for word in words.split("+")))


def calibration_text(calibration: Calibration | str | os.PathLike[str]) -> tuple[str, str]:
    """Name and text of a calibration."""
    if isinstance(calibration, Calibration):
        return "calibration.toml", calibration.text
    if not isinstance(calibration, (str, os.PathLike)):
        raise InputError("this is no calibration", key="calibration", value=short(calibration), allowed="a path, or what calibrate gave")
    return text_of(calibration, "calibration")


def roles(columns: dict[str, str] | str | None) -> str | None:
    """Columns under other names, as the library reads them."""
    if isinstance(columns, Mapping):
        columns = ",".join(f"{role}={name}" for role, name in columns.items())
    if not (columns is None or isinstance(columns, str)):
        raise InputError("this names no columns", key="columns", value=short(columns), allowed='dict(a="…", theta="…", reading="…")')
    return None if columns is None else plain("columns", columns)
