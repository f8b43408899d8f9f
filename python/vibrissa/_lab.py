"""Calibration and synthetic measurements, with the sections of a spec as keywords."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ._contour import course
from ._errors import InputError, short
from ._frames import measured
from ._keywords import keywords
from ._locate import calibration_text, roles
from ._request import asked, of_sections
from ._results import Calibration, Plan, Recorded, Simulation
from ._spec import Section, Spec, given, number, whole, word
from ._taps import ALLOWED, number_array


@keywords
def calibrate(data: Any, spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
              tap: Section | None = None,
              model: Section | None = None, estimate: Section | None = None, run: Section | None = None,
              theta: float | None = None, delta: float | None = None, columns: dict[str, str] | str | None = None,
              group: float | tuple[float, float] | None = None, fit: tuple[str, ...] | list[str] = ()) -> Calibration:
    """Calibrates a whisker from measured signals: K table, estimators compared on distances left out, suspect rows named.

    Args:
        data: DataFrame (pandas, polars), pyarrow Table, dict of columns, what :func:`simulate` gave or path of a CSV file, with ``a_mm``, ``theta_deg`` (or
            ``delta_mm``) and one of ``strain``, ``microstrain``, ``bridge_mV_per_V``, ``reading``. Rows with drive 0 are zero readings.
        spec, whisker, gauge, sensor, tap, model, estimate, run: the whisker, as of :func:`sweep`, one number each; without any, the estimators
            that need nothing but the data.
        theta, delta: the drive of every row, where no column says.
        columns: columns under other names, ``dict(a="dist", theta="angle", reading="ch3")``.
        group: distances (mm) and drives within this of each other are one; one width, or two.
        fit: parameters of the model to fit, too: ``a_offset``, ``hub``, ``nu``, ``mu``, ``C01/C10``, ``c0``.

    Returns:
        :class:`Calibration`; its ``locator()`` answers readings.

    Raises:
        InputError: data that no calibration can come from.

    Source: docs/calibration.md.
    """
    table = measured(data, "data", columns)
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "run": run}
    path, text, name = of_sections(spec, sections, "calibrate")
    widths = [] if group is None else [number("group", w) for w in (group if isinstance(group, (list, tuple, np.ndarray)) else [group])]
    if not isinstance(fit, (str, list, tuple)):
        raise InputError("this is no list of parameters", key="fit", value=short(fit), allowed="a word or a list of words")
    parameters = [word("fit", name) for name in ([fit] if isinstance(fit, str) else fit)]
    said = dict(
        data=table.label, theta=given(number, "theta", theta, "degrees"), delta=given(number, "delta", delta, "mm"), columns=roles(columns), group=widths,
        fit=parameters)
    if theta is not None and delta is not None:
        raise InputError("a tap has one drive", key="delta", allowed="theta or delta, not both")
    described = None if path is None and text == "" else (path, text, name)
    if described is None and parameters:
        raise InputError("there is no model to fit without a whisker", key="fit", value=",".join(parameters), allowed="whisker, gauge and model, or a spec")
    found = asked("calibrate", said, described, table.held())
    return Calibration(found.tables, found.texts["calibration.toml"], found.run)


@keywords
def simulate(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
             tap: Section | None = None,
             model: Section | None = None, run: Section | None = None, repeats: int = 1, noise: float | None = None, seed: int = 1,
             zero_every: int | None = None, drift: float = 0.0, outliers: float = 0.0, saturate: float | None = None,
             hysteresis: float = 0.0, factor: float = 1.0, drive_offset: float = 0.0, a_offset: float = 0.0,
             signal: str | None = None, object: Any = None) -> Simulation:
    """Synthetic measurements of one whisker from the exact model: what :func:`calibrate` reads. They are no evidence about a real sensor.

    Args:
        spec, whisker, gauge, sensor, tap, model, run: as of :func:`sweep`, one whisker.
        repeats: taps of each distance and drive.
        noise: standard deviation of one reading, strain; ``gauge["noise_strain"]`` by default.
        seed: of everything random.
        zero_every: a zero reading before every so many taps.
        drift: of the zero, strain per row.
        outliers: share of taps that are wrong, 0 … 1.
        saturate: |strain| at which the sensor stops.
        hysteresis: share of the last tap's strain that is still there, 0 … 1.
        factor: signal per strain.
        drive_offset, a_offset: tapped by this much more than the label says, degrees or mm, and mm.
        signal: ``"strain"``, ``"microstrain"``, ``"bridge_mV_per_V"``, ``"reading"``, ``"moment_Nmm"`` or ``"force_N"``; by default that of ``sensor``.
        object: strokes over this object in place of taps: the path of a file, or its sections,
            ``dict(object=dict(shape="circle", x=0, y=0, radius=10), around=dict(starts=12, distance=36))`` (mm, degrees; docs/contour.md §7). The drives of
            ``tap`` are then angles after first touch, its distances are not used.

    Returns:
        :class:`Simulation`; of strokes what :func:`contour` reads, with the true contacts beside.

    Raises:
        InputError: several whiskers, settings that are not allowed; with ``object`` friction, linear theory or a displaced object, an object that no start
            leads to.

    Warns:
        VibrissaWarning: a start that makes no stroke.

    Source: docs/calibration.md, docs/contour.md.

    >>> rig = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), model=dict(surface=True))
    >>> circle = dict(object=dict(shape="circle", x=0, y=0, radius=10), around=dict(starts=4, distance=36))
    >>> stroked = simulate(**rig, tap=dict(a=30, theta=[2, 4]), object=circle).measurements
    >>> len(stroked), stroked["stroke"].tolist()
    (8, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0])
    """
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "run": run}
    numbers = dict(drift=drift, outliers=outliers, hysteresis=hysteresis, factor=factor, drive_offset=drive_offset, a_offset=a_offset)
    # That of the drive is degrees or mm, as the spec has it: a number says it.
    units = dict(drift="", outliers="", hysteresis="", factor="", drive_offset=None, a_offset="mm")
    stroked, files = (None, []) if object is None else course(object, "object")
    said = dict(
        repeats=whole("repeats", repeats, least=1), seed=whole("seed", seed), zero_every=None if zero_every is None else whole("zero_every", zero_every, least=1),
        noise=given(number, "noise", noise, ""), saturate=given(number, "saturate", saturate, ""), signal=given(word, "signal", signal), object=stroked,
        **{key: number(key, value, units[key]) for key, value in numbers.items()})
    found = asked("simulate", said, of_sections(spec, sections, "simulate"), files)
    return Simulation(found.tables[0][1], found.run)


@keywords
def plan(spec: Spec = None, *, error: float, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
         tap: Section | None = None, model: Section | None = None, estimate: Section | None = None, run: Section | None = None,
         like: Calibration | str | os.PathLike[str] | None = None, positions: int | None = None, runs: int = 2, place: float | None = None,
         gain: float = 0.003, relative: float | None = None, seed: int = 1) -> Plan:
    """The taps of a calibration: where to tap, and how often, for a wanted error of a distance, as ``vibrissa plan`` says it.

    Args:
        spec, whisker, gauge, sensor, tap, model, estimate, run: as of :func:`sweep`, one whisker; ``tap`` says how far the rig may go: distances between
            the least and the largest, and these drives.
        error: root mean square error of a distance that is wanted, mm: of one tap, in another run.
        like: noise, and how positions and runs differ, as this calibration of the same rig learned them: what :func:`calibrate` gave, or a path.
        positions: most positions; as many as help by default.
        runs: the rig is set up anew for each, 1 to 8.
        place: how well a position is set, mm, one standard deviation; 0.05 by default. Not beside ``like``.
        gain: by how much the gain differs between runs, as a share, one standard deviation.
        relative: noise that goes with the signal, as a share of it; 0.001 by default. Not beside ``like``.
        seed: of the order of the taps.

    Returns:
        :class:`Plan`: tables ``taps`` and ``errors``, ``result``.

    Raises:
        InputError: a rig that no calibration of one signal fits, an error that no plan reaches.

    Source: docs/calibration.md.
    """
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "run": run}
    known, files = (None, []) if like is None else (text := calibration_text(like), [text])
    for name, value in (("place", place), ("relative", relative)):
        if value is not None and like is not None:
            raise InputError("the calibration of like says this", key=name, value=short(value), allowed="one of the two")
    said = dict(
        error=number("error", error, "mm"), like=known and known[0], positions=None if positions is None else whole("positions", positions, 25, 2), runs=whole("runs", runs, 8, 1),
        place=number("place", 0.05 if place is None else place, "mm"), gain=number("gain", gain, ""), relative=number("relative", 0.001 if relative is None else relative, ""),
        seed=whole("seed", seed))
    found = asked("plan", said, of_sections(spec, sections, "plan"), files)
    return Plan(found.tables, found.run)


@keywords
def taps(raw: Any, *, take: str = "auto", a: Any = None, theta: Any = None, delta: Any = None, columns: dict[str, str] | str | None = None) -> Recorded:
    """Taps out of a raw signal over time, as ``vibrissa taps`` finds them: rests, and of each contact its plateau or its peak.

    Args:
        raw: DataFrame (pandas, polars), pyarrow Table, dict of columns, or path of a CSV file, with ``t_s`` (seconds) and the signal of each sample; perhaps
            ``theta_deg`` or ``delta_mm``, ``a_mm``, ``run``.
        take: ``"auto"``, a plateau where there is one, else the peak; ``"plateau"``, ``"peak"``.
        a: distance of all taps, or of each in the order of time, mm.
        theta, delta: drive of all taps, or of each, degrees or mm, where the record has none.
        columns: columns under other names, ``dict(t="Zeit", reading="ch3")``.

    Returns:
        :class:`Recorded`: tables ``taps``, which :func:`calibrate` takes, and ``readings``.

    Raises:
        InputError: a record without taps, times that do not rise, labels that are not as many as the taps.

    Source: docs/calibration.md.
    """
    record = measured(raw, "raw", columns)
    if theta is not None and delta is not None:
        raise InputError("a tap has one drive", key="delta", allowed="theta or delta, not both")
    said = dict(
        raw=record.label, take=word("take", take), columns=roles(columns),
        **{key: None if value is None else np.atleast_1d(number_array(key, value, ALLOWED[key], unit)).reshape(-1)
           for key, value, unit in (("a", a, "mm"), ("theta", theta, "degrees"), ("delta", delta, "mm"))})
    found = asked("taps", said, files=record.held())
    return Recorded(found.tables, found.run)
