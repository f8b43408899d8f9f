"""Exceptions name key, value and what is allowed; nothing else comes out."""

import datetime
import pickle

import numpy as np
import pytest

import vibrissa

WHISKER, GAUGE, TAP = dict(D=10, d=4, L_a=50), dict(x_ss=5, l=2), dict(a=[21, 30], theta=[1, 2])


@pytest.mark.parametrize("sections, key, value, allowed", [
    (dict(whisker={**WHISKER, "D": -1}), "whisker.D", "-1", "> 0 mm"),
    (dict(whisker={**WHISKER, "D": np.nan}), "whisker.D", "nan", "> 0 mm"),
    (dict(whisker={**WHISKER, "D": [1, np.inf]}), "whisker.D", "inf", "> 0 mm"),
    (dict(whisker={**WHISKER, "D": "ten"}), "whisker.D", '"ten"', "> 0 mm"),
    (dict(whisker={**WHISKER, "E": 3}), "whisker.E", "3", "D, d, L_a"),
    (dict(tap={**TAP, "theta": 95}), "tap.theta", "95", "0 < theta < 90"),
    (dict(tap={**TAP, "a": []}), "tap.a", "[]", "a list"),
    (dict(model=dict(contact="sticky")), "model.contact", '"sticky"', "frictionless"),
    (dict(model=dict(contact={"coulomb": 0.3})), "model.contact", None, "extension = true"),
    (dict(run=dict(backend="cpu", tolerance=1e-12)), "run.tolerance", "1e-12", "precision"),
    (dict(run=dict(adapter="no such card", backend="gpu")), "run.adapter", "no such card", None),
    (dict(output=dict(by="beauty")), "output.by", '"beauty"', "K_sd"),
    (dict(tap=dict(a=30)), "tap.theta", None, None),
    (dict(whisker={**WHISKER, "D": object()}), "whisker.D", "object", "numbers"),
    (dict(whisker={**WHISKER, "D": np.ones((2, 2))}), "whisker.D", "(2, 2)", "one-dimensional"),
    (dict(whisker=3), "whisker", "3", "dict"),
    (dict(whisker={**WHISKER, "D": 1j}), "whisker.D", "1j", "numbers"),
    (dict(whisker={**WHISKER, "D": np.ma.masked_array([1.0, 2.0], [True, False])}), "whisker.D", None, "mask"),
])
def test_a_bad_key_is_named(sections, key, value, allowed):
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.sweep(**{"whisker": WHISKER, "gauge": GAUGE, "tap": TAP, **sections})
    e = caught.value
    assert isinstance(e, ValueError) and isinstance(e, vibrissa.Error)
    assert e.key == key and key in str(e)
    assert value is None or value in str(e.value)
    assert allowed is None or allowed in e.allowed and allowed in str(e)
    assert e.line is None and "--" not in str(e)


TUPLE = dict(whisker=WHISKER, gauge=GAUGE, tap=TAP)
ENDLESS = [1]
ENDLESS.append(ENDLESS)


