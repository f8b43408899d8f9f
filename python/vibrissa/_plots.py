"""Figures from the tables of results, with matplotlib where it is there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import InputError, short
from ._native import Table
from ._spec import whole
from ._taps import number_array
from ._units import unit_of_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._results import BestTap, Calibration, Search, Sweep

# Okabe and Ito's colours, which colour-blind readers tell apart.
_COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
_DESIGN = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm"]
# Columns of properties of the rig that a table has where they differ from design to design: their symbols and units.
_PROPERTIES = {
    "exponent": ("n", ""), "scale": ("scale", ""), "bore_mm": ("bore", " mm"), "core_mm": ("core", " mm"), "E_core_MPa": ("E_c", " MPa"),
    "kappa_base_per_mm": ("κ_base", "/mm"), "kappa_slope_per_mm2": ("κ_slope", "/mm²"), "k_theta_Nmm_per_rad": ("k_θ", " N mm/rad"),
    "k_y_N_per_mm": ("k_y", " N/mm"), "k_x_N_per_mm": ("k_x", " N/mm"), "hub_mm": ("r₀", " mm"), "E_MPa": ("E", " MPa"), "nu": ("ν", ""),
    "pole_radius_mm": ("ρ", " mm"), "mu": ("μ", ""), "foil_N_per_mm": ("foil", " N/mm"), "noise": ("σ", ""), "tilt_deg": ("tilt", "°"), "lean_deg": ("lean", "°"),
}
_MARKS = "osD^vP*"
# Designs with a name in the figure of their spread, and the most that are drawn in grey behind them.
_NAMED, _BEHIND = 7, 300


def look(k: int) -> dict[str, Any]:
    """Colour and mark of the ``k``-th of several series: 49 that differ."""
    return dict(color=_COLOURS[k % 7], marker=_MARKS[(k + k // 7) % 7], markersize=4)


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    try:
        import matplotlib.pyplot as plt
    except ImportError as e:
        raise ImportError("plots need matplotlib: pip install matplotlib") from e
    return plt.subplots(figsize=(5.2, 3.8), layout="constrained")[1]


def _drive(table: Table) -> tuple[str, str]:
    """Column of the drive, and its label."""
    return ("theta_deg", "tap angle θ (°)") if "theta_deg" in table else ("delta_mm", "displacement δ (mm)")


def _unit(table: Table, name: str) -> tuple[str, str]:
    """Column of a figure of K, and its label."""
    return (name, name) if name in table else (f"{name}_mm", f"{name} (mm)")


def _properties(table: Table) -> list[str]:
    """Columns of properties of the rig, and of the direction of the object's edge."""
    return [c for c in _PROPERTIES if c in table]


def _whiskers(table: Table) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """The different whiskers in row order, and the number of the whisker of each row."""
    rows = np.column_stack([table[c] for c in [*_DESIGN, *_properties(table)]])
    different, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=int)
    rank[order] = np.arange(len(order))
    return different[order], rank[number.reshape(-1)]


def _name(whiskers: np.ndarray[Any, Any], number: int, table: Table) -> str:
    """What tells a whisker from the others."""
    varied = [k for k in range(whiskers.shape[1]) if len(np.unique(whiskers[:, k])) > 1] or [0, 1]
    lengths = ", ".join(f"{_DESIGN[k].removesuffix('_mm').removesuffix('_tip')} = {whiskers[number, k]:g}" for k in varied if k < len(_DESIGN))
    names = [_PROPERTIES[c] for c in _properties(table)]
    others = [(*names[k - len(_DESIGN)], whiskers[number, k]) for k in varied if k >= len(_DESIGN)]
    said = [f"{symbol} = {value:g}{unit}" for symbol, unit, value in others]
    return ", ".join([f"{lengths} mm"] * bool(lengths) + said)


def _needs(table: Table | None, name: str, kind: str) -> Table:
    if table is None:
        raise InputError(f"this figure is of the table {name}, which was not asked for", key="kind", value=kind, allowed=f"output=dict({name}=True)")
    return table


def _shown(values: np.ndarray[Any, Any], most: int) -> np.ndarray[Any, Any]:
    """At most so many of the different values, evenly from the first to the last."""
    different = np.unique(values)
    return different if len(different) <= most else different[np.linspace(0, len(different) - 1, most).round().astype(int)]


def _lines(keys: np.ndarray[Any, Any], wanted: np.ndarray[Any, Any]) -> Iterator[tuple[int, float, np.ndarray[Any, Any]]]:
    for k, value in enumerate(wanted):
        yield k, value, np.flatnonzero(keys == value)


