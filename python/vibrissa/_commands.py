"""The commands: one function each, with the sections of a spec as keywords."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from . import _native
from ._errors import InputError, Interrupted, short, warn
from ._frames import csv
from ._keywords import keywords
from ._progress import Progress, shown
from ._results import BestTap, Search, Sweep, Verification
from ._spec import Section, Spec, flag, given, number, resolve, section, whole, word
from ._taps import ALLOWED, columns as broadcast

# As `verify --samples`: the reference takes hours for as many.
_MOST_SAMPLES = 10**6
_TUPLES = {"D_mm": "D", "d_mm": "d", "L_a_mm": "L_a", "x_ss_mm": "x_ss", "l_mm": "l", "a_mm": "a"}
_PROPERTIES = {
    "exponent", "scale", "bore_mm", "core_mm", "E_core_MPa", "kappa_base_per_mm", "kappa_slope_per_mm2", "k_theta_Nmm_per_rad", "k_y_N_per_mm", "k_x_N_per_mm",
    "hub_mm", "E_MPa", "nu", "pole_radius_mm", "mu", "foil_N_per_mm", "noise"}
_DIRECTIONS = {"tilt_deg": "tilt", "lean_deg": "lean"}
_OF_TUPLES = {"whisker": ("D", "d", "L_a"), "gauge": ("x_ss", "l"), "tap": ("a", "tilt", "lean", "theta", "delta")}


def _name(spec: Spec, name: str | None, command: str) -> str:
    return word("name", command if name in (None, "") else name)


@contextmanager
def _asked(spec: Spec, tuples: Any, sections: dict[str, Section | None]) -> Iterator[tuple[str | None, str, tuple[int, list[Any]] | None]]:
    """Path and text of a spec with these sections, and taps given one by one. Those with a rig of their own go as a tuple file."""
    if tuples is not None and not (isinstance(tuples, Mapping) and set(tuples) == {"file"}) and _PROPERTIES & set(_columns_of(tuples)):
        with TemporaryDirectory() as folder:
            path = os.path.join(folder, "tuples.csv")
            with open(path, "wb") as file:
                file.write(csv(tuples, "tuples").bytes)
            sections["tuples"] = {"file": path}
            yield *resolve(spec, sections), None
        return
    listed = _listed(tuples, sections)
    if listed is None:
        sections["tuples"] = tuples
    yield *resolve(spec, sections), listed


def _columns_of(tuples: Any) -> list[str]:
    """Names of the columns of taps given one by one."""
    names = list(tuples) if isinstance(tuples, Mapping) else list(getattr(tuples, "columns", ()))
    return [str(name) for name in names]


def _listed(tuples: Any, sections: dict[str, Section | None]) -> tuple[int, list[Any]] | None:
    """Taps given one by one: their number, and their columns; None in the place of a tilt or a lean that is not there."""
    if tuples is None or isinstance(tuples, Mapping) and set(tuples) == {"file"}:
        return None
    said = {name: section(name, sections.get(name)) or {} for name in _OF_TUPLES}
    for name, keys in _OF_TUPLES.items():
        written = [key for key in keys if key in said[name]]
        if written:
            raise InputError("this comes from the tuples; remove one of the two", key=f"{name}.{written[0]}")
    displaced = said["tap"].get("drive") == "displacement"
    wanted = {**_TUPLES, **({"delta_mm": "delta"} if displaced else {"theta_deg": "theta"})}
    given: dict[str, Any] = {}
    for column, key in wanted.items():
        try:
            given[key] = tuples[column]
        except (KeyError, IndexError, TypeError, ValueError):
            raise InputError(f"column {column} is missing", key="tuples", allowed=", ".join(wanted)) from None
    directions: dict[str, Any] = {}
    for column, key in _DIRECTIONS.items():
        try:
            directions[key] = tuples[column]
        except (KeyError, IndexError, TypeError, ValueError):
            pass
    given |= directions
    shape, n, flat = broadcast(given, ALLOWED, prefix="tuples.")
    if len(shape) > 1:
        raise InputError("columns of tuples have one dimension", key="tuples", value=f"shape {shape}")
    for key, values in zip(given, flat):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise InputError("this is not a finite number", key=f"tuples.{key}", value=f"{values[bad[0]]} in row {bad[0]}", allowed=ALLOWED[key])
    named = dict(zip(given, flat))
    return n, flat[:7] + [named.get(key) for key in _DIRECTIONS.values()]


def _unread(tuples: Any) -> list[str]:
    """That columns of taps given one by one are none that is known."""
    known = {*_TUPLES, *_DIRECTIONS, *_PROPERTIES, "theta_deg", "delta_mm", "file"}
    ignored = ", ".join(name for name in _columns_of(tuples) if name not in known)
    return [f"tuples: ignored columns {ignored}"] if ignored else []


@keywords
def sweep(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
          tap: Section | None = None,
          model: Section | None = None, estimate: Section | None = None, output: Section | None = None,
          run: Section | None = None, tuples: Any = None, name: str | None = None, progress: Progress = None) -> Sweep:
    """Evaluates a design space: designs × distances × tap angles by the exact rod, K, its spread, bias and noise of the distance.

    A value is a number, a list, a numpy array, a range, :func:`axis`, or :func:`samples`; all are crossed, the last fastest, in
    the order D, d, L_a, x_ss, l, properties of the rig (exponent … noise: docs/built.md), a, tilt, lean, theta. Units are mm, degrees, MPa, N; quantities with units (pint, astropy) are
    converted. Nothing is written.

    >>> result = sweep(whisker=dict(D=10, d=[4, 7, 10], L_a=50), gauge=dict(x_ss=5, l=2),
    ...                tap=dict(a=range(21, 49, 3), theta=[0.5, *range(1, 11)]))
    >>> result.designs.to_pandas()           # doctest: +SKIP
    >>> result.plot("sd")                    # doctest: +SKIP

    Args:
        spec: path of a spec, or a dict of its sections; keywords go before what it says.
        whisker: ``D``, ``d``, ``L_a``, or ``profile`` and ``scale``; ``hub``; ``exponent``, ``bore``, ``core``, ``curvature``, ``root``.
        gauge: ``x_ss``, ``l``; ``side``, ``noise_strain``, ``strain_limit``, ``factor``, ``second`` (a gauge 90° round the whisker).
        sensor: ``signal``, "strain", "moment", "force", or a list of them, with ``noise``; or a ``matrix`` with its ``covariance``; ``fixed``.
        tap: ``a`` and ``theta``, or ``drive="displacement"`` with ``delta``; ``tilt``, ``lean`` of the object's edge, degrees.
        model: ``geometry``, ``shear``, ``extension``, ``surface``, ``pole_radius``, ``nu``, ``contact``, ``material``, ``clamp``, ``indentation``, ``section``, ``solid``.
        estimate: ``theory``, ``convention``, ``range``, ``K``.
        output: ``tuples``, ``designs``, ``distances`` (which tables), ``top``, ``by``, ``per`` (the best rows only).
        run: ``backend`` ("auto": a hardware adapter where the CPU would need over two seconds, else the CPU kernels; "gpu" also takes a software adapter), ``adapter``, ``precision``,
            ``tolerance``, ``threads``, ``model_error`` (effects that change strain less are left off).
        tuples: taps one by one instead of axes: a DataFrame or dict with D_mm, d_mm, L_a_mm, x_ss_mm, l_mm, a_mm and theta_deg
            (delta_mm), perhaps tilt_deg and lean_deg, or ``{"file": path}``.
        name: name of the result in ``run``.
        progress: True (a bar, if tqdm is installed), or a function of (taps done, taps).

    Returns:
        :class:`Sweep`: tables ``tuples``, ``designs``, ``distances``, and ``run``; ``best()``. Every row asked for is there; a failed
        one says why in ``status``.

    Raises:
        InputError: with ``key``, ``value`` and ``allowed``, where a key or value cannot be used.
        RunError: tables that do not fit into memory, a device that fails.
        KeyboardInterrupt: within two seconds of Ctrl-C.

    Source: docs/model.md (Nguyen, Ngo, Nguyen and Ho, corrected and extended); every key: docs/reference.md.
    """
    sections: dict[str, Section | None] = {
        "whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "output": output, "run": run}
    with _asked(spec, tuples, sections) as (path, text, listed), shown(progress) as tell:
        result = Sweep(*_native.sweep(path, text, _name(spec, name, "sweep"), listed, tell))
    warn([*_unread(tuples), *(result.run.get("warnings") or ())])
    return result


@keywords
def tap(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
        tap: Section | None = None,
        model: Section | None = None, estimate: Section | None = None, run: Section | None = None,
        objective: str = "distance") -> BestTap:
    """The best tap angle of one whisker over its distances, and what limits it.

    Args:
        spec, whisker, gauge, sensor, tap, model, estimate, run: as of :func:`sweep`, one whisker; the interval is that of ``tap["theta"]``
            (0.1 to 10 degrees if left out). Computed on the CPU in f64 unless ``run`` says otherwise.
        objective: ``"distance"`` makes total_rms_mm small (bias and noise; needs ``gauge["noise_strain"]``), ``"sd"`` K_sd.

    Returns:
        :class:`BestTap`.

    Raises:
        InputError: several whiskers, a strain limit that no angle keeps, no complete row.

    Source: docs/search.md.
    """
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "run": run}
    path, text = resolve(spec, sections)
    if not isinstance(objective, str):
        raise InputError("unknown word", key="objective", value=short(objective), allowed='"distance", "sd"')
    result = BestTap(*_native.tap(path, text, objective))
    warn(result.run.get("warnings") or ())
    return result


class Step(NamedTuple):
    """How far a search is."""

    evaluations: int
    """Designs evaluated so far, each over all its distances."""
    left: int | None
    """How many the budget still allows."""
    start: int
    """Number of the start, from 0."""
    stage: str
    """``"swarm"`` or ``"polish"``."""
    design: tuple[float, float, float, float, float, float]
    """The best so far: D, d, L_a, x_ss, l (mm) and the drive (degrees or mm)."""
    value: float
    """The objective there."""
    feasible: bool
    """Whether it keeps the limits."""


@keywords
def optimise(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
             tap: Section | None = None,
             model: Section | None = None, estimate: Section | None = None, optimise: Section | None = None,
             run: Section | None = None, name: str | None = None, callback: Callable[[Step], object] | None = None) -> Search:
    """Searches the design that tells distance best within the limits of a rig.

    Args:
        spec, whisker, gauge, sensor, tap, model, estimate, run: as of :func:`sweep`; what is varied may be left out of its section.
        optimise: ``objective`` ("sd", "distance", "weighted", "pareto"), ``variables`` (dict(D=[8, 12], theta=[0.5, 10], …)),
            ``limits`` (strain, force_N, unambiguous, tip_not_wider), ``weights``, ``robust``, ``seed``,
            ``budget`` (dict(evaluations=…, seconds=…)).
        name: name of the result in ``run``.
        callback: called with each :class:`Step`; a true result ends the search with the best so far.

    Returns:
        :class:`Search`.

    Raises:
        InputError: what cannot be searched, limits that no design keeps.
        RunError: a search that ends before a design keeps the limits.
        Interrupted: a KeyboardInterrupt; its ``result`` holds the best so far.

    Source: docs/search.md.
    """
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "optimise": optimise, "run": run}
    path, text = resolve(spec, sections)
    if callback is not None and not callable(callback):
        raise InputError("this cannot be called", key="callback", value=short(callback), allowed="a function of a Step")

    def hear(*told: Any) -> bool:
        answer = callback(Step(*told)) if callback is not None else None
        try:
            return bool(answer)
        except (TypeError, ValueError):
            raise InputError("what this returns is neither true nor false", key="callback", value=short(answer), allowed="a true result to end the search, else a false one or None") from None

    tables, best, document_, interrupt = _native.optimise(path, text, _name(spec, name, "optimise"), None if callback is None else hear)
    result = Search(tables, best, document_)
    if isinstance(interrupt, KeyboardInterrupt):
        raise Interrupted(result) from None
    if interrupt is not None:
        raise interrupt
    warn(result.run.get("warnings") or ())
    return result


# The keyword of its section hides the function.
_optimise = optimise


def pareto(spec: Spec = None, *, optimise: Section | None = None, **sections: Any) -> Search:
    """The trade-off between the spread of K and the total error of the distance: :func:`optimise` with the objective ``"pareto"``.

    ``result.front`` holds the designs none of which is better than another in both.
    """
    given = section("optimise", optimise)
    return _optimise(spec, optimise={**(given or {}), "objective": "pareto"}, **sections)


def verify(spec: Spec = None, *, quick: bool = False, samples: int | None = None, seed: int = 1, bound: float | None = None,
           run: Section | None = None, progress: Progress = None, **sections: Section) -> Verification:
    """Every backend of this machine against the f64 reference: hard cases and random taps of every configuration, or taps of a spec.

    Args:
        spec, **sections: as of :func:`sweep`; left out: the built-in configurations.
        quick: few taps, seconds instead of half a minute.
        samples: random taps; seed: their seed.
        bound: largest relative strain error that passes.
        run: ``backend``, ``precision``, … that are verified; all by default.
        progress: True (a bar, if tqdm is installed), or a function of (taps done, taps).

    Returns:
        :class:`Verification`, true where no bound is broken. Source: docs/verify.md.
    """
    path, text = resolve(spec, {**sections, "run": run})
    with shown(progress) as tell:
        asked = None if samples is None else whole("samples", samples, _MOST_SAMPLES, 1), whole("seed", seed), given(number, "bound", bound, "")
        census, document, ok, told = _native.verify(path, text, flag("quick", quick), *asked, tell)
    warn(told)
    return Verification(census, document, ok)


def devices() -> dict[str, Any]:
    """Adapters, the CPU, and which of them ``backend="auto"`` takes, and why."""
    found: dict[str, Any] = json.loads(_native.devices())
    return found


def chart(spec: Spec = None, **sections: Section) -> dict[str, Any]:
    """Charts of a model over the ranges of a spec, one for each distance (64 at most): sparse Chebyshev series that pages and robots read.

    Args:
        spec, **sections: as of :func:`sweep`; ``run["tolerance"]`` bounds the strain error (1e-5).

    Returns:
        the document of ``vibrissa chart`` (docs/chart.md).

    Raises:
        InputError: a list of tuples, too many distances, a model without a chart.
    """
    path, text = resolve(spec, sections)
    document, told = _native.chart(path, text)
    warn(told)
    found: dict[str, Any] = json.loads(document)
    return found


def spec_text(spec: Spec = None, **sections: Section) -> str:
    """The text of a spec that the program takes for these keywords: ``vibrissa sweep`` gives the same tables from it."""
    path, text = resolve(spec, sections)
    if path is not None:
        raise InputError("a file has its text already", key="spec", value=os.fspath(path), allowed="a dict of sections, or keywords")
    return text
