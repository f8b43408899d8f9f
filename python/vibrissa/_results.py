"""What commands give: tables, and the rest as a dict."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._errors import InputError, RunError, short, warn
from ._keywords import keywords
from ._native import Table

if TYPE_CHECKING:
    import matplotlib.axes

    from ._locate import Locator


def _whole(path: str | os.PathLike[str], mode: str, write: Callable[[Any], object]) -> None:
    """Writes a file whole, or not at all."""
    try:
        path = os.fsdecode(path)
    except TypeError:
        raise InputError("this is no path", key="path", value=short(path), allowed="str or os.PathLike") from None
    if os.path.isdir(path) or not os.path.basename(path):
        raise InputError("this is a folder", key="path", value=short(path), allowed="a name of a file")
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError("this is no regular file", key="path", value=short(path), allowed="a name of a file")
    # In the same folder, so that it can take the place of the file.
    part = os.path.join(os.path.dirname(path), f".vibrissa-{secrets.token_hex(6)}.part")
    try:
        with open(part, mode.replace("w", "x")) as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException as e:
        with suppress(OSError):
            os.unlink(part)
        if isinstance(e, OSError) and e.filename == part:
            raise OSError(e.errno, e.strerror, path) from None
        raise


_warned_of_fork = False


def _warn_of_fork(backend: Any) -> None:
    """Once in a process that was forked: that its work goes elsewhere than that of its parent."""
    global _warned_of_fork
    if not _warned_of_fork and "forked" in str(backend):
        _warned_of_fork = True
        warn([f"this process was forked and computes on {backend['name']}, not where its parent does; start it by spawn to use a GPU"])


class Row(dict[str, Any]):
    """A row of a table by the names of its columns."""

    def __missing__(self, name: str) -> Any:
        raise KeyError("d_mm is called d_tip_mm" if name == "d_mm" else name)


class _Result:
    """Tables as attributes, and ``run``: what ran, on what, how long, with every value in force (as run.json, docs/reference.md)."""

    run: dict[str, Any]

    def __init_subclass__(cls) -> None:
        keywords(cls)

    def __init__(self, run: str) -> None:
        self.run = json.loads(run)
        _warn_of_fork(self.run.get("backend"))

    def _tables(self) -> dict[str, Table]:
        return {name: value for name, value in vars(self).items() if isinstance(value, Table)}

    def __repr__(self) -> str:
        tables = ", ".join(f"{name} ({len(table)})" for name, table in self._tables().items())
        return f"<{type(self).__name__}: {tables}>"


class Sweep(_Result):
    """Result of :func:`vibrissa.sweep`.

    Attributes:
        tuples: a row is a tap (strain, K, estimated distance, forces, status).
        designs: a row is a whisker at one drive, over its distances (K_mean, K_sd, bias, noise, total).
        distances: a row is a whisker at one distance, over its drives.
        run: values in force, backend, counts per status, seconds.

    A table that was not asked for is None.
    """

    tuples: Table | None
    designs: Table | None
    distances: Table | None

    def __init__(self, tables: Sequence[tuple[str, Table | None]], run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.tuples, self.designs, self.distances = (named.get(n) for n in ("tuples", "designs", "distances"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the tables and ``run`` to ``path``, whole or not at all, as an ``.npz`` of numpy that :meth:`load` reads."""
        held: dict[str, NDArray[Any]] = {"run": np.array(json.dumps(self.run))}
        for table, found in self._tables().items():
            held[f"{table}/"] = np.array(found.columns)
            for k, (name, kind) in enumerate(zip(found.columns, found.kinds())):
                if kind == "words":
                    held[f"{table}/{k}"], words = found.codes(name)
                    held[f"{table}/{k}/words"] = np.array(words, dtype=np.str_)
                else:
                    held[f"{table}/{k}"] = found[name]
        _whole(path, "wb", lambda file: np.savez_compressed(file, **held))  # type: ignore[arg-type,unused-ignore]

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Sweep:
        """What :meth:`save` wrote.

        Raises:
            InputError: a file that cannot be read, or holds something else.
        """
        try:
            with np.load(os.fsdecode(path), allow_pickle=False) as held:
                tables: list[tuple[str, Table | None]] = []
                for table in ("tuples", "designs", "distances"):
                    if f"{table}/" not in held:
                        continue
                    names = held[f"{table}/"].tolist()
                    columns = [(held[f"{table}/{k}"], held[f"{table}/{k}/words"].tolist()) if f"{table}/{k}/words" in held else held[f"{table}/{k}"]
                               for k in range(len(names))]
                    tables.append((table, Table._of_columns(names, columns)))
                return cls(tables, str(held["run"]))
        except (OSError, ValueError, KeyError, TypeError) as e:
            raise InputError(f"this is no saved sweep: {e}", key="path", value=short(path), allowed="what Sweep.save wrote") from None

    def best(self, by: str = "K_sd") -> dict[str, Any]:
        """The row of ``designs`` that is recommended: of those of which every tap counts, a row within the strain limit before one beyond it, then the
        smallest ``by``; the first of equals.

        Args:
            by: a column of numbers of ``designs``: ``"K_sd"``, ``"total_rms_mm"``, …; a unit at its end may be left out.

        Raises:
            InputError: no such column, no such table.
            RunError: no row in which every tap counts and ``by`` has a value; ``status`` says why.
        """
        table = self.designs
        if table is None:
            raise InputError("this sweep has no designs", key="output.designs", allowed="True")
        numbers = [name for name, kind in zip(table.columns, table.kinds()) if kind != "words"]
        by = f"{by}_mm" if f"{by}_mm" in numbers else by
        if by not in numbers:
            raise InputError("designs have no such column of numbers", key="by", value=short(by), allowed=", ".join(numbers))
        codes, words = table.codes("status")
        place = _native.recommended(np.asarray(table[by], dtype=float).tolist(), codes.tolist(), words)
        if place is None:
            raise RunError(f"in no row does every tap count and {by} have a value: {', '.join(words) or 'there is no row'}")
        return Row((name, table[name][place].item() if name in numbers else table[name][place]) for name in table.columns)

    def to_pandas(self, table: str = "designs") -> Any:
        """One of the tables as a DataFrame over the same memory: ``"tuples"``, ``"designs"`` or ``"distances"``."""
        found = self._tables().get(table)
        if found is None:
            raise KeyError(f"no table {table!r}; there are {', '.join(self._tables()) or 'none'}")
        return found.to_pandas()

    def to_xarray(self, table: str = "tuples") -> Any:
        """One of the tables of a sweep of axes as an xarray Dataset: an axis of more than one value is a dimension, the others are coordinates; units are attributes.

        Args:
            table: ``"tuples"``, ``"designs"`` or ``"distances"``.

        Raises:
            InputError: rows that are no grid: tuples, samples, the best rows only.

        >>> result.to_xarray()["strain"].sel(d_tip_mm=4).plot()           # doctest: +SKIP
        """
        found = self._tables().get(table)
        if found is None:
            raise InputError("this sweep has no such table", key="table", value=short(table), allowed=", ".join(self._tables()))
        from ._containers import grid

        return grid(found)

    def plot(self, kind: str = "sd", ax: matplotlib.axes.Axes | None = None, *, design: int = 0, drives: Any = None) -> matplotlib.axes.Axes:
        """A figure of the paper from these tables; needs matplotlib.

        Args:
            kind: ``"strain"`` (Fig. 5: strain against the drive, exact beside linear), ``"K"`` (Fig. 6: K against the distance),
                ``"sd"`` (Fig. 7: spread of K against the drive; of more than seven designs the seven of least spread have names, the others are
                grey), ``"distance"`` (Fig. 8: estimated against true distance),
                ``"error"`` (bias, noise and total against the drive).
            ax: where to draw; a new figure by default.
            design: number of the whisker, in row order, for "strain", "K", "distance" and "error".
            drives: those to show.
        """
        from ._plots import sweep

        return sweep(self, kind, ax, design, drives)


