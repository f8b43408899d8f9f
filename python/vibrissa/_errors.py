"""Exceptions: what is wrong, and what would be right."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._results import Search

_OF_KEYWORDS = re.compile(r"^\S*\.keywords(:\d+)?: ")


_FLAG = re.compile(r"--([a-z]+(?:-[a-z]+)*)")


def as_keywords(text: str) -> str:
    """``text`` with flags of the command line as keywords."""
    return _FLAG.sub(lambda flag: flag[1].replace("-", "_"), text)


def short(value: Any) -> str:
    """``value`` in a message."""
    try:
        text = " ".join(repr(value).encode(errors="replace").decode().split())
    except Exception:  # What a foreign object raises while it is told is no matter of the message.
        text = f"<{type(value).__name__}>"
    return text if len(text) <= 60 else text[:59] + "…"


class VibrissaWarning(UserWarning):
    """What should be known but is no error: a number outside the usual range of its key, data that a calibration does not fit."""


def warn(texts: Iterable[str]) -> None:
    """Warns of ``texts``, at the line outside of this package that led here."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        frame, level = frame.f_back, level + 1
    for text in texts:
        # Keywords have no place in a file.
        warnings.warn(_OF_KEYWORDS.sub("", text), VibrissaWarning, stacklevel=level)


class Error(Exception):
    """Anything that vibrissa raises."""


class InputError(Error, ValueError):
    """An argument, a spec or data that cannot be used.

    Attributes:
        key: argument, dotted key of a spec (``whisker.D``) or column at fault, or None.
        value: the value as written, or None.
        allowed: range or words that would be accepted, with unit, or None.
        file, line: where it stands, if in a file.
        message: what is wrong, in one sentence.
    """

    def __init__(self, message: str, *, key: str | None = None, value: object = None, allowed: str | None = None,
                 file: str | None = None, line: int | None = None) -> None:
        self.message, self.key, self.value, self.allowed = message, key, value, allowed
        self.file, self.line = file, line
        place = "" if file is None else f"{file}: " if line is None else f"{file}:{line}: "
        said = " = ".join(str(x) for x in (key, value) if x is not None)
        super().__init__(place + (f"{said}: " if said else "") + message + (f" (allowed: {allowed})" if allowed else ""))


class RunError(Error, RuntimeError):
    """What was asked is right, but could not be done: a device failed, a search ended before it found anything."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a search; ``result`` holds the best so far."""

    def __init__(self, result: Search) -> None:
        super().__init__("interrupted; `result` of this exception holds the best so far")
        self.result = result