@pytest.mark.parametrize("key, call", [
    ("samples", lambda: vibrissa.verify(samples=-1)),
    ("samples", lambda: vibrissa.verify(samples=2.5)),
    ("seed", lambda: vibrissa.verify(seed=2**70)),
    ("bound", lambda: vibrissa.verify(bound="small")),
    ("repeats", lambda: vibrissa.simulate(**TUPLE, repeats=-3)),
    ("repeats", lambda: vibrissa.simulate(**TUPLE, repeats=2**62)),
    ("repeats", lambda: vibrissa.simulate(**TUPLE, repeats=2**30, zero_every=1)),
    ("samples", lambda: vibrissa.verify(samples=2**32 - 1)),
    ("tap.a", lambda: vibrissa.tap(whisker=WHISKER, gauge=GAUGE, tap=dict(a=vibrissa.axis(21, 40, steps=10**9)))),
    ("optimise.robust.samples", lambda: vibrissa.optimise(**TUPLE, optimise=dict(objective="sd", variables=dict(D=[8, 12]), robust=dict(D=0.05, samples=2**31)))),
    ("output.tuples", lambda: vibrissa.sweep(**{**TUPLE, "whisker": {**WHISKER, "D": vibrissa.axis(9, 11, steps=10**12)}})),
    ("repeats", lambda: vibrissa.simulate(**TUPLE, repeats=np.timedelta64(1, "s"))),
    ("noise", lambda: vibrissa.simulate(**TUPLE, noise=np.timedelta64(1, "s"))),
    ("D", lambda: vibrissa.strain(datetime.timedelta(1), 4, 50, 5, 2, 30, 4.0)),
    ("whisker.D", lambda: vibrissa.sweep(whisker={**WHISKER, "D": np.timedelta64(1, "s")}, gauge=GAUGE, tap=TAP)),
    ("whisker.D", lambda: vibrissa.sweep(whisker={**WHISKER, "D": np.array([1, 2], "m8[ns]")}, gauge=GAUGE, tap=TAP)),
    ("whisker.D", lambda: vibrissa.sweep(whisker={**WHISKER, "D": ENDLESS}, gauge=GAUGE, tap=TAP)),
    ("D", lambda: vibrissa.strain(ENDLESS, 4, 50, 5, 2, 30, 4.0)),
    ("model.contact", lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, contact=ENDLESS)),
    ("progress", lambda: vibrissa.sweep(**TUPLE, progress=np.ones(3))),
    ("full", lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, full=np.ones(3))),
    ("quick", lambda: vibrissa.verify(quick=np.ones(2))),
    ("callback", lambda: vibrissa.optimise(**TUPLE, optimise=dict(objective="sd", variables=dict(D=[8, 12])), callback=lambda step: np.ones(3))),
    ("optimise", lambda: vibrissa.pareto(**TUPLE, optimise=3)),
    ("tap", lambda: vibrissa.sweep(tuples={"D_mm": [10]}, tap=3)),
    ("columns", lambda: vibrissa.calibrate({}, columns=["a"])),
    ("fit", lambda: vibrissa.calibrate({}, fit=3)),
    ("data", lambda: vibrissa.calibrate(None)),
    ("seed", lambda: vibrissa.simulate(**TUPLE, seed=None)),
    ("noise", lambda: vibrissa.simulate(**TUPLE, noise="loud")),
    ("drift", lambda: vibrissa.simulate(**TUPLE, drift=10**400)),
    ("signal", lambda: vibrissa.simulate(**TUPLE, signal=3)),
    ("group", lambda: vibrissa.calibrate({}, group=["wide"])),
    ("theta", lambda: vibrissa.calibrate({}, theta=True)),
    ("fit", lambda: vibrissa.calibrate({}, fit=[3])),
    ("zero", lambda: vibrissa.Locator(__file__, zero="none")),
    ("estimator", lambda: vibrissa.Locator(__file__, estimator=3)),
    ("all", lambda: vibrissa.devices(all=True)),
    ("arguments", lambda: vibrissa.devices(3)),
    ("status", lambda: vibrissa.status_words()),
    ("a", lambda: vibrissa.strain(10, 4, 50, 5, 2, theta=4.0)),
    ("a", lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, a=30)),
    ("strain", lambda: vibrissa.distance(theta=4.0, whisker=WHISKER, gauge=GAUGE)),
    ("array", lambda: vibrissa.Array()),
    ("path", lambda: vibrissa.Sweep.load()),
    ("colour", lambda: vibrissa.sweep(**TUPLE).plot(colour=3)),
    ("best", lambda: vibrissa.sweep(**TUPLE).best(best="K_sd")),
    ("path", lambda: vibrissa.sweep(**TUPLE).save()),
])
def test_a_bad_argument_is_named(key, call):
    with pytest.raises(vibrissa.InputError) as caught:
        call()
    assert caught.value.key == key and key in str(caught.value) and caught.value.allowed


