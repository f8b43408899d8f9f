"""Tables to and from numpy and data frames."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from ._containers import named_columns, with_index
from ._errors import InputError, short
from ._native import Table
from ._units import READ, UNITS, bare, filled, has_quantities, is_labelled, unit_of_column

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow


def words(codes: NDArray[np.int32], all_words: list[str]) -> NDArray[np.object_]:
    """Words by their codes, None where there is none."""
    return np.array([*all_words, None], dtype=object)[codes]


def _of_columns(names: list[str], columns: list[Any], own: Any = None) -> Table:
    return Table._of_columns(names, columns, own)


def _held(table: Table) -> list[Any]:
    """The columns of ``table`` as :meth:`Table._of_columns` takes them."""
    columns = []
    for name, kind in zip(table.columns, table.kinds()):
        column: Any = table.codes(name) if kind == "words" else table[name]
        columns.append((column.view(np.int64), _kind(column.dtype)) if kind == "time" else column)
    return columns


def _reduced(table: Table) -> tuple[Any, ...]:
    """For pickle: by columns."""
    return _of_columns, (table.columns, _held(table), table._own)


def to_pandas(table: Table) -> pandas.DataFrame:
    """A pandas DataFrame over the same memory (read-only; ``.copy()`` can be written to), words as categories; what was a frame's own is as it was."""
    try:
        import pandas as pd
    except ImportError:
        raise ImportError("to_pandas needs pandas (pip install pandas); table[\"name\"] is a numpy array without it") from None

    own = table._own
    columns: dict[str, Any] = {}
    for name, kind in zip(table.columns, table.kinds()):
        if own is not None and name in own.columns:
            columns[name] = own[name]
        elif kind == "words":
            codes, categories = table.codes(name)
            columns[name] = pd.Categorical.from_codes(codes, pd.Index(categories, dtype=object))
        else:
            columns[name] = table[name]
    return pd.DataFrame(columns, copy=False, index=None if own is None else own.index)


class _Stream:
    """What polars reads by the Arrow PyCapsule interface alone: it takes a mapping apart, column by column."""

    def __init__(self, table: Table) -> None:
        self.__arrow_c_stream__ = table.__arrow_c_stream__


def to_polars(table: Table) -> polars.DataFrame:
    """A polars DataFrame over the same memory."""
    import polars

    return polars.DataFrame(_Stream(table))


def to_arrow(table: Table) -> pyarrow.Table:
    """A pyarrow Table over the same memory."""
    import pyarrow

    return pyarrow.table(table)


def _no_array(table: Table, dtype: Any = None, copy: Any = None) -> NoReturn:
    """Refused: columns differ in type."""
    raise TypeError(f'a table is no array: take a column, table["{table.columns[0]}"], or table.to_pandas(), or dict(table)')


# Rows that a notebook shows.
_SHOWN = 10


def _html(table: Table) -> str:
    """For notebooks: the first rows."""
    from html import escape

    def line(cells: Any, tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    def cell(value: Any) -> str:
        return "" if _is_missing(value) else f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)

    rows = zip(*(map(cell, table[name][:_SHOWN]) for name in table.columns))
    body = "".join(line(row, "td") for row in rows)
    more = f"<p>{len(table)} rows × {len(table.columns)} columns</p>"
    return f"<table><thead>{line(table.columns, 'th')}</thead><tbody>{body}</tbody></table>{more}"


def _is_missing(value: Any) -> bool:
    """None, NaN, NaT, NA, a masked value."""
    # NA of pandas is neither equal to itself nor not.
    return value is None or type(value).__name__ in ("NAType", "MaskedConstant") or isinstance(value, (float, np.generic)) and bool(value != value)


def _values_of(table: Table) -> list[NDArray[Any]]:
    """Columns as numpy arrays, in order."""
    return [table[name] for name in table.columns]


def _items(table: Table) -> list[tuple[str, NDArray[Any]]]:
    """Names and columns, as of a dict."""
    return list(zip(table.columns, _values_of(table)))


def _get(table: Table, name: object, default: Any = None, /) -> Any:
    """A column, or ``default`` where there is none of this name."""
    return table[name] if name in table else default  # type: ignore[index]


def _keys(table: Table) -> list[str]:
    """Names of the columns: ``dict(table)`` has them all as numpy arrays."""
    return table.columns


# What a table has beside its columns; it never changes, so that a copy is itself.
_METHODS: dict[str, Any] = {
    "__iter__": lambda table: iter(table.columns), "keys": _keys, "values": _values_of, "items": _items, "get": _get, "to_pandas": to_pandas,
    "to_polars": to_polars, "to_arrow": to_arrow, "__array__": _no_array, "_repr_html_": _html, "__reduce__": _reduced,
    "__copy__": lambda table: table, "__deepcopy__": lambda table, memo: table,
}
for _name, _method in _METHODS.items():
    setattr(Table, _name, _method)


