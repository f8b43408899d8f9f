"""Arguments of functions and methods: an unknown keyword, and an argument that is missing, is an InputError like any other."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar, cast

from ._errors import InputError, short

_F = TypeVar("_F", bound=Callable[..., Any])

# Arguments that are gone, by function, and what to use in their place.
GONE = {
    ("export", "taps"): "Locator.table(…, same=True) or object=; the exported program answers one tap",
    ("optimise", "resume"): "the same call without it: a search lasts seconds, and finds the same again",
}


def keywords(function: _F) -> _F:
    """A function, or a class with its public methods and its constructor, that refuses arguments which it does not have, and asks for those that it needs."""
    if isinstance(function, type):
        for name, method in list(vars(function).items()):
            wrapped = isinstance(method, (staticmethod, classmethod))
            if (wrapped or inspect.isfunction(method)) and (name in ("__init__", "__call__") or not name.startswith("_")):
                setattr(function, name, type(method)(keywords(method.__func__)) if wrapped else keywords(method))
        return function
    parameters = inspect.signature(function).parameters.values()
    places = [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD]
    named = [p.name for p in parameters if p.name not in ("self", "cls") and p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    needed = [p.name for p in parameters if p.name in named and p.default is p.empty]
    takes_all = any(p.kind is p.VAR_KEYWORD for p in parameters)
    allowed = ", ".join(named) or "no argument"

    @functools.wraps(function)
    def checked(*args: Any, **given: Any) -> Any:
        try:
            return function(*args, **given)
        except TypeError as e:
            if e.__traceback__ is None or e.__traceback__.tb_next is not None:
                raise  # Raised within the function.
        for name, value in given.items():
            if name not in named and not takes_all:
                instead = GONE.get((function.__name__, name))
                raise InputError("this is gone" if instead else "unknown keyword", key=name, value=short(value), allowed=instead or allowed)
            if name in places[:len(args)]:
                raise InputError("this is given twice", key=name, value=short(value), allowed="one value")
        for name in needed:
            if name not in given and name not in places[:len(args)]:
                raise InputError("this is missing", key=name, allowed=allowed)
        raise InputError("too many arguments without a name", key="arguments", value=len(args), allowed=allowed)

    return cast(_F, checked)
