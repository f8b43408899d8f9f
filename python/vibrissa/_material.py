"""The law of a rubber from a measured stress–strain curve."""

from __future__ import annotations

from typing import Any, NamedTuple

from . import _native
from ._errors import InputError, short
from ._frames import measured
from ._keywords import keywords


class MaterialFit(NamedTuple):
    """A fitted law."""

    material: dict[str, list[float]]
    """The law as ``model["material"]`` takes it: ``{"yeoh": [C10, C20, C30]}``, MPa."""
    rms_MPa: float
    """Root mean square of law − data, MPa."""
    strains: tuple[float, float]
    """Smallest and largest measured strain: the law is a guess beyond."""
    points: int
    """Points of different strain."""


@keywords
def fit_material(data: Any, law: str = "yeoh") -> MaterialFit:
    """Fits a hyperelastic law to a measured uniaxial stress–strain curve, as ``material = { curve = … }`` of a spec does.

    Args:
        data: DataFrame, dict of columns, structured array, or path of a CSV file, with ``strain`` (nominal, no unit) and ``stress_MPa`` (nominal); five
            strains at least.
        law: ``"yeoh"``.

    Returns:
        :class:`MaterialFit`.

    Raises:
        InputError: data that no law can come from: too few strains, a stress that falls, another law.

    Source: docs/model.md §3; linear least squares.

    >>> curve = dict(strain=[0.1, 0.2, 0.4, 0.6, 0.8], stress_MPa=[0.26, 0.46, 0.77, 1.02, 1.24])
    >>> [round(c, 3) for c in fit_material(curve).material["yeoh"]]
    [0.452, -0.036, 0.004]
    """
    if law != "yeoh":
        raise InputError("there is no fit of this law", key="law", value=short(law), allowed='"yeoh"')
    coefficients, rms, strains, points = _native.fit_material(measured(data, "data").rows)
    return MaterialFit({"yeoh": list(coefficients)}, rms, strains, points)
