"""Requests: what is said of a command beside its spec, as the library reads it, and what comes back."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from . import _native
from ._errors import as_keywords, warn
from ._native import Table
from ._spec import Section, Spec, _whole_text, resolve


class Answer(NamedTuple):
    """What a command gave."""

    tables: list[tuple[str, Table]]
    """Its tables by name."""
    texts: dict[str, str]
    """Its other files."""
    run: str
    """run.json."""
    interrupt: Any
    """The exception that ended it although it gives something, or None."""


def asked(command: str, said: Mapping[str, Any], spec: tuple[str | None, str, str] | None = None, files: Sequence[tuple[str, Any]] = (), *,
          taps: Any = None, hear: Callable[..., object] | None = None, told: Sequence[str] = (), partial: bool = False) -> Answer:
    """Runs ``command``; ``said`` are its keywords but for those of ``spec``: path, text over it, and name. None says nothing.

    ``files`` are in memory, text or names and columns, by the names under which ``said`` names them; ``taps`` stand in place of those of the spec; ``told`` is warned of, too. With ``partial`` an interrupt that leaves a result
    is given beside it, else raised.
    """
    request = "".join(f"{key} = {_whole_text(key, value)}\n" for key, value in said.items() if value is not None)
    tables, texts, run, warnings, interrupt = _native.run(command, request, spec, list(files), taps, hear)
    if interrupt is not None and not partial:
        raise interrupt
    if interrupt is None:
        # What the record says and what was told are often the same.
        warn(dict.fromkeys([*told, *map(as_keywords, json.loads(run).get("warnings") or ()), *warnings]))
    return Answer(tables, dict(texts), run, interrupt)


def of_sections(spec: Spec, sections: Mapping[str, Section | None], name: str) -> tuple[str | None, str, str]:
    """A spec with sections over it, for :func:`asked`."""
    return *resolve(spec, sections), name
