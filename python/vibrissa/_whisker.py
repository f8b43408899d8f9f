"""A whisker that is said once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import _commands, _distance, _taps
from ._errors import InputError, short
from ._keywords import keywords
from ._results import BestTap, Search, Sweep
from ._spec import Section, section

_FIXED = {"whisker": ("D", "d", "L_a"), "gauge": ("x_ss", "l")}
# What a sweep needs of [gauge] and [estimate], and the strain of a tap does not.
_NOT_OF_TAPS = {"noise_strain", "factor", "range", "convention", "K"}


@keywords
class Whisker:
    """One whisker with its gauge and its model, said once for all that is asked of it.

    Args:
        D, d, L_a: diameter at base and tip, and length, mm.
        x_ss, l: place of the gauge's near end and length of its grid, mm.
        whisker, gauge, sensor, model, estimate, run: more keys of these sections, as of :func:`vibrissa.sweep`.

    >>> one = Whisker(10, 4, 50, 5, 2, gauge=dict(noise_strain=2e-5))
    >>> round(one.strain(30, 4.0), 5)
    0.02233
    >>> one.sweep(a=[21, 30, 45], theta=[2, 4]).best()["theta_deg"]
    2.0
    """

    def __init__(self, D: Any = None, d: Any = None, L_a: Any = None, x_ss: Any = None, l: Any = None, *, whisker: Section | None = None, gauge: Section | None = None,
                 sensor: Section | None = None, model: Section | None = None, estimate: Section | None = None, run: Section | None = None) -> None:
        said = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "model": model, "estimate": estimate, "run": run}
        self.sections: dict[str, dict[str, Any]] = {name: dict(section(name, keys) or {}) for name, keys in said.items()}
        for name, key, value in (("whisker", "D", D), ("whisker", "d", d), ("whisker", "L_a", L_a), ("gauge", "x_ss", x_ss), ("gauge", "l", l)):
            if value is not None:
                self.sections[name][key] = value

    def __repr__(self) -> str:
        said = ", ".join(f"{key}={short(value)}" for keys in self.sections.values() for key, value in keys.items())
        return f"<Whisker {said}>"

    def strain(self, a: Any, theta: Any = None, **more: Any) -> Any:
        """Strain of taps at ``a`` mm by ``theta`` degrees; :func:`vibrissa.strain` with its other keywords (``delta``, ``full``, ``grad``, …)."""
        fixed = {key: self.sections[name].get(key) for name, keys in _FIXED.items() for key in keys}
        for key, value in fixed.items():
            if value is None:
                raise InputError("this is missing", key=key, allowed=_taps.ALLOWED[key])
        model: dict[str, Any] = {key: value for keys in self.sections.values() for key, value in keys.items() if key not in fixed and key not in _NOT_OF_TAPS}
        strain: Any = _taps.strain
        return strain(**fixed, a=a, theta=theta, **{**model, **more})

    def distance(self, strain: Any, theta: Any = None, **more: Any) -> _distance.Distance:
        """Distances at which this whisker shows these strains; :func:`vibrissa.distance` with its other keywords (``delta``, ``grad``)."""
        said = {name: self.sections[name] for name in ("whisker", "gauge", "model")}
        reach = self.sections["estimate"].get("range")
        said["estimate"] = {} if reach is None else {"range": reach}
        return _distance.distance(strain, theta, **{**said, **more})

    def sweep(self, a: Any = None, theta: Any = None, **more: Any) -> Sweep:
        """All taps at ``a`` mm by ``theta`` degrees; :func:`vibrissa.sweep` with its other keywords, whose keys go before those of the whisker."""
        return _commands.sweep(**self._with(a, theta, more))

    def tap(self, a: Any = None, theta: Any = None, **more: Any) -> BestTap:
        """The best tap angle for distances ``a`` mm, of those between the ends of ``theta``; :func:`vibrissa.tap` with its other keywords."""
        return _commands.tap(**self._with(a, theta, more))

    def optimise(self, a: Any = None, theta: Any = None, **more: Any) -> Search:
        """A better design for distances ``a`` mm; :func:`vibrissa.optimise` with its other keywords: ``optimise=dict(variables=dict(d=[3, 10]))``."""
        return _commands.optimise(**self._with(a, theta, more))

    def _with(self, a: Any, theta: Any, more: Mapping[str, Any]) -> dict[str, Any]:
        """The sections of this whisker under what is said beside them."""
        said = dict(more)
        taps = {key: value for key, value in (("a", a), ("theta", theta)) if value is not None}
        said["tap"] = {**taps, **(section("tap", said.get("tap")) or {})}
        return {**said, **{name: {**keys, **(section(name, said.get(name)) or {})} for name, keys in self.sections.items() if keys or name in said}}
