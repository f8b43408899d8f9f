"""Arguments of every kind: a right answer or an exception that names them; no panic, no leak."""

import gc
import os
import resource

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import vibrissa

MANY = int(os.environ.get("VIBRISSA_EXAMPLES", "150"))
QUICK = settings(max_examples=MANY, deadline=None, suppress_health_check=list(HealthCheck))

ODD = st.sampled_from([
    np.nan, np.inf, -np.inf, 0, -0.0, -1, 1e-308, 1e308, 1e12, 10**400, True, None, "3", "", b"4", 2 + 1j, [], [[]], [1, [2]], {}, {"D": 1}, {1, 2}, object(), type, range(3), range(0),
    np.float32(3), np.int8(3), np.bool_(True), np.array(3.0), np.array([]), np.array([3.0]), np.array(["a"]), np.array([None, 1.0]), np.array([1.0, 2.0], dtype=object),
    np.array(["2026-01-01"], dtype="M8[D]"), np.array([1 + 1j]), np.array([True]), np.arange(3)[::-1], np.arange(12.0).reshape(3, 4)[:, ::2], np.array([1, 2], dtype=">i4"),
    np.array([1.5, 2.5], dtype=np.float16), np.array([1.5, 2.5], dtype=np.longdouble), np.ma.masked_array([1.0, 2.0], [True, False]), np.array([(1, 2.0)], dtype=[("x", int), ("y", float)]),
    np.array([2**63], dtype=np.uint64), np.frombuffer(b"\0" * 16), memoryview(b"abc"), iter([1]), lambda: 3, "\0", "\ud800", "θ", float("-0"), np.datetime64("NaT"),
])
ARRAYS = hnp.arrays(
    dtype=st.one_of(hnp.floating_dtypes(endianness="?"), hnp.integer_dtypes(endianness="?"), hnp.unsigned_integer_dtypes()),
    shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4))
ANY = st.one_of(ODD, ARRAYS, st.floats(), st.integers(), st.floats(1, 100), st.lists(st.floats(1, 60), max_size=4))
GOOD = [10.0, 4.0, 50.0, 5.0, 2.0, 30.0, 4.0]


def expected(values):
    """The strain of each tap, asked one by one."""
    arrays = np.broadcast_arrays(*[np.asarray(v, dtype=float) for v in values])
    answers = [vibrissa.strain(*map(float, tap)) for tap in zip(*(a.ravel() for a in arrays))]
    return np.array(answers, dtype=float).reshape(arrays[0].shape)


@QUICK
@given(st.lists(st.tuples(st.integers(0, 6), ANY), max_size=4), st.booleans())
def test_strain(changes, full):
    values = list(GOOD)
    for place, value in changes:
        values[place] = value
    before = [v.copy() if isinstance(v, np.ndarray) else v for v in values]
    try:
        found = vibrissa.strain(*values, full=full)
    except vibrissa.InputError as e:
        assert e.key in {"D", "d", "L_a", "x_ss", "l", "a", "theta", "shapes", "arguments"}
        return
    for old, new in zip(before, values):
        if isinstance(old, np.ndarray) and old.dtype.kind in "fiu":
            np.testing.assert_array_equal(old, new)
    strain = found.strain if full else found
    if any(isinstance(v, np.ma.MaskedArray) for v in values):
        return
    np.testing.assert_array_equal(strain, expected(values))
    if full:
        # A number, or a word that says why not.
        assert ((np.asarray(found.status) != 0) | np.isfinite(strain)).all()
        assert np.shape(found.status) == np.shape(strain) == np.shape(found.sticks)


@QUICK
@given(st.data())
def test_layouts_of_memory(data):
    base = data.draw(hnp.arrays(float, (4, 6), elements=st.floats(9, 11)))
    view = data.draw(st.sampled_from([base, base.T, base[::-1], base[:, ::-2], base[1:3, 1:4], np.asfortranarray(base), base.astype(">f8"), np.broadcast_to(base[0], (5, 6)), base[:0]]))
    view = view.view()
    view.flags.writeable = False
    np.testing.assert_array_equal(vibrissa.strain(view, *GOOD[1:]), expected([view, *GOOD[1:]]))


@QUICK
@given(st.sampled_from(["whisker", "gauge", "tap", "model", "estimate", "output", "run"]), st.sampled_from(
    ["D", "d", "L_a", "hub", "x_ss", "l", "noise_strain", "side", "a", "theta", "drive", "geometry", "material", "contact", "nu", "theory", "K", "range", "top", "by", "per", "tolerance",
     "precision", "threads", "tuples", "nonsense", "", "a b", "ä", 'q"', "\n"]), st.one_of(ANY, st.dictionaries(st.text(max_size=6), ANY, max_size=3)))
def test_sections(section, key, value):
    sections = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[30, 40], theta=[2, 4]), run=dict(backend="cpu"))
    sections[section] = {**sections.get(section, {}), key: value}
    if section == "run" and key == "threads" and isinstance(value, (int, float)) and value > 8:
        return
    try:
        result = vibrissa.sweep(**sections)
    except vibrissa.Error as e:
        assert str(e) and "should not have happened" not in str(e)
        return
    assert len(result.tuples) == result.run["counts"]["taps"]


@QUICK
@given(ANY, ANY)
def test_readings(drive, reading):
    try:
        found = LOCATOR.locate(drive, reading)
    except vibrissa.InputError:
        return
    assert np.shape(found.distance_mm) == np.shape(found.status)
    assert (np.isfinite(found.distance_mm) | (np.asarray(found.status) != 0)).all()


@settings(QUICK, max_examples=max(20, MANY // 3))
@given(st.dictionaries(st.sampled_from(["a_mm", "theta_deg", "strain", "reading", "other", ""]), st.one_of(ODD, hnp.arrays(float, 6), st.lists(st.floats(), min_size=6, max_size=6)), max_size=5))
def test_data(columns):
    try:
        vibrissa.calibrate(columns)
    except (vibrissa.Error, ValueError) as e:
        assert str(e) and "should not have happened" not in str(e)


@QUICK
@given(st.one_of(ODD, st.text(max_size=20), st.binary(max_size=20)))
def test_specs_and_paths(spec):
    for call in (vibrissa.sweep, vibrissa.tap, vibrissa.optimise, vibrissa.chart, vibrissa.simulate, vibrissa.Locator):
        try:
            call(spec)
        except vibrissa.InputError as e:
            assert str(e)


def _locator():
    measured = vibrissa.simulate(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 8]), repeats=3)
    return vibrissa.calibrate(measured.measurements, whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5)).locator()


LOCATOR = _locator()


@pytest.mark.parametrize("calls", [int(os.environ.get("VIBRISSA_CALLS", "25000"))])
def test_no_leak(calls):
    """Memory after 1e5 calls (four a round) is that after a tenth of them."""
    arrays = [np.linspace(9, 11, 7)] * 2

    def some(n):
        for k in range(n):
            vibrissa.strain(*GOOD)
            vibrissa.strain(arrays[k % 2], *GOOD[1:], full=True)
            LOCATOR.locate(4.0, 0.02)
            try:
                vibrissa.strain(arrays[0], np.ones(3), *GOOD[2:])
            except vibrissa.InputError:
                pass
            if k % 100 == 0:
                vibrissa.strain(*GOOD, nu=0.3 + 1e-6 * (k % 200))
                table = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[30, 40], theta=[2, 4]), run=dict(backend="cpu")).tuples
                table.to_pandas()
                table.__arrow_c_stream__()
        gc.collect()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    some(calls // 10)
    before = some(calls // 10)
    assert some(calls) - before < 8 * 1024, "kB grew"
