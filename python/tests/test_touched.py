"""Contours, arrays of whiskers and shapes against the tables that the program writes: every number to the last bit, every word."""

import json
import pickle
import shutil
import threading

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import same_table

import vibrissa

RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), model=dict(surface=True, material={"neo-hookean": 3.2}))
CIRCLE = '[object]\nshape = "circle"\nx = 0\ny = 0\nradius = 10\n[around]\nstarts = 6\ndistance = 36\n'
OFTEN = dict(a=range(18, 46, 3), theta=[0.5, *range(1, 11)])


@pytest.fixture(scope="module")
def desk(tmp_path_factory, cli):
    """A calibration, strokes round a circle, and an array of two whiskers."""
    desk = tmp_path_factory.mktemp("desk")
    calibration = vibrissa.calibrate(vibrissa.simulate(**RIG, tap=OFTEN, repeats=3), **RIG)
    calibration.save(desk / "cal.toml")
    (desk / "object.toml").write_text(CIRCLE)
    (desk / "sweep.toml").write_text(vibrissa.spec_text(**RIG, tap=dict(a=30, theta=vibrissa.axis(0.5, 10, step=0.5))))
    cli("simulate", desk / "sweep.toml", "--object", desk / "object.toml", "--seed", 7, "--zero-every", 7, "--out", desk / "st", "--quiet")
    shutil.copy(desk / "st" / "strokes.csv", desk / "strokes.csv")
    (desk / "array.toml").write_text(
        'base_noise = 0.05\n[[whisker]]\nname = "left"\ncalibration = "cal.toml"\nx = 0\ny = 40\nz = 12\nheading = 7.3\nsense = -1\n'
        '[[whisker]]\nname = "right"\ncalibration = "cal.toml"\nx = 0\ny = -40\nheading = 0\n')
    (desk / "readings.csv").write_text(
        "whisker,theta_deg,strain,contact_deg,note\nleft,0,0.001,0,a\nright,0,0.002,0,b\nleft,4,0.021,0,\nright,4,0.022,0,c\nright,4,0.022,90,d\nright,4,9,0,e\n")
    return desk, calibration


OPTIONS = [
    dict(truth=True), dict(taps=True, contact="centreline", angle_noise=0.3, base_noise=0.2, touch_noise=0.1), dict(estimator="learned", curve="smooth"),
    dict(estimator="paper", taps=True, curve="line", columns=dict(theta="theta_deg", strain="strain"), threads=2)]


@pytest.mark.parametrize("options", OPTIONS, ids=["truth", "noise", "smooth", "line"])
def test_contour(options, desk, cli, tmp_path):
    desk, calibration = desk
    told = dict(options)
    if "truth" in told:
        told["truth"] = desk / "object.toml"
    flags = []
    for key, value in told.items():
        said = ",".join(f"{role}={name}" for role, name in value.items()) if isinstance(value, dict) else value
        flags += [f"--{key.replace('_', '-')}", *([] if value is True else [said])]
    data = desk / "strokes.csv"
    cli("contour", data, "--calibration", desk / "cal.toml", "--out", tmp_path / "out", "--quiet", *flags)
    written = json.loads((tmp_path / "out" / "run.json").read_text())
    result = vibrissa.contour(data, desk / "cal.toml", **told)
    same_table(result.points, tmp_path / "out" / "points.csv")
    same_table(result.curve, tmp_path / "out" / "curve.csv")
    assert len(result.points) > 100 and len(result.curve) > 1
    for key in ("format", "command", "version", "spec", "settings", "counts", "result", "data", "calibration"):
        assert result.run[key] == written[key], key
    assert result.kind == written["result"]["curve"]["kind"] and result.result["curve"]["judged"]
    assert (result.outline is not None) == ("truth" in told)
    for frame in (pd.read_csv(data), pl.read_csv(data), dict(pd.read_csv(data))):
        found = vibrissa.contour(frame, calibration, **told)
        for column in ("x_mm", "y_mm", "sigma_major_mm", "sigma_minor_mm", "axis_deg", "off_mm"):
            np.testing.assert_array_equal(found.points[column], result.points[column])
        np.testing.assert_array_equal(found.curve["x_mm"], result.curve["x_mm"])
    again = pickle.loads(pickle.dumps(result))
    assert again.run == result.run and again.points.to_arrow().equals(result.points.to_arrow())


