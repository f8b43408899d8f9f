"""Arrays with labels, of pandas and xarray: they are paired by their labels, and answers have them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, short


class Labels(NamedTuple):
    """The labels that arguments have in common."""

    shape: tuple[int, ...]
    put: Callable[[NDArray[Any]], Any]
    """Puts them on an array of this shape."""
    put_more: Callable[[NDArray[Any], list[str]], Any]
    """Puts them on an array with one more axis, whose places have these names."""


class Shape(tuple[int, ...]):
    """The common shape of arguments, with their labels if they have some."""

    labels: Labels | None = None

    def of(self, values: NDArray[Any], names: list[str] | None = None) -> Any:
        """``values`` as an answer: an array of this shape with the labels, or a number; with ``names`` an array with one more axis."""
        whole = values.reshape(self if names is None else (*self, len(names)))
        if self.labels is None:
            return whole if self or names is not None else whole[()]
        return self.labels.put(whole) if names is None else self.labels.put_more(whole, names)


def _refused(name: str, other: str, why: str) -> InputError:
    return InputError(f"the labels of {name} and {other} differ: {why}", key=name, value=f"{name} beside {other}",
                      allowed="arguments with the same labels, in any order; numbers and arrays without labels")


def aligned(given: Mapping[str, Any], prefix: str = "") -> tuple[dict[str, Any], Labels | None]:
    """Arguments with the labels of the first that has some, in its order, and these labels; others as they are.

    Raises:
        InputError: labels that some have and others have not.
    """
    pandas, xarray = sys.modules.get("pandas"), sys.modules.get("xarray")
    of_pandas = {} if pandas is None else {name: x for name, x in given.items() if isinstance(x, (pandas.Series, pandas.DataFrame))}
    of_xarray = {} if xarray is None else {name: x for name, x in given.items() if isinstance(x, (xarray.DataArray, xarray.Variable))}
    if of_pandas and of_xarray:
        raise _refused(prefix + next(iter(of_xarray)), prefix + next(iter(of_pandas)), "one is of xarray, the other of pandas")
    if of_pandas:
        found, labels = _of_pandas(of_pandas, prefix)
    elif of_xarray:
        found, labels = _of_xarray(of_xarray, {name: x for name, x in given.items() if name not in of_xarray}, prefix)
    else:
        return dict(given), None
    return {name: found.get(name, x) for name, x in given.items()}, labels


def _reordered(names: tuple[str, str], index: Any, wanted: Any) -> bool:
    """Whether an index has the labels of ``wanted`` in another order; names are those of the arguments."""
    if index.equals(wanted):
        return False
    if not (index.is_unique and wanted.is_unique):
        raise _refused(*names, "they are in another order, and some are there more than once")
    if len(index) != len(wanted) or not index.isin(wanted).all():
        lone = [*index[~index.isin(wanted)], *wanted[~wanted.isin(index)]]
        raise _refused(*names, f"{short(lone[0])} is a label of only one of them" if lone else "they are not as many")
    return True


def _of_pandas(given: dict[str, Any], prefix: str) -> tuple[dict[str, Any], Labels]:
    import pandas

    (first, model), *_ = given.items()
    found = {}
    for name, value in given.items():
        names = prefix + name, prefix + first
        if value.ndim != model.ndim:
            raise _refused(*names, "one is a Series, the other a DataFrame")
        for axis, (index, wanted) in enumerate(zip(value.axes, model.axes)):
            if _reordered(names, index, wanted):
                value = value.reindex(wanted, axis=axis)
        found[name] = value

    def put(values: NDArray[Any]) -> Any:
        return pandas.Series(values, index=model.index) if model.ndim == 1 else pandas.DataFrame(values, index=model.index, columns=model.columns)

    def put_more(values: NDArray[Any], names: list[str]) -> Any:
        columns = pandas.Index(names) if model.ndim == 1 else pandas.MultiIndex.from_product([model.columns, names])
        return pandas.DataFrame(values.reshape(len(model), len(columns)), index=model.index, columns=columns)

    return found, Labels(model.shape, put, put_more)


def _of_xarray(given: dict[str, Any], others: dict[str, Any], prefix: str) -> tuple[dict[str, Any], Labels]:
    import xarray

    arrays = {name: x if isinstance(x, xarray.DataArray) else xarray.DataArray(x) for name, x in given.items()}
    known: dict[Any, tuple[str, Any]] = {}
    for name, array in arrays.items():
        for dim in array.dims:
            index = array.indexes.get(dim)
            if index is None:
                continue
            first, wanted = known.setdefault(dim, (name, index))
            if _reordered((prefix + name, prefix + first), index, wanted):
                arrays[name] = array = array.isel({dim: index.get_indexer(wanted)})
    try:
        whole = dict(zip(arrays, xarray.broadcast(*arrays.values())))
    except ValueError as e:
        raise InputError(f"these arrays do not fit each other: {e}", key=prefix + next(iter(arrays)), value=", ".join(f"{name} {dict(x.sizes)}" for name, x in arrays.items()),
                         allowed="arrays whose dimensions of one name have one size") from None
    model = next(iter(whole.values()))
    same = len({x.dims for x in arrays.values()}) == 1
    for name, value in others.items():
        shape = tuple(getattr(value, "shape", None) or np.shape(value))
        if int(np.prod(shape)) != 1 and not (same and _fits(shape, model.shape)):
            raise InputError("an array without names of its dimensions does not fit beside those that have some", key=prefix + name, value=f"shape {shape}",
                             allowed=f"a number, or a DataArray with dimensions among {', '.join(map(str, model.dims))}")
    # As xarray does: a coordinate that differs between arguments is one of no answer; those that number a dimension are the same here.
    kept: dict[Any, Any] = {}
    differing = set()
    for array in whole.values():
        for label, values in array.coords.items():
            if label not in array.indexes and not kept.setdefault(label, values).variable.equals(values.variable):
                differing.add(label)
    model = model.drop_vars([label for label in differing if label in model.coords])
    model = model.assign_coords({label: values for label, values in kept.items() if label not in differing and label not in model.coords})

    def put(values: NDArray[Any]) -> Any:
        found = model.copy(data=values)
        found.name, found.attrs = None, {}
        return found

    def put_more(values: NDArray[Any], names: list[str]) -> Any:
        if "by" in model.dims or "by" in model.coords:
            raise InputError("the inputs of grad are a dimension `by` of the answer, and the arguments have one", key="grad", value=", ".join(names),
                             allowed="a dimension with another name: array.rename(by=…)")
        each = [put(values[..., k]).assign_coords(by=name) for k, name in enumerate(names)]
        return xarray.concat(each, "by").transpose(..., "by")

    return whole, Labels(model.shape, put, put_more)


def by_name(value: Any) -> Mapping[str, Any] | None:
    """The columns of what has names for the places of its last axis; None of an array that has none."""
    if isinstance(value, Mapping):
        return value
    pandas, xarray = sys.modules.get("pandas"), sys.modules.get("xarray")
    if pandas is not None and isinstance(value, pandas.DataFrame):
        if not value.columns.is_unique:
            raise InputError("a column is there twice", key="reading", value=", ".join(map(str, value.columns)), allowed="columns with names of their own")
        return {str(name): value[name] for name in value.columns}
    if pandas is not None and isinstance(value, pandas.Series) and all(isinstance(name, str) for name in value.index):
        return dict(value)
    if xarray is not None and isinstance(value, xarray.DataArray) and value.ndim:
        last = value.dims[-1]
        places = value.indexes[last] if last in value.indexes else range(value.sizes[last])
        named = [isinstance(name, str) for name in places]
        if any(named):
            return {str(name): value.isel({last: k}, drop=True) for k, name in enumerate(places)}
    kind = getattr(value, "dtype", None)
    if isinstance(kind, np.dtype) and kind.names:
        return {name: value[name] for name in kind.names}
    if hasattr(value, "columns") or hasattr(value, "schema"):
        from ._containers import named_columns

        return dict(named_columns(value, "reading"))
    return None


def _fits(shape: tuple[int, ...], whole: tuple[int, ...]) -> bool:
    """Whether an array of this shape is broadcast to that one."""
    try:
        return np.broadcast_shapes(shape, whole) == whole
    except ValueError:
        return False
