"""Pages, reports and strokes: as the program makes them."""

import json
import re

import numpy as np
import pytest
from conftest import same_table

import vibrissa

RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), model=dict(surface=True))
CIRCLE = dict(object=dict(shape="circle", x=0, y=0, radius=10), around=dict(starts=6, distance=36), touch_noise=0.1)


def chart_of(html):
    """What a page holds, without its name."""
    found = json.loads(re.search(r'<script[^>]*type="application/json"[^>]*>(.*?)</script>', html, re.S).group(1))
    return {key: value for key, value in found.items() if key != "name"}


def test_the_page_is_that_of_the_program(root, cli, tmp_path):
    cli("explore", "sweeps/prototypes.toml", "--out", tmp_path / "explore.html", "--quiet")
    page = vibrissa.explore(root / "sweeps/prototypes.toml")
    page.save(tmp_path / "mine.html")
    assert (tmp_path / "mine.html").read_text() == page.html == (tmp_path / "explore.html").read_text()
    assert page.error < 1e-5 and page.run["counts"]["taps_checked"] > 100 and page._repr_html_().startswith("<iframe")
    keys = dict(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 45], theta=[1, 8]))
    assert vibrissa.explore(**keys, run=dict(tolerance=1e-4)).html != vibrissa.explore(**keys).html
    for bad, key in ((dict(model=dict(geometry="linear")), "model.geometry"), (dict(run=dict(tolerance=1e-9)), "tolerance"), (dict(whiskers=3), "whiskers")):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.explore(**keys, **bad)
        assert caught.value.key == key


def test_a_report_of_a_result(cli, tmp_path):
    cli("sweep", "sweeps/prototypes.toml", "--quiet", "--out", tmp_path / "swept")
    made = vibrissa.report(tmp_path / "swept", figures="svg")
    assert made.page == tmp_path / "swept/report/report.html" and made.page.read_text().startswith("<!doctype html>")
    assert made.answer and all((made.page.parent / f"{name}.svg").exists() for name in made.figures) and made.page in made.files
    alone = vibrissa.report(tmp_path / "swept", tmp_path / "alone", figures=())
    assert [file.suffix for file in alone.files] == [".html", ".json"] and alone.answer == made.answer
    for call, key in ((lambda: vibrissa.report(tmp_path / "swept", figures="gif"), "figures"), (lambda: vibrissa.report(tmp_path / "swept", width=4), "width"),
                      (lambda: vibrissa.report(tmp_path / "swept", figures=3), "figures"), (lambda: vibrissa.report(3), "folder"), (lambda: vibrissa.report(tmp_path / "none"), None)):
        with pytest.raises(vibrissa.InputError) as caught:
            call()
        assert key is None or caught.value.key == key


def test_strokes_are_those_of_the_program(cli, tmp_path):
    spec, object_ = tmp_path / "rig.toml", tmp_path / "object.toml"
    keys = dict(**RIG, tap=dict(a=30, theta=[2, 4, 6]))
    spec.write_text(vibrissa.spec_text(**keys))
    object_.write_text('touch_noise = 0.1\n[object]\nshape = "circle"\nx = 0.0\ny = 0.0\nradius = 10.0\n[around]\nstarts = 6\ndistance = 36.0\n')
    cli("simulate", spec, "--object", object_, "--seed", "3", "--quiet", "--out", tmp_path / "out")
    for said in (CIRCLE, object_):
        stroked = vibrissa.simulate(**keys, object=said, seed=3)
        same_table(stroked.measurements, tmp_path / "out/strokes.csv")
        assert stroked.run["settings"]["starts"] == 6
    starts = dict(object=CIRCLE["object"], start=[dict(x=-30, y=5, heading=-90), dict(x=0, y=300, heading=0)])
    with pytest.warns(vibrissa.VibrissaWarning, match="start 2 makes no stroke"):
        assert set(vibrissa.simulate(**keys, object=starts).measurements["stroke"]) == {1.0}


def test_strokes_become_a_contour():
    calibration = vibrissa.calibrate(vibrissa.simulate(**RIG, tap=dict(a=range(15, 49, 3), theta=[1, 2, 4, 6, 8]), repeats=3), **RIG)
    stroked = vibrissa.simulate(**RIG, tap=dict(a=30, theta=list(range(1, 9))), object={**CIRCLE, "around": dict(starts=12, distance=36)}, seed=2)
    traced = vibrissa.contour(stroked, calibration, truth=CIRCLE)
    assert traced.kind == "circle" and np.allclose(np.hypot(traced.outline["x_mm"], traced.outline["y_mm"]), 10)


@pytest.mark.parametrize("bad, key", [
    (dict(object=3), "object"), (dict(object=dict(object=dict(shape="cube"), start=[dict(x=0, y=0, heading=0)])), "object.shape"), (dict(object=CIRCLE, repeats=2), "repeats"),
    (dict(object=dict(object=CIRCLE["object"])), "start"), (dict(object=dict(object=CIRCLE["object"], start=3)), "start"), (dict(object=CIRCLE, model=dict(geometry="linear")), "model.geometry")])
def test_what_is_no_object_is_refused(bad, key):
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.simulate(**{**RIG, "tap": dict(a=30, theta=4), **bad})
    assert caught.value.key == key