def test_zero_of_a_contour(desk, cli, tmp_path):
    """Readings that are off by as much have the points of those that are not; where rows say the zero, it is not said twice."""
    desk, _ = desk
    strokes = pd.read_csv(desk / "strokes.csv")
    strokes = strokes[strokes.theta_deg > 0]
    strokes["strain"] += 2e-4
    strokes.to_csv(tmp_path / "off.csv", index=False)
    cli("contour", tmp_path / "off.csv", "--calibration", desk / "cal.toml", "--zero", 2e-4, "--out", tmp_path / "out", "--quiet")
    result = vibrissa.contour(tmp_path / "off.csv", desk / "cal.toml", zero=2e-4)
    same_table(result.points, tmp_path / "out" / "points.csv")
    np.testing.assert_array_equal(result.points["x_mm"], vibrissa.contour(strokes, desk / "cal.toml", zero=[2e-4]).points["x_mm"])
    assert set(result.points["zero"]) == {2e-4} and result.run["settings"]["zero"] == 2e-4
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.contour(desk / "strokes.csv", desk / "cal.toml", zero=2e-4)
    assert caught.value.key == "zero" and "--" not in str(caught.value)


def whiskers(desk, calibration):
    return [dict(name="left", calibration=calibration, x=0, y=40.0, z=12, heading=7.3, sense=-1),
            dict(name="right", calibration=desk / "cal.toml", x=0, y=-40, heading=0)]


def test_array(desk, cli, tmp_path):
    desk, calibration = desk
    cli("locate", "--array", desk / "array.toml", desk / "readings.csv", "--out", tmp_path / "out", "--quiet")
    of_file = vibrissa.Array(desk / "array.toml")
    of_dicts = vibrissa.Array(whiskers(desk, calibration), base_noise=0.05)
    for array in (of_file, of_dicts, pickle.loads(pickle.dumps(of_dicts)), pickle.loads(pickle.dumps(of_file))):
        same_table(array.locate(desk / "readings.csv"), tmp_path / "out" / "located.csv")
        assert array.names == ["left", "right"] and set(array.estimators) == {"left", "right"}
    found = of_dicts.locate(pd.read_csv(desk / "readings.csv"))
    np.testing.assert_array_equal(found["x_mm"], of_file.locate(desk / "readings.csv")["x_mm"])
    assert np.isfinite(found["x_mm"]).sum() == 3 and found["status"][-1] != "ok"
    cli("locate", "--array", desk / "array.toml", desk / "readings.csv", "--estimator", "paper", "--out", tmp_path / "paper", "--quiet")
    same_table(vibrissa.Array(desk / "array.toml", estimator="paper").locate(desk / "readings.csv"), tmp_path / "paper" / "located.csv")
    wide = vibrissa.Array(desk / "array.toml", angle_noise=2.0, base_noise=0).locate(desk / "readings.csv")
    assert wide["sigma_y_mm"][2] > 5 * found["sigma_y_mm"][2] and wide["sigma_z_mm"][2] == 0


SHAPES = [
    dict(tap=dict(a=[21, 33, 45], theta=[2, 10])),
    dict(tap=dict(a=[21, 33], tilt=[-20, 30], lean=10, theta=[1, 10]), gauge=dict(x_ss=5, l=2, second=True), nodes=11),
    dict(tap=dict(a=30, drive="displacement", delta=[1, 4]), model=dict(pole_radius=3, surface=True), run=dict(backend="cpu", precision="f64"), nodes=3),
    dict(tap=dict(a=[3, 30], theta=[60, 80]), run=dict(threads=2))]


