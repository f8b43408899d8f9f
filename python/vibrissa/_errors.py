"""Exceptions: what is wrong, and what would be right."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._results import Search


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