def _word(value: Any) -> str:
    """``value`` as one line."""
    return " ".join(str(value).splitlines())


def _kind(dtype: np.dtype[Any]) -> str:
    """``M8[ns]`` and the like, of times."""
    return f"{dtype.kind}8[{np.datetime_data(dtype)[0]}]"


def _values(column: Any) -> NDArray[Any]:
    """The values of a column as an array; where some are missing that an array of this type does not show, as objects."""
    if isinstance(column, (list, tuple)) and len(kinds := set(map(type, column))) > 1 and kinds & {str, bool, np.str_, np.bool_}:
        # numpy would make words of numbers, and numbers of truth values.
        objects = np.empty(len(column), dtype=object)
        objects[:] = column
        return objects
    numbers, missing = filled(column)
    array: NDArray[Any] = np.atleast_1d(np.asarray(numbers))
    if missing is None or not np.any(missing):
        return array
    objects = array.astype(object)
    objects[np.atleast_1d(missing)] = None
    return objects


# Times of Arrow, and units of numpy that are whole ones of them.
_OF_TIME = {"W": "s", "D": "s", "h": "s", "m": "s", "s": "s", "ms": "ms", "us": "us", "ns": "ns"}


def _is_float(value: Any) -> bool:
    """Whether ``value`` is missing, or a number that float64 holds."""
    if value is None:
        return True
    real = isinstance(value, (float, int, np.floating, np.integer)) and not isinstance(value, bool)
    return real and (abs(value) < 2**63 or isinstance(value, float)) and float(value) == value


def _native_column(values: NDArray[Any]) -> Any:
    """A column as :meth:`Table._of_columns` takes it, every value as it is: numbers, flags and times as such, anything else as words."""
    kind = values.dtype.kind
    if kind == "f" and values.dtype.itemsize <= 8:
        return np.array(values, dtype=np.float64)
    if kind == "b":
        return np.array(values)
    if kind in "iu" and (values.size == 0 or int(values.max()) < 2**63):
        return np.array(values, dtype=np.int64)
    unit = _OF_TIME.get(np.datetime_data(values.dtype)[0]) if kind in "mM" else None
    if unit is not None:
        times = np.array(values, dtype=f"{kind}8[{unit}]")
        return times.view(np.int64), _kind(times.dtype)
    items = [None if _is_missing(x) else x for x in (values.astype(object) if kind in "mM" else values).tolist()]
    if all(map(_is_float, items)):
        return np.array([np.nan if x is None else float(x) for x in items])
    known: dict[str, int] = {}
    codes = [-1 if x is None else known.setdefault(str(x), len(known)) for x in items]
    return np.array(codes, dtype=np.int32), [_unicode(word) for word in known]


def _unicode(word: str) -> str:
    """``word`` with a question mark for each lone surrogate, which no file can hold."""
    return word.encode("utf-8", "replace").decode()


def _read_column(values: NDArray[Any]) -> Any:
    """A column as the engine reads it: numbers as float64, anything else as words."""
    if values.dtype.kind == "f":
        return np.array(values, dtype=np.float64)
    items = [None if _is_missing(x) else x for x in values.tolist()]
    if all(map(_is_float, items)):
        return np.array([np.nan if x is None else float(x) for x in items], dtype=np.float64)
    if values.dtype.kind in "mM":
        items = [None if empty else text for empty, text in zip(np.isnat(values), values.astype(str).tolist())]
    known: dict[str, int] = {}
    codes = [-1 if x is None else known.setdefault(_word(repr(x) if isinstance(x, float) else x), len(known)) for x in items]
    return np.array(codes, dtype=np.int32), [_unicode(word) for word in known]


class Data(NamedTuple):
    """A table of measurements."""

    label: str
    """Its name in messages, the path of a file."""
    rows: Any
    """As the engine takes it: the path of a file, or names and columns."""
    columns: list[NDArray[Any]]
    """Its columns as they were given, or in the units of their names; none of a file."""
    converted: list[int]
    """Places of those that had a unit."""
    frame: Any
    """It as a frame, where pandas made it."""

    def held(self) -> list[tuple[str, Any]]:
        """It as a file in memory, where it is none on a disk."""
        return [] if isinstance(self.rows, str) else [(self.label, self.rows)]

    def keep(self, table: Table) -> Table:
        """``table``, whose columns after the number of the line begin with those of this one, with these as they were given."""
        given = slice(1, 1 + len(self.columns))
        if not self.columns or len(self.columns[0]) != len(table):
            return table
        names, columns = table.columns, _held(table)
        columns[given] = map(_native_column, self.columns)
        own = None
        if self.frame is not None:
            own = self.frame.copy()
            for place in self.converted:
                own.isetitem(place, self.columns[place])
            own.columns = names[given]
            own = own.loc[:, ~own.columns.duplicated()]
        return _of_columns(names, columns, own)