def sweep(result: Sweep, kind: str, ax: Axes | None, design: int, drives: Any) -> Axes:
    """Figs. 5 to 8 of the paper, and the error against the drive."""
    kinds: dict[str, Any] = {"strain": _strain, "K": _k, "sd": _sd, "distance": _distance, "error": _error}
    if not isinstance(kind, str) or kind not in kinds:
        raise InputError("there is no such figure", key="kind", value=short(kind), allowed=", ".join(kinds))
    if kind == "sd":
        return _sd(_needs(result.designs, "designs", kind), _axes(ax))
    name = "designs" if kind == "error" else "tuples"
    table = _needs(getattr(result, name), name, kind)
    whiskers, number = _whiskers(table)
    design = whole("design", design, len(whiskers) - 1)
    rows = np.flatnonzero(number == design)
    column, label = _drive(table)
    of = table[column][rows]
    wanted = _shown(of, 5) if drives is None else np.unique(number_array("drives", drives, "numbers, degrees or mm", unit_of_column(column)))
    if len(wanted) > len(_COLOURS) * len(_MARKS):
        raise InputError("so many drives cannot be told apart in one figure", key="drives", value=short(drives), allowed=f"at most {len(_COLOURS) * len(_MARKS)}")
    ax = _axes(ax)
    if kind == "strain":
        _strain(table, rows, ax)
    elif kind == "error":
        _error(table, rows, ax)
    else:
        kinds[kind](table, rows, ax, of, wanted)
    ax.set_title(_name(whiskers, design, table), fontsize="medium")
    return ax


def _strain(table: Table, rows: np.ndarray[Any, Any], ax: Axes) -> Axes:
    """Strain against the drive at a few distances, exact beside linear."""
    column, label = _drive(table)
    a = table["a_mm"][rows]
    for k, value, at in _lines(a, _shown(a, 4)):
        x = table[column][rows[at]]
        order = np.argsort(x)
        ax.plot(x[order], table["strain"][rows[at]][order], color=_COLOURS[k], label=f"a = {value:g} mm")
        ax.plot(x[order], table["strain_linear"][rows[at]][order], color=_COLOURS[k], linestyle="--", linewidth=0.9)
    ax.plot([], [], color="grey", linestyle="--", linewidth=0.9, label="linear theory θ f(a)")
    ax.set(xlabel=label, ylabel="strain ε")
    ax.legend(fontsize="small")
    return ax


def _k(table: Table, rows: np.ndarray[Any, Any], ax: Axes, of: np.ndarray[Any, Any], wanted: np.ndarray[Any, Any]) -> Axes:
    """K against the distance, a line for each drive."""
    name, label = _unit(table, "K")
    for k, value, at in _lines(of, wanted):
        ax.plot(table["a_mm"][rows[at]], table[name][rows[at]], **look(k),
                label=f"{'θ' if 'theta_deg' in table else 'δ'} = {value:g}{'°' if 'theta_deg' in table else ' mm'}")
    ax.set(xlabel="contact distance a (mm)", ylabel=label)
    ax.legend(fontsize="small")
    return ax


def _distance(table: Table, rows: np.ndarray[Any, Any], ax: Axes, of: np.ndarray[Any, Any], wanted: np.ndarray[Any, Any]) -> Axes:
    """Estimated against true distance, a mark for each drive."""
    a = table["a_mm"][rows]
    ax.plot([a.min(), a.max()], [a.min(), a.max()], color="grey", linewidth=0.9, label="true")
    for k, value, at in _lines(of, wanted):
        ax.plot(a[at], table["distance_mm"][rows[at]], **look(k), linestyle="none",
                label=f"{'θ' if 'theta_deg' in table else 'δ'} = {value:g}{'°' if 'theta_deg' in table else ' mm'}")
    ax.set(xlabel="contact distance a (mm)", ylabel="estimated distance â (mm)")
    ax.legend(fontsize="small")
    return ax


def _sd(table: Table, ax: Axes) -> Axes:
    """Spread of K against the drive: a line for each whisker, or for those of least spread, with the others in grey behind."""
    column, label = _drive(table)
    name, of_k = _unit(table, "K_sd")
    whiskers, number = _whiskers(table)
    least = np.full(len(whiskers), np.inf)
    np.fmin.at(least, number, table[name])
    ranked = np.argsort(least, kind="stable")
    named, others = (ranked, ranked[:0]) if len(ranked) <= _NAMED else (ranked[:_NAMED], ranked[_NAMED:])
    behind = _shown(np.sort(others), _BEHIND)

    def line(design: int) -> list[np.ndarray[Any, Any]]:
        rows = np.flatnonzero(number == design)
        rows = rows[np.argsort(table[column][rows])]
        return [table[column][rows], table[name][rows]]

    for k, design in enumerate(behind):
        few = "" if len(behind) == len(others) else f"{len(behind)} of "
        drives, spreads = line(design)
        ax.plot(drives, spreads, color="lightgrey", linewidth=0.7, zorder=1, marker="." if len(drives) == 1 else None, label=f"{few}the other {len(others)} designs" if k == 0 else None)
    for k, design in enumerate(named if len(others) else np.sort(named)):
        ax.plot(*line(design), **look(k), label=_name(whiskers, int(design), table))
    ax.set(xlabel=label, ylabel=of_k, yscale="log")
    handles, labels = ax.get_legend_handles_labels()
    first = len(behind) > 0
    ax.legend(handles[first:] + handles[:first], labels[first:] + labels[:first], fontsize="small", title=f"the {_NAMED} designs of least spread" if first else None,
              title_fontsize="small")
    return ax


