"""Pages: one with sliders, and the report of a result folder."""

from __future__ import annotations

import html as html_
import json
import os
from pathlib import Path
from typing import NamedTuple

from ._contour import _path
from ._errors import InputError, short, warn
from ._keywords import keywords
from ._request import asked, of_sections
from ._results import _Result, _whole
from ._spec import Section, Spec, flag, given, number, word


class Page(_Result):
    """Result of :func:`vibrissa.explore`: one HTML file that needs no other file and no network. A notebook shows it.

    Attributes:
        html: the file, as text.
        error: largest error of the signal at whiskers that were not used to make the page, relative.
        run: ``in_force``, ``counts``, ``result``.
    """

    def __init__(self, html: str, run: str) -> None:
        super().__init__(run)
        self.html = html
        self.error: float = self.run["result"]["strain_error"]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes ``html`` to ``path``, whole or not at all."""
        _whole(path, "wb", lambda file: file.write(self.html.encode()))

    def __repr__(self) -> str:
        return f"<Page: {len(self.html) // 1000} kB, right to {self.error:.1e}>"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html_.escape(self.html)}" width="100%" height="720" style="border: 0"></iframe>'


@keywords
def explore(spec: Spec = None, *, whisker: Section | None = None, gauge: Section | None = None, sensor: Section | None = None,
            tap: Section | None = None, model: Section | None = None, estimate: Section | None = None, run: Section | None = None) -> Page:
    """One page with sliders for whisker, gauge and tap, as ``vibrissa explore`` writes it.

    Args:
        spec, whisker, gauge, sensor, tap, model, estimate: as of :func:`sweep`, mm and degrees; ranges become those of the sliders, a single number gets
            a range around it.
        run: ``tolerance``, 1e-7 to 1e-3, relative (1e-5): the error of the signal on the page.

    Returns:
        :class:`Page`: ``html``, ``error``, ``run``; ``save(path)`` writes the file.

    Raises:
        InputError: a model without such a page (linear, ``contact="stick"``, tilt or lean, a second gauge, a foil, a built whisker); ranges over
            which the model is not smooth enough.

    Source: docs/explore.md.

    >>> page = explore(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 45], theta=[1, 8]))
    >>> page.html.startswith("<!doctype html>"), page.error < 1e-5
    (True, True)
    """
    sections = {"whisker": whisker, "gauge": gauge, "sensor": sensor, "tap": tap, "model": model, "estimate": estimate, "run": run}
    found = asked("explore", {}, of_sections(spec, sections, "explore"))
    return Page(found.texts["explore.html"], found.run)


class Report(NamedTuple):
    """What :func:`vibrissa.report` wrote."""

    answer: str
    """What the result says, in a sentence; "" where it says nothing."""
    page: Path
    """The page that holds figures and tables."""
    figures: list[str]
    """Names of the figures."""
    files: list[Path]
    """All files."""


@keywords
def report(folder: str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, figures: str | tuple[str, ...] | list[str] = ("svg", "png", "pdf"),
           width: float = 88.0, font_size: float = 8.0, font: str | os.PathLike[str] | None = None, force: bool = False) -> Report:
    """Figures and one page of a result folder that the program wrote, as ``vibrissa report`` draws them.

    Results of this package are drawn by their ``plot``.

    Args:
        folder: of a result of sweep, optimise, tap, calibrate, locate, contour, bench, verify or shape.
        out: folder of the report; ``folder/report`` by default.
        figures: formats of the figures, of ``"svg"``, ``"png"`` (300 to the inch), ``"pdf"``; ``()`` for the page alone.
        width: of a column of the paper, mm, 40 to 400.
        font_size: of all text, pt, 4 to 24.
        font: path of a TrueType font; DejaVu Sans is built in.
        force: draw a result that was changed since it was written, too; write over another report or beside other files.

    Returns:
        :class:`Report`: ``answer``, ``page``, ``figures``, ``files``.

    Raises:
        InputError: a folder without a result, a result that is damaged or has no figures, a size or format that is not allowed.
        RunError: files that cannot be written.

    Source: docs/report.md.

    >>> report("results/prototypes", figures="svg").answer           # doctest: +SKIP
    """
    formats = [figures] if isinstance(figures, str) else figures
    if not isinstance(formats, (list, tuple)):
        raise InputError("these are no formats", key="figures", value=short(figures), allowed='of "svg", "png", "pdf"')
    said = dict(
        dir=_path("folder", folder), out=given(_path, "out", out), figures=[word("figures", one) for one in formats], width=number("width", width, "mm"),
        font_size=number("font_size", font_size), font=given(_path, "font", font), force=flag("force", force))
    made = json.loads(asked("report", said).run)
    drawn = made["result"]
    warn(drawn["notes"])
    return Report(drawn["answer"], Path(made["out"]) / "report.html", drawn["figures"], [Path(file) for file in made["files"]])
