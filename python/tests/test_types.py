"""Types, docstrings and stubs."""

import ast
import doctest
import inspect
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import vibrissa
from vibrissa import _distance, _lab, _native, _pages, _taps, _whisker

COMMANDS = ["calibrate", "chart", "contour", "devices", "distance", "explore", "optimise", "pareto", "plan", "report", "shape", "simulate", "strain", "sweep", "tap", "taps", "verify"]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_says_what_there_is_to_know(name):
    function = getattr(vibrissa, name)
    text = inspect.getdoc(function)
    parameters = [p for p in inspect.signature(function).parameters if p not in ("spec", "sections", "model")]
    missing = [p for p in parameters if p not in text]
    assert not missing, f"help of {name} does not name {missing}"
    if name in ("sweep", "strain", "contour", "explore", "shape", "simulate"):
        for word in ("Args:", "Returns:", "Raises:", "Source:", "mm", "degrees", "InputError"):
            assert word in text, f"{name}: {word}"


def test_everything_public_is_documented():
    for name in vibrissa.__all__:
        thing = getattr(vibrissa, name)
        if name != "__version__":
            assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_examples_in_docstrings():
    for module in (_taps, _distance, _lab, _pages, _whisker):
        failed, tried = doctest.testmod(module)
        assert tried > 0 and not failed


def test_types(tmp_path):
    def errors(*what):
        command = [sys.executable, "-m", "mypy", "--strict", "--config-file", "", "--ignore-missing-imports", *what]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
        assert "checked" in done.stdout or "no issues" in done.stdout, done.stdout + done.stderr
        return [line for line in done.stdout.splitlines() if ": error:" in line]

    use = tmp_path / "use.py"
    use.write_text(
        "import vibrissa\n"
        "tap: vibrissa.Tap = vibrissa.strain(10, 4, 50, 5, 2, [21.0, 30.0], 4.0, full=True)\n"
        "result: vibrissa.Sweep = vibrissa.sweep('spec.toml', run=dict(backend='cpu'))\n"
        "rows: int = len(result.designs) if result.designs is not None else 0\n"
        "one: float = vibrissa.strain(10, 4, 50, 5, 2, 30.0, 4.0)\n"
        "value, slopes = vibrissa.strain(10, 4, 50, 5, 2, [21.0, 30.0], 4.0, grad=('a',))\n"
        "shape: tuple[int, ...] = slopes.shape\n"
        "vibrissa.sweep(whiskers=3)\n"
        "vibrissa.strain(10, 4, 50, 5, 2, 30.0, 4.0, materal={'hooke': 3.2})\n")
    assert not errors("-p", "vibrissa")
    examples = pathlib.Path(__file__).parents[1] / "examples"
    assert not errors("--allow-untyped-defs", "--allow-untyped-calls", *map(str, sorted(examples.glob("*.py"))))
    lines = errors(str(use))
    assert "whiskers" in lines[0] and "materal" in "".join(lines[1:]) and {line.split(":")[1] for line in lines} == {"8", "9"}, lines


def test_stubs_name_what_is_there():
    """What the stubs of the native part declare is what it has, with the same parameters."""
    tree = ast.parse((pathlib.Path(next(iter(vibrissa.__path__))) / "_native.pyi").read_text())
    declared = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert set(declared) == {name for name in vars(_native) if not name.startswith("_")}
    for name, node in declared.items():
        thing = getattr(_native, name)
        if isinstance(node, ast.FunctionDef):
            assert [a.arg for a in node.args.args] == list(inspect.signature(thing).parameters), name
        else:
            members = {m.name for m in node.body if isinstance(m, ast.FunctionDef)} - {"__init__"}
            assert members == {m for m in vars(thing) if not m.startswith("__") or m in members and m != "__new__"}, name
    assert _native.__version__ == vibrissa.__version__


def test_status_words():
    both = vibrissa.Status.slipped_off | vibrissa.Status.ambiguous
    assert both.words == "slipped_off+ambiguous" and vibrissa.Status(0).words == "ok"
    assert vibrissa.status_words(np.array([[0, 144]])).tolist() == [["ok", "slipped_off+ambiguous"]]
