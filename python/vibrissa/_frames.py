"""Tables to and from numpy and data frames."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from csv import QUOTE_MINIMAL, QUOTE_NONNUMERIC
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError

if TYPE_CHECKING:
    import pandas

    from ._native import Table


def words(codes: NDArray[np.int32], all_words: list[str]) -> NDArray[np.object_]:
    """Words by their codes, None where there is none."""
    return np.array([*all_words, None], dtype=object)[codes]


def _of_columns(names: list[str], columns: list[Any]) -> Table:
    from ._native import Table

    return Table._of_columns(names, columns)


def reduced(table: Table) -> tuple[Any, ...]:
    """What :mod:`pickle` makes ``table`` of again."""
    columns = [table.codes(name) if kind == "words" else table[name] for name, kind in zip(table.columns, table.kinds())]
    return _of_columns, (table.columns, columns)


def to_pandas(table: Table) -> pandas.DataFrame:
    """Columns of numbers are those of the table, not copies; words become categories."""
    try:
        import pandas as pd
    except ImportError:
        raise ImportError("to_pandas needs pandas (pip install pandas); table[\"name\"] is a numpy array without it") from None

    columns: dict[str, Any] = {}
    for name, kind in zip(table.columns, table.kinds()):
        if kind == "words":
            codes, categories = table.codes(name)
            columns[name] = pd.Categorical.from_codes(codes, pd.Index(categories, dtype=object))
        else:
            columns[name] = table[name]
    return pd.DataFrame(columns, copy=False)


def _cell(value: Any) -> str:
    # NA of pandas is neither equal to itself nor not.
    if value is None or type(value).__name__ in ("NAType", "MaskedConstant") or value != value:
        return ""
    text = repr(float(value)) if isinstance(value, (float, np.floating)) else str(value)
    # A row is a line.
    text = " ".join(text.splitlines())
    # What begins with # would be a comment at the begin of a line.
    quoted = any(c in text for c in ',"') or _is_comment(text)
    return '"' + text.replace('"', '""') + '"' if quoted else text


def _is_comment(value: Any) -> bool:
    return isinstance(value, str) and value.lstrip().startswith("#")


def _line(value: Any) -> Any:
    """A text without line ends."""
    return " ".join(value.splitlines()) if isinstance(value, str) else value


def _column(column: Any) -> NDArray[Any]:
    """A column whose masked values are missing."""
    if isinstance(column, np.ma.MaskedArray):
        missing: Any = np.nan if column.dtype.kind in "biuf" else None
        kept: NDArray[Any] = np.asarray(column, dtype=np.float64 if missing is not None else object)
        return np.atleast_1d(np.where(np.ma.getmaskarray(column), missing, kept))
    return np.atleast_1d(np.asarray(column))


def _csv_of(columns: Mapping[str, Any]) -> bytes:
    arrays = {str(name): _column(column) for name, column in columns.items()}
    lengths = {len(a) for a in arrays.values()}
    if len(lengths) > 1 or any(a.ndim > 1 for a in arrays.values()):
        shapes = ", ".join(f"{name}: {a.shape}" for name, a in arrays.items())
        raise InputError("columns must be of one length", key="data", value=shapes)
    out = io.StringIO()
    out.write(",".join(_cell(name) for name in arrays) + "\n")
    for row in zip(*(a.tolist() for a in arrays.values())):
        out.write(",".join(map(_cell, row)) + "\n")
    return out.getvalue().encode()


def csv(data: Any, what: str) -> tuple[str, bytes]:
    """Name and bytes of a table of measurements: a path, a data frame (pandas, polars), a mapping of names to columns, or what simulate gave."""
    data = getattr(data, "measurements", data)
    if isinstance(data, (str, os.PathLike)):
        path = os.fspath(data)
        try:
            with open(path, "rb") as file:
                return str(path), file.read()
        except (OSError, ValueError) as e:
            why = e.strerror if isinstance(e, OSError) else "this is no path"
            raise InputError(f"this {what} file cannot be read: {why}", key=what, file=str(path).encode(errors="replace").decode()) from None
    if isinstance(data, Mapping):
        return "data", _csv_of(data)
    if hasattr(data, "to_csv"):
        kept = data.apply(lambda column: column if column.dtype.kind in "biuf" else column.map(_line))
        kept.columns = [_line(str(name)) for name in data.columns]
        comments = len(kept.columns) > 0 and (_is_comment(kept.columns[0]) or any(map(_is_comment, kept.iloc[:, 0])))
        return "data", kept.to_csv(index=False, quoting=QUOTE_NONNUMERIC if comments else QUOTE_MINIMAL).encode()
    if hasattr(data, "write_csv"):
        if all(t.is_numeric() for t in data.dtypes) and not any(_is_comment(n) or n != _line(n) for n in data.columns):
            return "data", data.write_csv().encode()
        return "data", _csv_of({name: np.array(data[name].to_list(), dtype=object) for name in data.columns})
    if hasattr(data, "schema") and hasattr(data, "to_pylist"):
        return "data", _csv_of({name: np.array(data[name].to_pylist(), dtype=object) for name in data.schema.names})
    if hasattr(data, "columns") and hasattr(data, "kinds"):
        return "data", _csv_of({name: data[name] for name in data.columns})
    kind = type(data).__name__
    raise InputError(f"{kind} is no table", key=what, allowed="a path, a DataFrame (pandas, polars), a pyarrow Table, a dict of columns, what simulate gave")
