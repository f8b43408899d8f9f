"""Readings that were not tared, of a calibration whose zero was read: a warning in every way to ask."""

import warnings

import numpy as np
import pytest

import vibrissa

RIG = dict(whisker=dict(D=10, d=10, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5))
OFFSET = 5e-4


@pytest.fixture(scope="module")
def calibration():
    taps = vibrissa.simulate(**RIG, tap=dict(a=[25, 30, 35, 40, 45, 48], theta=[2, 4, 6]), zero_every=4).measurements
    return vibrissa.calibrate({"a_mm": taps["a_mm"], "theta_deg": taps["theta_deg"], "strain": taps["strain"] + OFFSET}, **RIG)


def ways(locator):
    drives, readings = np.array([4.0, 6.0]), np.array([0.0279, 0.0419]) + OFFSET
    rows = list(zip(drives.tolist(), readings.tolist()))
    return {
        "one": lambda: locator.locate(4.0, 0.0284),
        "called": lambda: locator(4.0, 0.0284),
        "array": lambda: locator.locate(drives, readings),
        "stream": lambda: list(locator.stream(rows)),
        "next": lambda: locator.next(rows),
        "table": lambda: locator.table({"theta_deg": drives, "strain": readings}),
    }


@pytest.mark.parametrize("estimator", ["learned", "paper", "exact", "curve"])
def test_untared_readings_are_warned_of_in_every_way_to_ask(calibration, estimator):
    named, zeroed = (vibrissa.Locator(calibration, estimator=estimator, zero=zero) for zero in (None, OFFSET))
    for way in ways(named):
        if way == "next" and estimator != "learned":
            continue
        with pytest.warns(vibrissa.VibrissaWarning, match="every distance is wrong") as told:
            ways(named)[way]()
        assert len(told) == 1 and told[0].filename == __file__, way
        assert "--" not in str(told[0].message), way
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ways(zeroed)[way]()


def test_untared_readings_of_several_channels_are_warned_of():
    rig = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), sensor=dict(signal=["moment", "force"], noise=[0.02, 0.001]))
    taps = vibrissa.simulate(**rig, tap=dict(a=[21, 25, 29, 33, 37, 41, 45], theta=[1, 2, 3, 4, 5]), zero_every=5)
    locator = vibrissa.calibrate(taps, **rig).locator()
    signals = locator.expected(30.0, 3.0, -1.0)
    row = dict(zip(["theta_deg", *locator.channels], ([3.0], *signals[:, None])))
    for ask in (lambda: locator.locate(3.0, signals), lambda: locator.table(row)):
        with pytest.warns(vibrissa.VibrissaWarning, match="every distance is wrong") as told:
            ask()
        assert [w.filename for w in told] == [__file__] * 2 and not any("--" in str(w.message) for w in told)


def test_zero_readings_among_them_are_enough(calibration):
    locator = calibration.locator()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert abs(locator.locate([0.0, 4.0], [OFFSET, 0.0279 + OFFSET]).distance_mm[1] - 30) < 0.1
        assert [bool(np.isnan(at.distance_mm)) for at in locator.stream([(0.0, OFFSET), (4.0, 0.0284)])] == [True, False]
        locator.next([(0.0, OFFSET), (4.0, 0.0284)])
        locator.locate(0.0, OFFSET)
