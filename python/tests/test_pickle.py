"""Pickles and copies, as multiprocessing and caches make them."""

import copy
import pickle

import numpy as np
import pytest

import vibrissa

WHISKER, GAUGE, CPU = dict(D=10, d=4, L_a=50), dict(x_ss=5, l=2, noise_strain=1e-5), dict(backend="cpu")
WAYS = [lambda x: pickle.loads(pickle.dumps(x)), lambda x: pickle.loads(pickle.dumps(x, protocol=2)), copy.deepcopy, copy.copy]


@pytest.fixture(scope="module")
def swept():
    return vibrissa.sweep(whisker=WHISKER, gauge=GAUGE, tap=dict(a=[3, 30, 45], theta=[1, 20, 60]), run=CPU)


@pytest.fixture(scope="module")
def calibration():
    measured = vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 8]), repeats=3)
    return vibrissa.calibrate(measured, whisker=WHISKER, gauge=GAUGE)


@pytest.mark.parametrize("way", WAYS)
def test_tables(way, swept):
    for table in (swept.tuples, swept.designs, swept.distances):
        again = way(table)
        assert again.columns == table.columns and again.kinds() == table.kinds() and len(again) == len(table)
        # Types, missing values and the order of words, too.
        assert again.to_arrow().equals(table.to_arrow())
    assert None in way(swept.tuples)["contact_state"]
    empty = vibrissa.sweep(whisker=WHISKER, gauge=GAUGE, tap=dict(a=3, theta=60), output=dict(top=1), run=CPU).designs
    assert len(way(empty)) == 0 and way(empty).to_arrow().schema == empty.to_arrow().schema


@pytest.mark.parametrize("way", WAYS)
def test_results(way, swept, calibration):
    again = way(swept)
    assert type(again) is vibrissa.Sweep and again.run == swept.run and repr(again) == repr(swept)
    again = way(calibration)
    assert again.text == calibration.text and again.result == calibration.result
    assert again.rows.to_arrow().equals(calibration.rows.to_arrow())


@pytest.mark.parametrize("way", WAYS)
def test_locators(way, calibration):
    locator = vibrissa.Locator(calibration, estimator="paper", zero=1e-5)
    again = way(locator)
    assert again.estimator == "paper" and again.locate(4.0, 0.02) == locator.locate(4.0, 0.02)
    # After a zero reading, which has no distance.
    readings = [(0.0, 2e-5), (4.0, 0.02)]
    assert list(again.stream(readings))[1:] == list(locator.stream(readings))[1:]


def test_errors():
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.sweep(whisker={**WHISKER, "D": -1}, gauge=GAUGE, tap=dict(a=30, theta=1))
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is vibrissa.InputError and str(again) == str(caught.value)
    assert (again.key, again.value, again.allowed, again.message) == ("whisker.D", "-1", caught.value.allowed, caught.value.message)


def test_columns_of_a_table_are_checked():
    number, count = np.ones(3), np.ones(3, dtype=np.int64)
    whole = vibrissa.Table._of_columns(["x", "n", "w"], [number, count, (np.array([1, 0, -1], np.int32), ["a", "b"])])
    assert whole["w"].tolist() == ["b", "a", None] and whole["n"].dtype == np.int64
    for names, columns in [(["x", "n"], [number, count[:2]]), (["w"], [(np.array([2], np.int32), ["a", "b"])]), (["x", "y"], [number])]:
        with pytest.raises(vibrissa.RunError):
            vibrissa.Table._of_columns(names, columns)
