"""How far work is: a callback, or a bar of tqdm."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

from ._errors import InputError, short

Progress = Union[bool, Callable[[int, int], object], None]


@contextmanager
def shown(progress: Progress, unit: str = "tap") -> Iterator[Callable[[int, int], object] | None]:
    """What is called with (done, total): `progress` itself, or for True a bar, if tqdm is there."""
    if callable(progress):
        yield progress
        return
    if not (progress is None or isinstance(progress, bool)):
        raise InputError("this cannot be called", key="progress", value=short(progress), allowed="True (tqdm), a function of (done, total), or None")
    if not progress:
        yield None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    bar: Any = tqdm(unit=unit, unit_scale=True)

    def update(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)

    try:
        yield update
    finally:
        bar.close()