@pytest.mark.parametrize("sections", SHAPES, ids=["plain", "tilted", "kernel", "without"])
def test_shape(sections, cli, tmp_path):
    sections = {**RIG, **sections}
    nodes = sections.pop("nodes", 101)
    spec = tmp_path / "bent.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli("shape", spec, "--out", tmp_path / "out", "--quiet", "--nodes", nodes)
    written = json.loads((tmp_path / "out" / "run.json").read_text())
    seen = []
    for result in (vibrissa.shape(spec, nodes=nodes, progress=lambda *at: seen.append(at)), vibrissa.shape(**sections, nodes=nodes)):
        same_table(result.shape, tmp_path / "out" / "shape.csv")
        same_table(result.contacts, tmp_path / "out" / "contacts.csv")
        for key in ("counts", "solved_by", "warnings", "material_fit"):
            assert result.run[key] == written[key], key
    assert len(result.contacts) > 1 and seen[-1] == (len(result.contacts), len(result.contacts))
    assert result.run["counts"]["shapes"] == len(np.unique(result.shape["tap"]))


def test_shapes_of_listed_taps():
    taps = pd.DataFrame(dict(D_mm=10.0, d_mm=[4.0, 7.0], L_a_mm=50.0, x_ss_mm=5.0, l_mm=2.0, a_mm=[30.0, 41.0], theta_deg=[4.0, 9.0]))
    listed = vibrissa.shape(tuples=taps, nodes=5)
    for k, row in enumerate(taps.itertuples()):
        one = vibrissa.shape(whisker=dict(D=10, d=row.d_mm, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=row.a_mm, theta=row.theta_deg), nodes=5)
        for column in ("s_mm", "x_mm", "y_mm", "strain"):
            np.testing.assert_array_equal(listed.shape[column][listed.shape["tap"] == k], one.shape[column])


def test_what_cannot_be_is_named(desk, tmp_path):
    desk, calibration = desk
    data, good = pd.read_csv(desk / "strokes.csv"), whiskers(desk, calibration)
    trace = lambda **said: vibrissa.contour(data, calibration, **said)
    changed = lambda **said: vibrissa.Array([good[0], {**good[1], **said}])
    for call, key in [
        (lambda: trace(curve="square"), "curve"),
        (lambda: trace(curve=3), "curve"),
        (lambda: trace(contact="tip"), "contact"),
        (lambda: trace(angle_noise=-1), "angle_noise"),
        (lambda: trace(base_noise=np.nan), "base_noise"),
        (lambda: trace(touch_noise="some"), "touch_noise"),
        (lambda: trace(taps="all"), "taps"),
        (lambda: trace(truth=3), "truth"),
        (lambda: trace(truth="no such file"), "truth"),
        (lambda: trace(zero=[1, 2, 3]), "zero"),
        (lambda: trace(zero=[1e-5, 2e-5]), "zero"),
        (lambda: trace(zero=np.inf), "zero"),
        (lambda: trace(columns="theta"), "columns"),
        (lambda: trace(estimator="best"), "estimator"),
        (lambda: trace(threads=0), "threads"),
        (lambda: vibrissa.contour(data, 3), "calibration"),
        (lambda: vibrissa.contour(data, desk / "none.toml"), "calibration"),
        (lambda: vibrissa.contour(3, calibration), "data"),
        (lambda: vibrissa.contour(data.drop(columns="heading_deg"), calibration), "heading_deg"),
        (lambda: vibrissa.contour(data.assign(sense=2.0), calibration), "sense"),
        (lambda: vibrissa.contour(data.assign(base_x_mm="here"), calibration), "base_x_mm"),
        (lambda: vibrissa.Array(3), "array"),
        (lambda: vibrissa.Array(good[0]), "array"),
        (lambda: vibrissa.Array(desk / "none.toml"), "array"),
        (lambda: vibrissa.Array([]), "whisker"),
        (lambda: vibrissa.Array([3]), "whisker"),
        (lambda: vibrissa.Array(good, angle_noise=-1), "angle_noise"),
        (lambda: vibrissa.Array(good, zero="none"), "zero"),
        (lambda: changed(name="left"), "whisker.name"),
        (lambda: changed(sense=2), "whisker.sense"),
        (lambda: changed(heading=np.inf), "whisker.heading"),
        (lambda: changed(x=None), "whisker.x"),
        (lambda: changed(hedding=3), "whisker.hedding"),
        (lambda: changed(calibration="none.toml"), "whisker.calibration"),
        (lambda: vibrissa.Array(good).locate(3), "data"),
        (lambda: vibrissa.Array(good).locate({"theta_deg": [4.0], "strain": [0.02]}), "whisker"),
        (lambda: vibrissa.Array(good).locate({"whisker": ["up"], "theta_deg": [4.0], "strain": [0.02]}), "whisker"),
        (lambda: vibrissa.shape(**RIG, tap=dict(a=30, theta=4), nodes=2), "nodes"),
        (lambda: vibrissa.shape(**{**RIG, "model": dict(geometry="linear")}, tap=dict(a=30, theta=4)), "model.geometry"),
        (lambda: vibrissa.shape(**RIG, tap=dict(a=vibrissa.axis(21, 40, steps=10**5), theta=4)), "tuples"),
        (lambda: vibrissa.shape(**RIG, tap=dict(a=30, theta=95)), "tap.theta"),
    ]:
        with pytest.raises(vibrissa.InputError) as caught:
            call()
        e = caught.value
        assert e.key == key and "--" not in str(e) and (e.allowed or e.file), str(e)