def test_a_file_is_named_with_its_line(tmp_path):
    spec = tmp_path / "bad.toml"
    spec.write_text("[whisker]\nD = 10\nd = -4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ntheta = 2\n")
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.sweep(spec)
    assert (caught.value.file, caught.value.line, caught.value.key) == (str(spec), 3, "whisker.d")
    with pytest.raises(vibrissa.InputError, match="no such spec file"):
        vibrissa.sweep(tmp_path / "none.toml")
    with pytest.raises(vibrissa.InputError, match="folder"):
        vibrissa.sweep(tmp_path)
    spec.write_text("[whisker\n")
    for over in ({}, dict(whisker=WHISKER)):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.sweep(spec, **over)
        assert caught.value.line == 1


def test_keywords_go_before_a_file(root):
    result = vibrissa.sweep(root / "sweeps/prototypes.toml", whisker=dict(d=5), tap=dict(theta=[2, 3]), run=dict(backend="cpu"))
    assert set(result.designs["d_tip_mm"]) == {5.0} and set(result.designs["theta_deg"]) == {2.0, 3.0} and len(result.distances) == 10
    force = dict((e["key"], e["value"]) for e in result.run["in_force"])
    assert force["whisker.d"] == "5" and force["run.backend"] == '"cpu"' and not any(key.startswith("run.out") for key in force)


def test_other_errors():
    bad = [
        (lambda: vibrissa.strain(10, 4, 50, 5, 2, 30), "theta"),
        (lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, delta=1.0), "delta"),
        (lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, materiel=3), "model.materiel"),
        (lambda: vibrissa.strain([1, 2], [1, 2, 3], 50, 5, 2, 30, 4.0), "shapes"),
        (lambda: vibrissa.strain("10", 4, 50, 5, 2, 30, 4.0), "D"),
        (lambda: vibrissa.tap(whisker=WHISKER, gauge=GAUGE, tap=dict(a=[30, 40]), objective="beauty"), "objective"),
        (lambda: vibrissa.tap(whisker={**WHISKER, "d": [4, 5]}, gauge={**GAUGE, "noise_strain": 1e-5}, tap=dict(a=[30, 40])), "whisker.d"),
        (lambda: vibrissa.simulate(whisker={**WHISKER, "d": [4, 5]}, gauge=GAUGE, tap=TAP), "whisker.d"),
        (lambda: vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=TAP, outliers=2.0), "outliers"),
        (lambda: vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=TAP, repeats=0), "repeats"),
        (lambda: vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=TAP, signal="volts"), "signal"),
        (lambda: vibrissa.calibrate({"a_mm": [1, 2], "theta_deg": [1], "strain": [1, 2]}), "data"),
        (lambda: vibrissa.calibrate(7), "data"),
        (lambda: vibrissa.calibrate({"a_mm": [21, 30], "strain": [0.1, 0.2]}, theta=4.0, fit=["hub"]), "fit"),
        (lambda: vibrissa.calibrate({"a_mm": [21, 30], "strain": [0.1, 0.2]}, theta=4.0, group=-1), "group"),
        (lambda: vibrissa.Locator("no such file"), "calibration"),
        (lambda: vibrissa.verify(bound=-1), "bound"),
        (lambda: vibrissa.chart(whisker=WHISKER, gauge=GAUGE, tap=TAP, model=dict(geometry="linear")), "model"),
        (lambda: vibrissa.sweep(3.5), "spec"),
        (lambda: vibrissa.sweep(whisker=WHISKER, gauge=GAUGE, tap=TAP, progress=7), "progress"),
        (lambda: vibrissa.sweep(tuples={"D_mm": [1]}), "tuples"),
        (lambda: vibrissa.sweep(whisker=WHISKER, tuples={"D_mm": [1]}), "whisker.D"),
        (lambda: vibrissa.optimise(whisker=WHISKER, gauge=GAUGE, tap=TAP, optimise=dict(objective="sd", variables=dict(D=[12, 8]))), "optimise.variables.D"),
    ]
    for call, key in bad:
        with pytest.raises(vibrissa.InputError) as caught:
            call()
        assert caught.value.key == key, str(caught.value)
        assert "--" not in str(caught.value)


def test_limits_that_no_design_keeps():
    with pytest.raises(vibrissa.InputError, match="limit"):
        vibrissa.optimise(whisker=dict(L_a=50, D=10, d=4), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30]), run=dict(backend="cpu"),
                          optimise=dict(objective="distance", variables=dict(theta=[5, 6]), limits=dict(strain=1e-6)))


