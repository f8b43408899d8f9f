"""The commands: one function each, with the sections of a spec as keywords."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, NamedTuple

from . import _native
from ._errors import InputError, Interrupted, short
from ._keywords import keywords
from ._progress import Progress, shown
from ._request import asked, of_sections
from ._results import BestTap, Search, Sweep, Verification
from ._spec import Section, Spec, flag, given, number, resolve, section, whole, word
from ._tuples import listed

# As `verify --samples`: the reference takes hours for as many.
_MOST_SAMPLES = 10**6


def _name(spec: Spec, name: str | None, command: str) -> str:
    return word("name", command if name in (None, "") else name)


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
        tuples: taps one by one instead of axes: D_mm, d_mm, L_a_mm, x_ss_mm, l_mm, a_mm and theta_deg (delta_mm), perhaps tilt_deg, lean_deg and
            properties of the rig (hub_mm, E_MPa, …: docs/built.md), as a DataFrame (pandas, polars), pyarrow Table, DuckDB relation, structured
            array, xarray Dataset or dict of columns; or ``{"file": path}``.
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
    path, text, taps, told = listed(spec, tuples, sections)
    with shown(progress) as tell:
        found = asked("sweep", {}, (path, text, _name(spec, name, "sweep")), taps=taps, hear=tell, told=told)
    return Sweep(found.tables, found.run)


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
    found = asked("tap", {"objective": word("objective", objective)}, of_sections(spec, sections, "tap"))
    return BestTap(dict(found.tables)["tap"], found.run)


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
    given = of_sections(spec, sections, _name(spec, name, "optimise"))
    if callback is not None and not callable(callback):
        raise InputError("this cannot be called", key="callback", value=short(callback), allowed="a function of a Step")

    def hear(*told: Any) -> bool:
        answer = callback(Step(*told)) if callback is not None else None
        try:
            return bool(answer)
        except (TypeError, ValueError):
            raise InputError("what this returns is neither true nor false", key="callback", value=short(answer), allowed="a true result to end the search, else a false one or None") from None

    found = asked("optimise", {}, given, hear=None if callback is None else hear, partial=True)
    result = Search(found.tables, found.texts["best.toml"], found.run)
    if isinstance(found.interrupt, KeyboardInterrupt):
        raise Interrupted(result) from None
    if found.interrupt is not None:
        raise found.interrupt
    return result


# The keyword of its section hides the function.
_optimise = optimise


@keywords
def pareto(spec: Spec = None, *, optimise: Section | None = None, **sections: Any) -> Search:
    """The trade-off between the spread of K and the total error of the distance: :func:`optimise` with the objective ``"pareto"``.

    ``result.front`` holds the designs none of which is better than another in both.
    """
    given = section("optimise", optimise)
    return _optimise(spec, optimise={**(given or {}), "objective": "pareto"}, **sections)


@keywords
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
    given_spec = of_sections(spec, {**sections, "run": run}, "verify")
    said = {"quick": flag("quick", quick), "samples": None if samples is None else whole("samples", samples, _MOST_SAMPLES, 1),
            "seed": whole("seed", seed), "bound": given(number, "bound", bound, "")}
    with shown(progress) as tell:
        found = asked("verify", said, given_spec, hear=tell)
    counts = json.loads(found.run)["counts"]
    return Verification(dict(found.tables)["verify"], found.run, counts["broken_lines"] == 0)


@keywords
def devices() -> dict[str, Any]:
    """Adapters, the CPU, and which of them ``backend="auto"`` takes, and why."""
    found: dict[str, Any] = json.loads(_native.devices())
    return found


@keywords
def chart(spec: Spec = None, **sections: Section) -> dict[str, Any]:
    """Charts of a model over the ranges of a spec, one for each distance (64 at most): sparse Chebyshev series that pages and robots read.

    Args:
        spec, **sections: as of :func:`sweep`; ``run["tolerance"]`` bounds the strain error (1e-5).

    Returns:
        the document of ``vibrissa chart`` (docs/chart.md).

    Raises:
        InputError: a list of tuples, too many distances, a model without a chart.
    """
    document: dict[str, Any] = json.loads(asked("chart", {}, of_sections(spec, sections, "chart")).texts["chart.json"])
    return document


@keywords
def spec_text(spec: Spec = None, **sections: Section) -> str:
    """The text of a spec that the program takes for these keywords: ``vibrissa sweep`` gives the same tables from it."""
    path, text = resolve(spec, sections)
    if path is not None:
        raise InputError("a file has its text already", key="spec", value=os.fspath(path), allowed="a dict of sections, or keywords")
    return text