class BestTap(_Result):
    """Result of :func:`vibrissa.tap`.

    Attributes:
        curve: a row is a drive (K_mean, K_sd, bias, noise and total of the distance, largest strain).
        optimum, unconstrained: the best drive within the strain limit, and whatever the strain.
        limited_by: ``bias``, ``noise``, ``strain_limit``, ``bound``, ``complete_rows`` or ``friction``; ``why`` says it in a sentence.
        at_bound: whether the optimum is an end of the interval.
        other: what the other estimator would give.
    """

    def __init__(self, curve: Table, run: str) -> None:
        super().__init__(run)
        self.curve = curve
        result = self.run["result"]
        self.optimum: dict[str, Any] = result["optimum"]
        self.unconstrained: dict[str, Any] = result["unconstrained"]
        self.limited_by: str = result["limited_by"]
        self.why: str = result["why"]
        self.at_bound: bool = result["at_bound"]
        self.other: dict[str, Any] | None = result["other"]

    def plot(self, ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes:
        """Bias, noise and total against the drive, the optimum marked; needs matplotlib."""
        from ._plots import best_tap

        return best_tap(self, ax)


class Search(_Result):
    """Result of :func:`vibrissa.optimise` and :func:`vibrissa.pareto`.

    Attributes:
        best: the best design at its drive, its figures and status (a row of ``designs``).
        value: the objective there; ``why`` says what limits it, ``ended_by`` why the search ended.
        front: the trade-off front, a row is a design; None unless the objective is ``pareto``.
        history: the best after each step.
        sensitivity: elasticities of each parameter, and its shares of the variance of ln K_sd and of ln total_rms_mm (Sobol' indices) with
            their 95 % confidence intervals (``…_low``, ``…_high``).
        best_spec: the best design as the text of a spec that :func:`vibrissa.sweep` runs.
    """

    def __init__(self, tables: list[tuple[str, Table]], best_spec: str, run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.history, self.sensitivity = named["history"], named["sensitivity"]
        self.front: Table | None = named.get("pareto")
        self.best_spec = best_spec
        result = self.run["result"]
        self.best: dict[str, Any] = Row(result["best"])
        self.value: float = result["value"]
        self.why: str = result["why"]
        self.ended_by: str = result["ended_by"]

    def plot(self, ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes:
        """The front, the best design marked, or without one the best value against evaluations; needs matplotlib."""
        from ._plots import search

        return search(self, ax)


class Calibration(_Result):
    """Result of :func:`vibrissa.calibrate`.

    Attributes:
        text: the calibration as a file that ``vibrissa locate`` and :class:`vibrissa.Locator` read; :meth:`save` writes it.
        estimator: the one that won on distances left out.
        K_table: a row is a distance at a drive; designs, distances: over the distances of a drive, over the drives of a distance.
        rows: every row of the data with its residual, used or suspect, and the reason.
        channels: of a sensor with several channels, in place of these tables: every tap with its signals, what was expected, and the distance
            that all channels tell together.
        result: noise, zero, sides, estimators compared, coverage of σ.
        warnings: what to know before trusting it.
    """

    K_table: Table
    designs: Table
    distances: Table
    rows: Table
    channels: Table

    def __init__(self, tables: list[tuple[str, Table]], text: str, run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        for name, table in named.items():
            setattr(self, name, table)
        self.text = text
        self.result: dict[str, Any] = self.run["result"]
        self.estimator: str = self.result.get("estimator", "several channels")
        self.warnings: list[str] = self.result["warnings"]

    def __getattr__(self, name: str) -> Any:
        tables = ", ".join(vars(self).get("result", {}) and self._tables())
        raise AttributeError(f"this calibration has no {name}; its tables: {tables}")

    def _fitted(self) -> list[dict[str, Any]]:
        fits = [side["parameters"] for side in self.result.get("sides", []) if side.get("parameters")]
        if len(fits) != 1:
            raise RunError("parameters were fitted on no side, or on both: result['sides'] has them")
        fitted: list[dict[str, Any]] = fits[0]["fitted"]
        return fitted

    @property
    def params(self) -> dict[str, float]:
        """Parameters of the exact model that were fitted, by name, in the units of ``result``; of a calibration of one side."""
        return {p["name"]: p["value"] for p in self._fitted()}

    @property
    def cov(self) -> NDArray[np.float64]:
        """Covariance of :attr:`params`, in their order."""
        fitted = self._fitted()
        sigma = np.array([p["standard_error"] for p in fitted], dtype=np.float64)
        correlation = np.array([[1.0 if p is q else p["correlations"].get(q["name"]) for q in fitted] for p in fitted], dtype=np.float64)
        return np.asarray(correlation.reshape(len(fitted), len(fitted)) * np.outer(sigma, sigma))

    def locator(self, estimator: str | None = None, zero: float | None = None) -> Locator:
        """What answers readings of this whisker; see :class:`vibrissa.Locator`."""
        from ._locate import Locator

        return Locator(self, estimator=estimator, zero=zero)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes ``text`` to ``path``, whole or not at all."""
        _whole(path, "wb", lambda file: file.write(self.text.encode()))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Locator:
        """What answers readings by the calibration that :meth:`save`, or the program, wrote to ``path``."""
        from ._locate import Locator

        return Locator(path)

    def plot(self, ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes:
        """Measured signals over what the winner expects, suspects marked; needs matplotlib."""
        from ._plots import calibration

        return calibration(self, ax)


class Verification(_Result):
    """Result of :func:`vibrissa.verify`: the census of strain errors, a row is a configuration on a backend. True where no bound is broken."""

    def __init__(self, census: Table, run: str, ok: bool) -> None:
        super().__init__(run)
        self.census = census
        self.ok = ok

    def __bool__(self) -> bool:
        return self.ok


class Simulation(_Result):
    """Result of :func:`vibrissa.simulate`: ``measurements``, a row is a tap, a reading of a stroke, or a zero reading."""

    def __init__(self, measurements: Table, run: str) -> None:
        super().__init__(run)
        self.measurements = measurements

    def to_pandas(self) -> Any:
        """``measurements`` as a DataFrame."""
        return self.measurements.to_pandas()


class Plan(_Result):
    """Result of :func:`vibrissa.plan`.

    Attributes:
        taps: a row is a tap to make, in this order: its run, distance (mm) and drive (0: a zero reading), with the signal to fill in.
        errors: the error of a distance (mm) that is expected after so many taps, of the plan and of even grids.
        result: the plan in numbers: positions, drives, ``sigma_mm``, ``least_sigma_mm``, which parameters these taps do not tell apart.
    """

    def __init__(self, tables: list[tuple[str, Table]], run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.taps, self.errors = named["plan"], named["plan_errors"]
        self.result: dict[str, Any] = self.run["result"]


class Recorded(_Result):
    """Result of :func:`vibrissa.taps`.

    Attributes:
        taps: a row is a tap, or a rest: what :func:`vibrissa.calibrate` and :class:`vibrissa.Locator` read.
        readings: a row is what was read of the record: rest, plateau or peak, from when to when, its noise.
        result: ``noise`` of a sample, and how many ``taps``.
    """

    def __init__(self, tables: list[tuple[str, Table]], run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.taps, self.readings = named["taps"], named["readings"]
        self.result: dict[str, Any] = self.run["result"]

    @property
    def measurements(self) -> Table:
        """``taps``, by which it is taken in place of a table."""
        return self.taps


class Contour(_Result):
    """Result of :func:`vibrissa.contour`.

    Attributes:
        points: a row is a row of the data: its own columns, zero, distance ± σ, x, y, z, the ellipse of one standard deviation (half axes, mm;
            direction of the longer, degrees), how far off the curve, status.
        curve: a row is a place on the curve: length, x, y (mm), direction (degrees), standard deviation across it (mm); none without a curve.
        kind: ``"point"``, ``"line"``, ``"circle"``, ``"smooth"``, or "" without a curve.
        result: the curve in numbers, every kind with what it was judged by, each stroke; with ``truth`` distances from the object.
        outline: x, y along the object that ``truth`` names, mm; else None.
        run: ``settings``, ``counts``, ``result``.
    """

    def __init__(self, tables: list[tuple[str, Table]], run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.points, self.curve = named["points"], named["curve"]
        self.outline: Table | None = named.get("outline")
        self.result: dict[str, Any] = self.run["result"]
        self.kind: str = self.result["curve"]["kind"] or ""

    def plot(self, kind: str = "closer", ax: matplotlib.axes.Axes | None = None) -> matplotlib.axes.Axes:
        """Points with ellipses, the curve with its band, both of two standard deviations; needs matplotlib.

        Args:
            kind: ``"closer"``, or ``"where"``: with the motor's axes.
            ax: where to draw; a new figure by default.
        """
        from ._drawings import contour

        return contour(self, kind, ax)


class Shapes(_Result):
    """Result of :func:`vibrissa.shape`.

    Attributes:
        shape: a row is a section of a tap: arc length from the clamp, x, y (z where the spec tilts), mm, turn against the contact and direction,
            degrees, strain of the touching side. The motor's axis is the origin, x along the whisker at first touch.
        contacts: a row is a tap: gauge, strain, forces, where contact and pole are, status.
        run: values in force, counts, what solved it.
    """

    def __init__(self, tables: list[tuple[str, Table]], run: str) -> None:
        super().__init__(run)
        named = dict(tables)
        self.shape, self.contacts = named["shape"], named["contacts"]

    def plot(self, kind: str = "whisker", ax: matplotlib.axes.Axes | None = None, taps: Any = None) -> matplotlib.axes.Axes:
        """Bent whiskers; needs matplotlib.

        Args:
            kind: ``"whisker"`` (to scale, with gauge, contact and pole), or ``"strain"`` (along the whisker).
            ax: where to draw; a new figure by default.
            taps: numbers of the taps to show; four of them by default.
        """
        from ._drawings import shapes

        return shapes(self, kind, taps, ax)