def _error(table: Table, rows: np.ndarray[Any, Any], ax: Axes) -> Axes:
    """Bias, noise and total against the drive."""
    column, _ = _drive(table)
    _errors(table[column][rows], [table[c][rows] for c in ("error_rms_mm", "noise_rms_mm", "total_rms_mm")], ax)
    ax.set_xlabel(_drive(table)[1])
    return ax


def _errors(drive: np.ndarray[Any, Any], parts: list[np.ndarray[Any, Any]], ax: Axes) -> None:
    order = np.argsort(drive)
    for values, name, style, k in zip(parts, ("bias", "noise", "total"), ("--", ":", "-"), (1, 2, 0)):
        if np.nanmax(values, initial=0.0) > 0:
            ax.plot(drive[order], values[order], linestyle=style, color=_COLOURS[k], label=name)
    ax.set(ylabel="error of the distance, rms (mm)", yscale="log")
    ax.legend(fontsize="small")


def best_tap(result: BestTap, ax: Axes | None) -> Axes:
    """Error against the drive with its optimum."""
    ax, curve = _axes(ax), result.curve
    column, label = _drive(curve)
    if np.isfinite(curve["total_rms_mm"]).any():
        _errors(curve[column], [curve[c] for c in ("error_rms_mm", "noise_rms_mm", "total_rms_mm")], ax)
        y = result.optimum["total_rms_mm"]
    else:
        name, of_k = _unit(curve, "K_sd")
        ax.plot(curve[column], curve[name], color=_COLOURS[0])
        ax.set(ylabel=of_k, yscale="log")
        y = result.optimum[name]
    x = result.optimum[column]
    ax.plot([x], [y], "o", color=_COLOURS[6], label=f"best: {x:.3g}{'°' if column == 'theta_deg' else ' mm'}")
    ax.set_xlabel(label)
    ax.legend(fontsize="small")
    return ax


def search(result: Search, ax: Axes | None) -> Axes:
    """The front, or the way of a search."""
    ax = _axes(ax)
    if result.front is not None:
        name, of_k = _unit(result.front, "K_sd")
        ax.plot(result.front[name], result.front["total_rms_mm"], ".", color=_COLOURS[0], label="front")
        ax.plot([result.best[name]], [result.best["total_rms_mm"]], "o", color=_COLOURS[1], label="least total")
        ax.set(xlabel=of_k, ylabel="total_rms_mm", xscale="log")
    else:
        objective = result.run["result"]["objective"]
        column = {"sd": _unit(result.history, "K_sd")[0], "distance": "total_rms_mm"}.get(objective, "weighted")
        ax.step(result.history["evaluations"], result.history[column], where="post", color=_COLOURS[0], label=f"best {column}")
        ax.set(xlabel="evaluations", ylabel=column, yscale="log")
    ax.legend(fontsize="small")
    return ax


def calibration(result: Calibration, ax: Axes | None) -> Axes:
    """Data over what the winner expects of them; of several channels the errors of the distance that they tell together."""
    ax = _axes(ax)
    if hasattr(result, "channels"):
        taps = result.channels
        for k, use in enumerate(("used", "suspect")):
            at = taps["use"] == use
            if at.any():
                ax.errorbar(taps["a_mm"][at], taps["error_mm"][at], taps["sigma_mm"][at], fmt=_MARKS[k], color=_COLOURS[k], markersize=3, linewidth=0.7, label=use)
        ax.axhline(0.0, color="black", linewidth=0.5)
        names = ", ".join(channel["name"] for channel in result.result["channels"])
        ax.set(xlabel="contact distance a (mm)", ylabel="error of the distance (mm)", title=f"{names} together")
        ax.legend(fontsize="small")
        return ax
    rows = result.rows
    signal = next(name for name in ("strain", "reading", "moment_Nmm", "force_N") if name in rows)
    column = "theta_deg" if "theta_deg" in rows else "delta_mm"
    tap = np.isfinite(rows["expected"])
    used = rows["use"] == "used"
    drive = rows[column]
    for k, value, at in _lines(np.where(tap & used, drive, np.nan), _shown(drive[tap & used], 5)):
        a = rows["a_mm"][at]
        order = np.argsort(a)
        name = f"{'θ' if column == 'theta_deg' else 'δ'} = {value:g}{'°' if column == 'theta_deg' else ' mm'}"
        ax.plot(a[order], rows["expected"][at][order], color=_COLOURS[k], linewidth=0.9)
        ax.plot(a, rows[signal][at], _MARKS[k], color=_COLOURS[k], markersize=3, label=name)
    suspect = tap & (rows["use"] == "suspect")
    if suspect.any():
        ax.plot(rows["a_mm"][suspect], rows[signal][suspect], "x", color="black", label="suspect")
    ax.set(xlabel="contact distance a (mm)", ylabel=signal, title=f"{result.estimator}, data and fit")
    ax.legend(fontsize="small")
    return ax
