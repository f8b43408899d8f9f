"""The shape of tapped whiskers, with the sections of a spec as keywords."""

from __future__ import annotations

from typing import Any

from ._commands import _name
from ._keywords import keywords
from ._progress import Progress, shown
from ._request import asked
from ._results import Shapes
from ._spec import Section, Spec, whole
from ._tuples import listed

# As `shape --nodes`.
_NODES = (3, 10_001)


@keywords
def shape(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
          tap: Section | None = None,
          model: Section | None = None, estimate: Section | None = None, output: Section | None = None, run: Section | None = None,
          tuples: Any = None, name: str | None = None, nodes: int = 101, progress: Progress = None) -> Shapes:
    """The bent whisker of each tap, section by section: where it lies, which way it points, how strained its touching side is.

    Args:
        spec, whisker, gauge, sensor, tap, model, estimate, output, run, tuples, name, progress: as of :func:`sweep`; 10 000 taps at most, of an exact
            model. Solved by the reference unless ``run`` names a ``backend``, a ``precision`` or an ``adapter``.
        nodes: sections from clamp to contact, 3 to 10 001; two more from there to the tip.

    Returns:
        :class:`Shapes`: tables ``shape`` and ``contacts``, ``run``; mm, degrees, N. A tap without a shape has no sections; its
        ``status`` in ``contacts`` says why.

    Raises:
        InputError: linear theory, which has no shape; too many taps, or sections for which there is no memory.

    Source: docs/model.md §3, §6.
    """
    sections: dict[str, Section | None] = {
        "whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "output": output, "run": run}
    least, most = _NODES
    said = {"nodes": whole("nodes", nodes, most, least)}
    path, text, taps, told = listed(spec, tuples, sections)
    with shown(progress) as tell:
        found = asked("shape", said, (path, text, _name(spec, name, "shape")), taps=taps, hear=tell, told=told)
    return Shapes(found.tables, found.run)
