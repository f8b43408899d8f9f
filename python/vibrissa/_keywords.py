"""Keywords of functions: an unknown one, and one that is missing, is an InputError like any other."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar, cast

from ._errors import InputError, short

_F = TypeVar("_F", bound=Callable[..., Any])


def keywords(function: _F) -> _F:
    """``function``, which refuses keywords that it does not have."""
    parameters = inspect.signature(function).parameters.values()
    named = [p.name for p in parameters if p.name != "self" and p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    needed = [p.name for p in parameters if p.kind is p.KEYWORD_ONLY and p.default is p.empty]
    allowed = ", ".join(named)

    @functools.wraps(function)
    def checked(*args: Any, **given: Any) -> Any:
        for name, value in given.items():
            if name not in named:
                raise InputError("unknown keyword", key=name, value=short(value), allowed=allowed)
        for name in needed:
            if name not in given:
                raise InputError("this is missing", key=name, allowed=allowed)
        return function(*args, **given)

    return cast(_F, checked)
