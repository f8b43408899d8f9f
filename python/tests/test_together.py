"""Readings that are told together: taps of one object, strokes."""

import numpy as np
import pytest

import vibrissa

RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2))


def strain(a, theta):
    return np.asarray(vibrissa.strain(10, 4, 50, 5, 2, a, theta))


@pytest.fixture(scope="module")
def calibration():
    rng = np.random.default_rng(5)
    a, theta = (x.ravel() for x in np.meshgrid([22, 26, 30, 35, 40, 44], [0.5, 1.5, 3.0, 6.0]))
    return vibrissa.calibrate(dict(a_mm=a, theta_deg=theta, strain=strain(a, theta) + 1e-5 * rng.normal(size=a.size)), **RIG)


def readings(rng):
    """Two objects of four taps."""
    a, theta = np.repeat([27.0, 38.0], 4), np.tile([1.0, 2.0, 4.0, 6.0], 2)
    return a, dict(theta_deg=theta, strain=strain(a, theta) + 1e-5 * rng.normal(size=a.size))


def test_taps_of_objects(calibration):
    locator, (a, taps) = vibrissa.Locator(calibration), readings(np.random.default_rng(6))
    alone = locator.table(taps)
    assert "object_distance_mm" not in alone
    word = ["near"] * 4 + ["far"] * 4
    named = [locator.table(dict(taps, object=word)), locator.table(dict(taps, what=word), object="what")]
    for table in named:
        last = [table["object_distance_mm"][k] for k in (3, 7)]
        sigma = [table["object_sigma_mm"][k] for k in (3, 7)]
        assert np.all(abs(np.array(last) - [27, 38]) < 4 * np.array(sigma)) and np.all(np.array(sigma) < 0.2)
        assert sigma[0] < min(alone["sigma_mm"][:4])
    first = {name: column[:4] for name, column in taps.items()}
    same = locator.table(first, same=True)
    assert same["object_distance_mm"][3] == pytest.approx(named[0]["object_distance_mm"][3], abs=1e-9)
    known = vibrissa.Locator(calibration, same_run=True).table(first, same=True)
    assert known["object_sigma_mm"][3] <= same["object_sigma_mm"][3]


def test_interval(calibration):
    locator, (a, taps) = vibrissa.Locator(calibration), readings(np.random.default_rng(9))
    plain, table = locator.table(taps, object=None), locator.table(dict(taps, object=["near"] * 4 + ["far"] * 4), interval=True)
    assert "from_95_mm" not in plain
    for of in ("", "object_"):
        distance, sigma, lo, hi = (np.array(table[of + name]) for name in ("distance_mm", "sigma_mm", "from_95_mm", "to_95_mm"))
        assert np.all(lo < distance) and np.all(distance < hi) and np.all(hi - lo > 3.9 * sigma) and np.all(hi - lo < 5 * sigma)
    assert np.mean((np.array(table["from_95_mm"]) < a) & (a < np.array(table["to_95_mm"]))) > 0.8


def test_strokes(calibration):
    rng, drives = np.random.default_rng(7), np.linspace(0.1, 6.5, 40)
    since = drives - 0.8
    signal = np.where(since > 0, strain(33.0, np.maximum(since, 1e-3)), 0.0) + 1e-5 * rng.normal(size=drives.size)
    table = vibrissa.Locator(calibration).table(dict(theta_deg=drives, strain=signal), strokes=True)
    assert table["from_95_mm"][-1] < 33.0 < table["to_95_mm"][-1]
    assert abs(table["touch"][-1] - 0.8) < 5 * table["touch_sigma"][-1] and table["stroke_status"][-1] == "ok"
    free = vibrissa.Locator(calibration).table(dict(theta_deg=drives, strain=signal + 2e-3), strokes=True, free="zero")
    assert free["from_95_mm"][-1] < 33.0 < free["to_95_mm"][-1] and free["stroke_status"][-1] == "ok"


def test_what_is_refused(calibration):
    locator, (_, taps) = vibrissa.Locator(calibration), readings(np.random.default_rng(8))
    for said, key in ((dict(same=True, strokes=True), "strokes"), (dict(object="no"), "object"), (dict(strokes=2), "strokes"), (dict(object=3), "object"),
                      (dict(strokes=True, free="gain"), "free"), (dict(free="zero"), "free"), (dict(strokes=True, interval=True), "interval")):
        with pytest.raises(vibrissa.InputError) as caught:
            locator.table(taps, **said)
        assert caught.value.key == key and caught.value.allowed, said
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.Locator(calibration, estimator="paper").table(taps, same=True)
    assert caught.value.key == "same" and "learned" in caught.value.allowed
