"""GPU drivers are asked by another process first: one that crashes in its first call would take the interpreter with it."""

from __future__ import annotations

import os
import sys

from . import _native

# Loads the native part alone, without this package and numpy.
_ANSWER = ("import importlib.util as u, sys; s = u.spec_from_file_location('vibrissa._native', sys.argv[1]); "
           "m = u.module_from_spec(s); s.loader.exec_module(m); m.answer(int(sys.argv[2]))")


def ask_apart() -> None:
    """Says how that process is started. A program that embeds Python, or is frozen, cannot be: it asks its drivers itself."""
    name = os.path.basename(sys.executable or "").lower()
    if name.startswith(("python", "pypy")) and not getattr(sys, "frozen", False):
        _native.ask_drivers_by([sys.executable, "-I", "-S", "-c", _ANSWER, _native.__file__])
