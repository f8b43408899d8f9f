"""Distances without a calibration: which of two is told, what is said of it, and what is refused."""

import numpy as np
import pytest

import vibrissa
from vibrissa import Status

WHISKER, GAUGE = dict(D=10, d=4, L_a=50), dict(x_ss=5, l=2)


def strain(a, theta=4.0, **model):
    return vibrissa.strain(10, 4, 50, 5, 2, a, theta, **model)


def distance(reading, theta=4.0, **more):
    return vibrissa.distance(reading, theta, **{"whisker": WHISKER, "gauge": GAUGE, **more})


def test_a_strain_of_two_distances_is_ambiguous():
    both = distance(strain(8.0))
    assert both.distance_mm == pytest.approx(18.70, abs=0.05) and both.status == Status.ambiguous
    assert strain(both.distance_mm) == pytest.approx(strain(8.0), rel=1e-9)
    # As the other commands: only of a distance of interest.
    assert distance(strain(8.0), estimate=dict(range=(7.9, 48))).status == Status.ambiguous
    assert distance(strain(8.0), estimate=dict(range=(8.1, 48))).status == Status.ok
    assert distance(strain(8.0), estimate=dict(range=(6, 7.9))).status == Status.ok
    displaced = vibrissa.strain(10, 4, 50, 5, 2, 8.0, delta=0.5)
    assert vibrissa.distance(displaced, delta=0.5, whisker=WHISKER, gauge=GAUGE).status == Status.ambiguous


def test_a_strain_of_one_distance_is_not():
    one = distance(strain(5.74))
    assert one.distance_mm == pytest.approx(5.74, rel=1e-6) and one.status == Status.ok
    tip = distance(strain([49.9, 50.0]))
    assert tip.distance_mm == pytest.approx([49.9, 50.0], rel=1e-7)
    # Noise may lead a contact at the tip to where only a near one shows the strain.
    noisy = dict(GAUGE, noise_strain=2e-5)
    assert distance(strain(50.0) - 3e-5, gauge=noisy).status == Status.ambiguous
    assert distance(strain(50.0) - 3e-4, gauge=noisy).status == Status.ok


def test_widening_whiskers_follow_the_same_rule():
    whisker, gauge = dict(D=7, d=14, L_a=50), dict(x_ss=15, l=6)
    a = np.array([17.0, 20.0, 22.0, 30.0, 45.0])
    found = vibrissa.distance(vibrissa.strain(7, 14, 50, 15, 6, a, 0.05), 0.05, whisker=whisker, gauge=gauge)
    assert found.distance_mm == pytest.approx(a, rel=1e-6) and not found.status.any()


def test_without_contact_there_is_no_distance():
    for none in (0.0, -0.0):
        found = distance(none)
        assert np.isnan(found.distance_mm) and np.isnan(found.sigma_mm) and found.status == Status.no_strain
    found = distance([0.0, strain(30.0)], estimate=dict(range=(20, 48)), grad=("strain", "d"))
    assert list(found.status) == [Status.no_strain, Status.ok] and np.isnan(found.jacobian[0]).all() and np.isfinite(found.jacobian[1]).all()


def test_what_is_no_number_is_bad_input():
    found = distance([np.nan, np.inf, 0.02, 0.02], [4.0, 4.0, np.nan, np.inf])
    assert np.isnan(found.distance_mm).all() and (found.status == Status.bad_input).all()
    masked = distance(np.ma.masked_array([0.02, 0.02], [True, False]))
    assert list(masked.status) == [Status.bad_input, Status.ambiguous]


@pytest.mark.parametrize("whisker, gauge", [
    (dict(WHISKER, D=-10), GAUGE), (dict(WHISKER, L_a=np.nan), GAUGE), (WHISKER, dict(x_ss=49, l=2)), (WHISKER, dict(x_ss=-1, l=2)), (WHISKER, dict(x_ss=5, l=0)),
])
def test_what_is_no_whisker_is_said_as_strain_says_it(whisker, gauge):
    found = vibrissa.distance([0.02, 0.01], 4.0, whisker=whisker, gauge=gauge)
    assert np.isnan(found.distance_mm).all() and (found.status == Status.invalid_geometry).all()
    taps = vibrissa.strain(*whisker.values(), *gauge.values(), 30, 4.0, full=True)
    assert taps.status == Status.invalid_geometry


