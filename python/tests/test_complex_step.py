"""Derivatives against a code of its own, by complex steps (benches/gradients): some taps of some models. All of it: benches/gradients/compare.py."""

import sys

import pytest

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def compare(root):
    folder = root / "benches/gradients"
    if not folder.exists():
        pytest.skip("benches are not here")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VIBRISSA_UNCOMPILED", "1")
        patch.syspath_prepend(str(folder))
        import compare

        yield compare
    for name in ("compare", "models", "rod", "taps"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", ["linear-tilted", "surface", "coulomb", "pole-far-tilted", "root", "solid-passive", "foil"])
def test_derivatives_are_those_of_the_complex_step(name, compare):
    row, _ = compare.of_model(name, 60, only=(5, 40, 59))
    assert row["taps"] == 3 and row["told"] > 0.9 and row["missing"] == 0
    assert row["worst"] < compare.BOUND, row
