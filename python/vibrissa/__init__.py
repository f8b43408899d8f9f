"""Vibrissa sweeps, optimises and calibrates tapered soft whisker sensors: which geometry, gauge and tap angle tell distance best.

Arrays in, arrays out::

    import vibrissa
    vibrissa.strain(10, 4, 50, 5, 2, a=[21, 30, 48], theta=4.0)       # D, d, L_a, x_ss, l, a in mm, degrees
    result = vibrissa.sweep("sweeps/prototypes.toml")                 # or whisker=dict(…), gauge=…, tap=…
    result.designs.to_pandas()

Functions have the names of the program's commands, keywords those of a spec's sections; units are mm, degrees, MPa, N, and quantities
with units (pint, astropy) are converted. Tables are (:class:`Table`); errors are :class:`InputError` with ``key``, ``value``, ``allowed``, warnings :class:`VibrissaWarning`. All of it runs without the interpreter's
lock and ends within two seconds of Ctrl-C. Not modelled: dynamics, viscoelasticity, gravity (README).
"""

from __future__ import annotations

import os as _os
from collections.abc import Mapping as _Mapping

# Mesa's device selection complains on stderr where there is no desktop session.
if "XDG_RUNTIME_DIR" not in _os.environ:
    _os.environ.setdefault("NODEVICE_SELECT", "1")

from . import _native, _taps
from ._commands import Step, chart, devices, optimise, pareto, spec_text, sweep, tap, verify
from ._contour import Array, contour
from ._distance import Distance, distance
from ._drivers import ask_apart as _ask_apart
from ._errors import Error, InputError, Interrupted, RunError, VibrissaWarning
from ._lab import calibrate, plan, simulate, taps
from ._locate import Located, Locator, NextTap
from ._material import MaterialFit, fit_material
from ._native import Table, __version__
from ._pages import Page, Report, explore, report
from ._results import BestTap, Calibration, Contour, Plan, Recorded, Search, Shapes, Simulation, Sweep, Verification
from ._shape import shape
from ._spec import axis, samples
from ._taps import Jacobian, Status, Tap, status_words, strain
from ._whisker import Whisker

__all__ = [
    "Array", "BestTap", "Calibration", "Contour", "Distance", "Error", "InputError", "Interrupted", "Jacobian", "Located", "Locator", "MaterialFit", "NextTap", "Page", "Plan", "Recorded", "Report", "RunError", "Search", "Shapes",
    "Simulation", "Status", "Step", "Sweep", "Table", "Tap", "Verification", "VibrissaWarning", "Whisker", "__version__", "axis", "calibrate", "chart", "contour",
    "devices", "distance", "explore", "fit_material", "optimise", "pareto", "plan", "report", "samples", "shape", "simulate", "spec_text", "status_words", "strain", "sweep", "tap", "taps", "verify",
]

_Mapping.register(Table)
_ask_apart()
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=lambda: _native.forked(_taps.forget_solvers()))