@pytest.mark.parametrize("more, key", [
    (dict(gauge=dict(GAUGE, noise_strain=-2e-5)), "gauge.noise_strain"),
    (dict(gauge=dict(GAUGE, noise_strain=np.nan)), "gauge.noise_strain"),
    (dict(gauge=dict(GAUGE, noise_strain="low")), "gauge.noise_strain"),
    (dict(gauge=dict(GAUGE, noise_strain=20)), "gauge.noise_strain"),
    (dict(gauge=dict(GAUGE, x=3)), "gauge.x"),
    (dict(whisker=dict(WHISKER, E=3)), "whisker.E"),
    (dict(whisker=dict(WHISKER, D=[9, 10])), "whisker.D"),
    (dict(model=dict(materiel=3)), "model.materiel"),
    (dict(model=dict(signal="force")), "model.signal"),
    (dict(model=dict(full=True)), "model.full"),
    (dict(model=dict(grad="a")), "model.grad"),
    (dict(model=dict(progress=True)), "model.progress"),
    (dict(model=dict(D=3)), "model.D"),
    (dict(model=dict(a=3)), "model.a"),
    (dict(estimate=dict(range=(48, 20))), "estimate.range"),
    (dict(estimate=dict(range=3)), "estimate.range"),
    (dict(estimate=dict(K=1.0)), "estimate.K"),
    (dict(signal="force"), "signal"),
    (dict(hub=3), "hub"),
    (dict(grad="colour"), "grad"),
])
def test_a_keyword_that_is_none_is_named(more, key):
    for reading in (0.02, [0.02, 0.01], 0.0):
        with pytest.raises(vibrissa.InputError) as caught:
            distance(reading, **more)
        assert caught.value.key == key and caught.value.allowed, str(caught.value)


def test_a_noise_in_another_unit_is_doubted():
    with pytest.warns(vibrissa.VibrissaWarning, match="noise_strain"):
        distance(0.02, gauge=dict(GAUGE, noise_strain=0.015))


@pytest.mark.parametrize("call", [
    lambda: vibrissa.sweep(wisker=WHISKER), lambda: vibrissa.tap(foo=1), lambda: vibrissa.optimise(foo=1), lambda: vibrissa.pareto(foo=1), lambda: vibrissa.verify(foo={"a": 1}),
    lambda: vibrissa.chart(foo={"a": 1}), lambda: vibrissa.calibrate({}, foo=1), lambda: vibrissa.simulate(foo=1), lambda: vibrissa.contour({}, "c.toml", foo=1),
    lambda: vibrissa.shape(foo=1), lambda: vibrissa.explore(foo=1), lambda: vibrissa.report("r", foo=1), lambda: vibrissa.axis(1, 2, stops=3), lambda: vibrissa.samples(1, 2, 3, sead=1),
    lambda: vibrissa.fit_material({}, lawe="yeoh"), lambda: vibrissa.Locator("c.toml", foo=1), lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, foo=1),
    lambda: vibrissa.distance(0.02, 4.0, gauge=GAUGE),
])
def test_every_function_names_its_unknown_keywords(call):
    with pytest.raises(vibrissa.InputError) as caught:
        call()
    assert caught.value.key and caught.value.allowed, str(caught.value)


def test_jax_names_what_is_no_key_of_a_model():
    pytest.importorskip("jax")
    import vibrissa.jax

    for key, value in (("full", True), ("grad", "a"), ("progress", True), ("foo", 1)):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.jax.strain(10.0, 4.0, 50.0, 5.0, 2.0, 30.0, 4.0, **{key: value})
        assert caught.value.key.endswith(key) and caught.value.allowed


def test_the_tip_of_a_widening_whisker_is_not_ambiguous():
    for a in (30.0, 49.0, 50.0):
        for noise in (None, 1e-5):
            gauge = dict(x_ss=15, l=6) if noise is None else dict(x_ss=15, l=6, noise_strain=noise)
            found = vibrissa.distance(vibrissa.strain(7, 14, 50, 15, 6, a, 4.0), 4.0, whisker=dict(D=7, d=14, L_a=50), gauge=gauge)
            assert found.status.words == "ok" and abs(found.distance_mm - a) < 1e-6
