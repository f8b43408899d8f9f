"""Sections of a spec and their keys, for type checkers: a misspelt key fails there, and not only when it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, Union

Real = Any
"""A number, an axis, an array or a quantity with a unit."""
Material = Mapping[str, Union[float, Sequence[float], str]]
Contact = Union[Literal["frictionless", "stick"], Mapping[str, float]]


class Model(TypedDict, total=False):
    """Keys of [model]."""

    geometry: Literal["exact", "linear"]
    shear: bool
    extension: bool
    surface: bool
    pole_radius: Real
    nu: Real
    contact: Contact
    material: Material
    clamp: Real
    indentation: bool
    section: Literal["rigid", "distorting"]
    solid: bool


class TapModel(Model, total=False):
    """Keyword arguments of :func:`vibrissa.strain`."""

    hub: Real
    side: Literal["contact", "far"]
    strain_limit: Real
    second: bool
    foil: Mapping[str, Any]
    theory: Literal["euler-bernoulli", "timoshenko", "exact"]
    exponent: Real
    bore: Real
    core: Mapping[str, Any]
    curvature: Real
    curvature_slope: Real
    root: Mapping[str, Any]
    signal: Literal["strain", "moment", "force"]
    backend: Literal["auto", "gpu", "cpu", "reference"]
    adapter: str
    precision: Literal["f32", "f64"]
    tolerance: float
    threads: int
