"""A whisker that is said once, a plan of its calibration, taps of a raw record, and grids."""

import json

import numpy as np
import pandas as pd
import pytest
from conftest import same_table

import vibrissa

GAUGE = dict(x_ss=5, l=2, noise_strain=2e-5)
RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=GAUGE)
CPU = dict(backend="cpu")


def test_a_whisker_says_once_what_functions_are_told():
    model = dict(surface=True)
    one = vibrissa.Whisker(10, 4, 50, 5, 2, gauge=dict(noise_strain=2e-5), model=model, run=CPU)
    a = np.array([21.0, 30.0, 45.0])
    assert one.strain(a, 4.0).tolist() == vibrissa.strain(10, 4, 50, 5, 2, a, 4.0, surface=True).tolist()
    np.testing.assert_array_equal(one.strain(30, delta=2.0, full=True), vibrissa.strain(10, 4, 50, 5, 2, 30, delta=2.0, full=True, surface=True))
    found, expected = one.distance(one.strain(a, 4.0), 4.0), vibrissa.distance(one.strain(a, 4.0), 4.0, **RIG, model=model)
    assert found.distance_mm.tolist() == expected.distance_mm.tolist() and found.sigma_mm.tolist() == expected.sigma_mm.tolist()
    swept = vibrissa.sweep(**RIG, model=model, run=CPU, tap=dict(a=a, theta=[2, 4]))
    assert one.sweep(a, [2, 4]).tuples.to_arrow().equals(swept.tuples.to_arrow())
    assert one.sweep(a, [2, 4], whisker=dict(d=7)).tuples["d_tip_mm"][0] == 7
    assert one.tap(a).optimum == vibrissa.tap(**RIG, model=model, run=CPU, tap=dict(a=a)).optimum
    best = one.optimise(a, optimise=dict(objective="sd", variables=dict(theta=[1, 8]), budget=dict(evaluations=40)))
    assert 1 <= best.best["theta_deg"] <= 8
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.Whisker(10, 4, x_ss=5, l=2).strain(30, 4.0)
    assert caught.value.key == "L_a"


def test_plan(cli, tmp_path):
    taps = dict(a=[21, 46], theta=[2, 5, 8])
    spec = tmp_path / "rig.toml"
    spec.write_text(vibrissa.spec_text(**RIG, tap=taps))
    cli("plan", spec, "--error", "0.3", "--positions", "4", "--out", tmp_path / "out", "--quiet")
    found = vibrissa.plan(**RIG, tap=taps, error=0.3, positions=4)
    same_table(found.taps, tmp_path / "out" / "plan.csv")
    same_table(found.errors, tmp_path / "out" / "plan_errors.csv")
    assert found.result["taps"] == json.loads((tmp_path / "out" / "run.json").read_text())["result"]["taps"]
    for wrong, key in ((dict(error=-1), "error"), (dict(error=0.3, runs=9), "runs"), (dict(error=0.3, like="no.toml"), "calibration"), ({}, "error")):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.plan(**RIG, tap=taps, **wrong)
        assert caught.value.key == key, wrong


def raw():
    """Three taps that stand still, 0.4 s each, at 100 samples a second."""
    t = np.arange(0, 6, 0.01)
    level = np.zeros_like(t)
    for k, height in enumerate((0.010, 0.014, 0.018)):
        level[(t > 1 + 1.5 * k) & (t < 1.6 + 1.5 * k)] = height
    return pd.DataFrame(dict(t_s=t, strain=level + 2e-5 * np.random.default_rng(1).standard_normal(t.size)))


def test_taps(cli, tmp_path):
    path = tmp_path / "raw.csv"
    raw().to_csv(path, index=False)
    cli("taps", path, "--theta", "4", "--a", "40,30,20", "--out", tmp_path / "out", "--quiet")
    for record, columns in ((raw(), None), (path, None), (dict(raw()), None), (raw().rename(columns=dict(strain="ch3")), dict(strain="ch3"))):
        found = vibrissa.taps(record, theta=4, a=[40, 30, 20], columns=columns)
        same_table(found.taps, tmp_path / "out" / "taps.csv")
    assert found.result["taps"] == 3 and found.measurements is found.taps
    for wrong, key in ((dict(a=[1.0, 2.0]), "a"), (dict(theta=4, delta=1), "delta"), (dict(take="all"), "take"), (dict(theta="x"), "theta")):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.taps(raw(), **wrong)
        assert caught.value.key == key, wrong


def test_a_sweep_of_axes_is_a_grid():
    swept = vibrissa.sweep(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=GAUGE, tap=dict(a=[21, 30, 45], theta=[4, 2]), run=CPU)
    grid = swept.to_xarray()
    assert dict(grid.sizes) == dict(d_tip_mm=2, a_mm=3, theta_deg=2) and float(grid["D_mm"]) == 10 and grid["theta_deg"].attrs["units"] == "degrees"
    at = (swept.tuples["d_tip_mm"] == 7) & (swept.tuples["a_mm"] == 30) & (swept.tuples["theta_deg"] == 2)
    assert float(grid["strain"].sel(d_tip_mm=7, a_mm=30, theta_deg=2)) == swept.tuples["strain"][at][0]
    assert set(swept.to_xarray("designs").sizes) == {"d_tip_mm", "theta_deg"}
    with pytest.raises(vibrissa.InputError, match="no grid"):
        vibrissa.sweep(whisker=dict(D=10, d=vibrissa.samples(3, 8, 5), L_a=vibrissa.samples(40, 60, 5)), gauge=GAUGE, tap=dict(a=30, theta=[2, 4]), run=CPU).to_xarray()
    with pytest.raises(vibrissa.InputError, match="no such table"):
        swept.to_xarray("best")


def test_rows_of_tables_in_memory_are_named_in_errors():
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.fit_material(dict(strain=[0.1, 0.2, 0.3, 0.4, 0.5], stress_MPa=[0.3, 0.5, 0.4, 0.9, 1.0]))
    assert caught.value.key == "stress_MPa" and "row 2" in str(caught.value)
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.calibrate(dict(a_mm=[20.0, "x", 30.0], theta_deg=[2.0, 4.0, 4.0], strain=[0.01, 0.02, 0.03]))
    assert (caught.value.key, caught.value.value, caught.value.line) == ("a_mm", "x", 3)
