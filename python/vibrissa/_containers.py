"""Tables in memory, whatever holds them, as columns with their names."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Set
from typing import Any

import numpy as np

from ._errors import InputError
from ._labels import aligned
from ._units import PROPERTIES, unit_of_column

_KINDS = ("a DataFrame (pandas, polars), a pyarrow Table, a DuckDB relation, whatever knows the Arrow PyCapsule interface, a structured array, an xarray Dataset, "
          "a dict of columns, what simulate gave")


def _polars(column: Any) -> Any:
    if column.dtype.is_decimal():
        return column.cast(float).to_numpy()
    # An array of whole numbers shows none that is missing.
    return np.array(column.to_list(), dtype=object) if column.dtype.is_integer() and column.null_count() else column.to_numpy()


def _arrow(column: Any) -> Any:
    kind = str(column.type)
    if "decimal" in kind:
        return np.asarray(column.cast("double"))
    return np.array(column.to_pylist(), dtype=object) if column.null_count and "int" in kind else np.asarray(column)


def with_index(data: Any, known: Set[str]) -> Any:
    """A frame of pandas whose levels of the index are columns where a column has such a name; anything else as it is."""
    pandas = sys.modules.get("pandas")
    if pandas is None or not isinstance(data, pandas.DataFrame):
        return data
    levels = [name for name in data.index.names if name in known and name not in data.columns]
    return data.reset_index(level=levels) if levels else data


def _of_dataset(data: Any, known: Set[str]) -> list[tuple[str, Any]]:
    """Variables and coordinates of an xarray Dataset, each over the dimensions of those that are ``known``; coordinates that only number a
    dimension are none, and what has other dimensions is left out."""
    import xarray

    labels = {name for name in data.dims if name in data.coords and name not in known}
    read = [data[name] for name in data.variables if name in known] or list(data.data_vars.values())
    sizes = {dim: size for x in read for dim, size in x.sizes.items()}
    sizes = {dim: size for dim, size in data.sizes.items() if dim in sizes}
    whole = {name: data[name].variable.to_base_variable().set_dims(sizes)
             for name in data.variables if name not in labels and set(data[name].dims) <= set(sizes)}
    return [(str(name), xarray.DataArray(x.data.reshape(-1), dims="row", attrs=x.attrs)) for name, x in whole.items()]


def _no_table(data: Any, what: str) -> InputError:
    path = '{"file": path}' if what == "tuples" else "a path"
    return InputError(f"{type(data).__name__} is no table", key=what, allowed=f"{path}, {_KINDS}")


def _told_apart(columns: list[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Columns of DuckDB, for which D_mm and d_mm are one name: it calls the second d_mm_1."""
    lower = {name.lower() for name, _ in columns}

    def own(name: str) -> str:
        short = name.removesuffix("_1")
        return short if short != name and short.lower() in lower and short not in names else name

    names = [name for name, _ in columns]
    return [(own(name), column) for name, column in columns]


def named_columns(data: Any, what: str, known: Set[str] = frozenset()) -> list[tuple[str, Any]]:
    """The columns of a table in memory with their names, in their order; ``known`` are names that an index may have, too.

    Raises:
        InputError: no table; a dict of columns whose labels differ.
    """
    data = with_index(data, known)
    if isinstance(getattr(data, "dtype", None), np.dtype) and data.dtype.names:
        return [(str(name), data[name]) for name in data.dtype.names]
    if hasattr(data, "data_vars") and hasattr(data, "coords"):
        return _of_dataset(data, known)
    if isinstance(data, Mapping) and not hasattr(data, "kinds"):
        paired, _ = aligned({str(name): column for name, column in data.items()}, f"{what}.")
        return list(paired.items())
    if hasattr(data, "iloc") and not hasattr(data, "columns"):  # A row of a frame.
        return [(str(name), value) for name, value in data.items()]
    if hasattr(data, "iloc"):
        return [(str(name), data.iloc[:, place]) for place, name in enumerate(data.columns)]
    if type(data).__name__ == "LazyFrame" and hasattr(data, "collect"):
        data = data.collect()
    if hasattr(data, "write_csv") and hasattr(data, "get_column"):
        return [(name, _polars(data[name])) for name in data.columns]
    if hasattr(data, "schema") and hasattr(data, "to_pylist") and hasattr(data, "column"):
        return [(name, _arrow(data.column(place))) for place, name in enumerate(data.schema.names)]
    if hasattr(data, "columns") and hasattr(data, "kinds"):
        return [(name, data[name]) for name in data.columns]
    if hasattr(data, "__arrow_c_stream__") or hasattr(data, "__arrow_c_array__"):
        try:
            import pyarrow
        except ImportError:
            raise ImportError(f"a {type(data).__name__} is read by pyarrow (pip install pyarrow)") from None
        # DuckDB's relations, record batches and their readers, and whatever else knows the Arrow PyCapsule interface.
        try:
            columns = named_columns(pyarrow.table(data), what)
        except (pyarrow.ArrowException, TypeError, ValueError):
            raise _no_table(data, what) from None
        return _told_apart(columns) if hasattr(data, "fetch_arrow_table") else columns
    if hasattr(data, "keys") and hasattr(data, "__getitem__"):
        return [(str(name), data[name]) for name in data.keys()]
    raise _no_table(data, what)


# Columns that name a row of a sweep of axes.
_AXES = ("D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "scale", *PROPERTIES, "a_mm", "tilt_deg", "lean_deg", "theta_deg", "delta_mm")


def grid(table: Any) -> Any:
    """A table whose rows are a grid as an xarray Dataset.

    Raises:
        InputError: rows that are none.
    """
    try:
        import xarray
    except ImportError:
        raise ImportError("to_xarray needs xarray (pip install xarray)") from None
    # The dimensions of a profile follow its scale.
    follows = ("D_mm", "d_tip_mm", "L_a_mm") if "scale" in table else ()
    axes = {}
    for name in (name for name in table.columns if name in _AXES and name not in follows):
        values, first = np.unique(table[name], return_index=True)
        axes[name] = values[np.argsort(first)]
    dims = {name: values for name, values in axes.items() if len(values) > 1}
    shape = tuple(map(len, dims.values()))
    whole = int(np.prod(shape)) == len(table)
    if not whole or any((table[name] != x.reshape(-1)).any() for name, x in zip(dims, np.meshgrid(*dims.values(), indexing="ij"))):
        raise InputError("these rows are no grid", key="table", value=f"{len(table)} rows", allowed="a sweep of axes, without samples, tuples or [output] top")
    units = {name: {"units": unit} if (unit := unit_of_column(name)) else {} for name in table.columns}
    columns = {name: (tuple(dims), table[name].reshape(shape), units[name]) for name in table.columns if name not in axes}
    coordinates = {name: (name, values, units[name]) if name in dims else values[0] for name, values in axes.items()}
    return xarray.Dataset(columns, coordinates)