def test_exceptions_keep_what_they_carry():
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.strain(10, 4, 50, 5, 2, 30, "x")
    assert "theta" in repr(caught.value) and pickle.dumps(str(caught.value))


def test_readings_and_paths_are_named(tmp_path):
    measured = vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 8]), repeats=3, noise=1e-5)
    calibration = vibrissa.calibrate(measured, whisker=WHISKER, gauge=GAUGE)
    assert calibration.text == vibrissa.calibrate(measured.measurements, whisker=WHISKER, gauge=GAUGE).text
    locator = calibration.locator()
    for call, key in [
        (lambda: locator.stream(None), "readings"),
        (lambda: list(locator.stream([(1, 2, 3)])), "readings"),
        (lambda: list(locator.stream(np.ones((2, 3)))), "readings"),
        (lambda: locator.table(measured, columns=["a"]), "columns"),
        (lambda: locator.table(None), "readings"),
        (lambda: locator.locate(calibration.designs), "reading"),
        (lambda: locator.export(3), "language"),
        (lambda: locator.export("python"), "language"),
        (lambda: vibrissa.Locator(calibration, trust=np.ones(3)), "trust"),
        (lambda: calibration.save(3), "path"),
        (lambda: calibration.save(), "path"),
        (lambda: locator.locate(), "drive"),
        (lambda: locator.locate(4.0, strain=0.02), "strain"),
        (lambda: locator.stream(), "readings"),
        (lambda: locator.expected(30.0), "drive"),
        (lambda: locator.export(lang="c"), "lang"),
        (lambda: locator.export("c", taps=2), "taps"),
    ]:
        with pytest.raises(vibrissa.InputError) as caught:
            call()
        assert caught.value.key == key and caught.value.allowed, str(caught.value)
        assert key != "taps" or "Locator.table" in caught.value.allowed
    with pytest.raises(OSError) as caught:
        calibration.save(tmp_path / "none" / "calibration.toml")
    assert caught.value.filename == str(tmp_path / "none" / "calibration.toml")
    calibration.save(bytes(tmp_path / "calibration.toml"))
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.toml"] and vibrissa.Locator(tmp_path / "calibration.toml").estimator == locator.estimator


def test_what_simulate_gave_is_located():
    measured = vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 8]), repeats=3, noise=1e-6)
    locator = vibrissa.calibrate(measured, whisker=WHISKER, gauge=GAUGE).locator()
    columns = measured.measurements
    found = locator.locate(measured)
    for given in (locator.locate(columns), locator.locate(columns["theta_deg"], columns["strain"])):
        np.testing.assert_array_equal(found.distance_mm, given.distance_mm)
    assert np.abs(found.distance_mm - columns["a_mm"]).max() < 0.5
    np.testing.assert_array_equal(locator.table(measured)["distance_mm"], found.distance_mm)
    rows = np.column_stack([columns["theta_deg"], columns["strain"]])
    assert [one.distance_mm for one in locator.stream(rows)] == found.distance_mm.tolist()


def test_tables_larger_than_memory_are_refused():
    with pytest.raises(vibrissa.RunError, match="GB of memory"):
        vibrissa.sweep(**{**TUPLE, "whisker": {**WHISKER, "D": vibrissa.axis(9, 11, steps=10**11)}}, output=dict(tuples=True), run=dict(backend="cpu"))


def test_a_file_without_lines_is_refused_before_it_fills_the_memory(tmp_path):
    path = tmp_path / "zeros.csv"
    with open(path, "wb") as file:
        file.truncate(5 << 30)
    resource = pytest.importorskip("resource")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for ask in [
        lambda: vibrissa.calibrate(path, whisker=WHISKER, gauge=GAUGE),
        lambda: vibrissa.sweep(path),
        lambda: vibrissa.Locator(path),
    ]:
        with pytest.raises(vibrissa.InputError) as caught:
            ask()
        assert "zeros.csv" in str(caught.value)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert used < 200 << 10, f"{used >> 10} MiB"