def test_what_should_be_known_is_a_warning(desk):
    desk, calibration = desk
    plain = {**RIG, "model": {}}
    on_axis = vibrissa.calibrate(vibrissa.simulate(**plain, tap=OFTEN), **plain)
    taps = dict(base_x_mm=[0.0, 1.0], base_y_mm=[0.0, 0.0], heading_deg=[90.0, 90.0], theta_deg=[4.0, 4.0], strain=[0.02, 0.021])
    with pytest.warns(UserWarning, match="contact surface puts them"):
        vibrissa.contour(taps, on_axis)
    with pytest.warns(UserWarning, match="no row gives a point"):
        vibrissa.contour({**taps, "strain": [np.nan, np.nan]}, calibration)


def test_the_lock_is_released(desk):
    """Threads trace at once, to the same points."""
    desk, calibration = desk
    data, found = pd.read_csv(desk / "strokes.csv"), [None] * 4

    def trace(k):
        found[k] = vibrissa.contour(data, calibration).points["x_mm"]

    threads = [threading.Thread(target=trace, args=(k,)) for k in range(len(found))]
    [t.start() for t in threads]
    [t.join() for t in threads]
    for x in found[1:]:
        np.testing.assert_array_equal(x, found[0])


@pytest.mark.parametrize("kind", [dict, pd.DataFrame, pl.DataFrame])
def test_a_frame_has_no_comments(kind, desk):
    _, calibration = desk
    words = ["#1", "a, b", "#3\nand more", ' "#4"', "5", None]
    taps = dict(theta_deg=[4.0] * 6, strain=[0.02] * 6)
    pose = dict(base_x_mm=[0.0] * 6, base_y_mm=[1.0 * i for i in range(6)], heading_deg=[90.0] * 6)
    for name in ("run", "#run", "ru\nn"):
        located = calibration.locator().table(kind({name: words, **taps}))
        assert len(located) == 6 and set(located["distance_mm"]) == {located["distance_mm"][0]}, (name, located.to_pandas())
        assert len(vibrissa.contour(kind({name: words, **pose, **taps}), calibration, curve="line").points) == 6
    mounted = vibrissa.Array([dict(name="#1", calibration=calibration, x=0, y=0, heading=0)])
    assert list(mounted.locate(kind(dict(whisker=["#1", "#1"], theta_deg=[4.0, 4.0], strain=[0.02, 0.03])))["whisker"]) == ["#1", "#1"]