def _units(columns: dict[str, str] | str | None) -> dict[str, str | None]:
    """Units of the columns that the user names, by what each is said to be."""
    parts = (part.partition("=") for part in columns.split(",")) if isinstance(columns, str) else ((role, "", name) for role, name in (columns or {}).items())
    long = {"bridge": "bridge_mV_per_V", "bridge_2": "bridge_mV_per_V_2"}
    named = {str(name).strip(): str(role).strip() for role, _, name in parts}
    return {name: UNITS.get(f"tap.{role}") or unit_of_column(long.get(role, role)) for name, role in named.items() if role != "ignore"}


def _read(name: str, column: Any, unit: str | None) -> NDArray[Any]:
    """A column of numbers in this unit."""
    values = _values(bare(name, column, unit))
    if values.dtype.kind in "mMcbV":
        raise InputError(f"{values.dtype} is no type of numbers", key=name, value=short(column), allowed="numbers")
    found: NDArray[Any] = bare(name, values, unit)
    return found


def _kept(name: str, column: Any) -> NDArray[Any]:
    """A column that is not read: quantities are numbers in the unit of its name, else words."""
    try:
        return _values(column if is_labelled(column) else bare(name, column, unit_of_column(name)))
    except InputError:
        return np.array([str(x) for x in column], dtype=object)


def _file_of_lines(file: BinaryIO, what: str, path: str) -> bytes:
    """All that ``file`` holds, read in blocks: a file with a line of more than 1 MiB is no table, and is refused before it fills the memory."""
    blocks, lines, line = [], 1, 0
    while block := file.read(1 << 16):
        blocks.append(block)
        ends = block.replace(b"\r", b"\n")
        first, last = ends.find(b"\n"), ends.rfind(b"\n")
        if line + (len(block) if first < 0 else first) > 1 << 20:
            raise InputError(f"this {what} file is no table: line {lines} is longer than 1 MiB", key=what, file=path, line=lines, allowed="lines of up to 1 MiB")
        lines += block.count(b"\n")
        line = len(block) - 1 - last if last >= 0 else line + len(block)
    return b"".join(blocks)


def text_of(path: Any, what: str) -> tuple[str, str]:
    """Name and text of a file."""
    try:
        label = os.fsdecode(path)
        with open(path, "rb") as file:
            return label, _file_of_lines(file, what, label).decode()
    except UnicodeDecodeError:
        raise InputError(f"this is no {what}: it is not UTF-8 text", key=what, file=label) from None
    except InputError:
        raise
    except (OSError, ValueError) as e:
        raise _unread(path, what, e) from None


def _unread(path: Any, what: str, e: Exception) -> InputError:
    why = e.strerror if isinstance(e, OSError) else "this is no path"
    return InputError(f"this {what} file cannot be read: {why}", key=what, file=str(path).encode(errors="replace").decode())


def measured(data: Any, what: str, columns: dict[str, str] | str | None = None) -> Data:
    """A table of measurements: a path, a data frame (pandas, polars), a mapping of names to columns, or what simulate gave; ``columns`` says
    what those with other names are."""
    data = getattr(data, "measurements", data)
    if isinstance(data, (str, os.PathLike)):
        try:
            os.stat(data)
        except (OSError, ValueError) as e:
            raise _unread(os.fspath(data), what, e) from None
        path = os.fsdecode(data)
        return Data(path, path, [], [], None)
    if not (columns is None or isinstance(columns, (str, Mapping))):
        raise InputError("this names no columns", key="columns", value=short(columns), allowed='dict(a="…", theta="…", reading="…")')
    said = _units(columns)
    data = with_index(data, READ | set(said))
    named = named_columns(data, what, READ | set(said))
    values = [
        _read(name, column, said[name] if name in said else unit_of_column(name)) if name in said or name in READ else _kept(name, column)
        for name, column in named]
    converted = [place for place, (_, column) in enumerate(named) if has_quantities(column)]
    pandas = sys.modules.get("pandas")
    frame = None
    if pandas is not None:
        series = isinstance(data, Mapping) and any(isinstance(column, pandas.Series) for _, column in named)
        frame = pandas.DataFrame(dict(named)) if series else data if isinstance(data, pandas.DataFrame) else None
    if len({a.shape for a in values}) > 1 or any(a.ndim > 1 for a in values):
        shapes = ", ".join(f"{name}: {a.shape}" for (name, _), a in zip(named, values))
        raise InputError("columns must be of one length", key="data", value=shapes)
    rows = [_word(name).strip() for name, _ in named], [_read_column(column) for column in values]
    return Data("data", rows, values, converted, frame)
