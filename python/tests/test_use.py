"""What users run: the README's lines, the notebooks, the examples, the figures."""

import importlib.util
import pathlib
import pickle
import re

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import vibrissa

HERE = pathlib.Path(__file__).resolve().parents[1]
CPU = dict(backend="cpu")


@pytest.mark.parametrize("page", ["README.md", "python/PYTHON.md", "docs/python.md"])
def test_lines_of_a_page(page, root, monkeypatch):
    """Indented lines that begin with `import vibrissa` run as they stand."""
    if not (root / page).exists():
        pytest.skip("an sdist has no docs")
    text = (root / page).read_text()
    blocks = re.findall(r"(?:^    .*\n)+", text, flags=re.MULTILINE)
    blocks = [re.sub(r"^    ", "", b, flags=re.MULTILINE) for b in blocks if b.lstrip().startswith("import vibrissa")]
    assert blocks
    monkeypatch.chdir(root)
    for block in blocks:
        exec(compile(block, page, "exec"), {})


@pytest.mark.parametrize("name", ["figures", "calibration", "fit"])
def test_notebook(name):
    notebook = nbformat.read(HERE / "notebooks" / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "notebooks are kept without outputs"
    NotebookClient(notebook, timeout=600, startup_timeout=300, kernel_name="python3", resources={"metadata": {"path": HERE / "notebooks"}}).execute()
    pictures = [out for cell in notebook.cells for out in cell.get("outputs", []) if "image/png" in out.get("data", {})]
    assert pictures


@pytest.mark.parametrize("name, least", [("scipy_search", 0.999), ("optuna_search", 0.999)])
def test_example(name, least):
    spec = importlib.util.spec_from_file_location(name, HERE / "examples" / f"{name}.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    theirs, own = example.main()
    # The library's own search finds at least as good a design, and theirs is near it.
    assert own <= theirs / least and theirs < 1.5 * own, (theirs, own)


def test_figures_draw_what_the_tables_hold():
    result = vibrissa.sweep(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30, 48], theta=[1, 4, 9]), run=CPU)
    designs, tuples = result.designs, result.tuples
    lines = result.plot("sd").get_lines()
    assert len(lines) == 2
    for line, d in zip(lines, (4.0, 7.0)):
        np.testing.assert_array_equal(line.get_ydata(), designs["K_sd"][designs["d_tip_mm"] == d])
        np.testing.assert_array_equal(line.get_xdata(), [1, 4, 9])
        assert line.get_label() == f"d = {d:g} mm"
    second = tuples["d_tip_mm"] == 7.0
    for line, theta in zip(result.plot("K", design=1).get_lines(), (1, 4, 9)):
        np.testing.assert_array_equal(line.get_ydata(), tuples["K"][second & (tuples["theta_deg"] == theta)])
    ax = result.plot("distance", drives=[4, 9])
    np.testing.assert_array_equal(ax.get_lines()[1].get_ydata(), tuples["distance_mm"][~second & (tuples["theta_deg"] == 4)])
    assert "â" in ax.get_ylabel() and "mm" in ax.get_xlabel()
    np.testing.assert_array_equal(result.plot("strain").get_lines()[0].get_ydata(), tuples["strain"][~second & (tuples["a_mm"] == 21)])
    labels = [line.get_label() for line in result.plot("error").get_lines()]
    assert labels == ["bias", "noise", "total"]
    for kind, key in (("beauty", "kind"), ("K", "design")):
        with pytest.raises(vibrissa.InputError) as caught:
            result.plot(kind, design=9)
        assert caught.value.key == key
    plt.close("all")


def test_figures_of_the_other_results(root):
    best = vibrissa.tap(root / "sweeps/best-tap.toml")
    mark = best.plot().get_lines()[-1]
    assert mark.get_xdata()[0] == best.optimum["theta_deg"] and mark.get_ydata()[0] == best.optimum["total_rms_mm"]
    calibration = vibrissa.calibrate(root / "examples/prototype-d10.csv", root / "examples/prototype-d10.toml")
    assert any(line.get_label() == "suspect" for line in calibration.plot().get_lines())
    front = vibrissa.pareto(root / "sweeps/pareto.toml", run=CPU, optimise=dict(budget=dict(evaluations=600)))
    np.testing.assert_array_equal(front.plot().get_lines()[0].get_xdata(), front.front["K_sd"])
    search = vibrissa.optimise(root / "sweeps/design.toml", run=CPU, optimise=dict(budget=dict(evaluations=300)))
    np.testing.assert_array_equal(search.plot().get_lines()[0].get_ydata(), search.history["total_rms_mm"])
    plt.close("all")


def test_figures_to_scale(root):
    rig = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), model=dict(surface=True, pole_radius=2))
    bent = vibrissa.shape(**rig, tap=dict(a=[30], theta=[1, 4, 10]))
    contacts = {line.get_label(): line for line in bent.plot().get_lines()}
    assert contacts["contact"].get_xdata()[0] == bent.contacts["contact_x_mm"][0] and bent.plot().get_aspect() == 1.0
    strain = bent.plot("strain", taps=[2]).get_lines()
    np.testing.assert_array_equal(strain[0].get_ydata(), bent.shape["strain"][bent.shape["tap"] == 2])
    assert [line.get_label() for line in bent.plot("strain").get_lines()] == ["θ = 1°", "θ = 4°", "θ = 10°"]
    calibration = vibrissa.calibrate(vibrissa.simulate(**rig, tap=dict(a=range(21, 49, 3), theta=[2, 4, 8]), repeats=3), **rig)
    taps = vibrissa.simulate(**rig, tap=dict(a=range(22, 46, 2), theta=4)).measurements
    poses = dict(base_x_mm=np.arange(len(taps)) * 3.0, base_y_mm=np.where(np.arange(len(taps)) == 5, 3, 0) - taps["a_mm"], heading_deg=np.full(len(taps), 90.0))
    traced = vibrissa.contour({**poses, "theta_deg": taps["theta_deg"], "strain": taps["strain"]}, calibration)
    lines = {line.get_label(): line for line in traced.plot("where").get_lines()}
    np.testing.assert_array_equal(lines["line"].get_ydata(), traced.curve["y_mm"])
    np.testing.assert_array_equal(lines["outliers"].get_xdata(), traced.points["x_mm"][[5]])
    assert len(lines["points"].get_xdata()) == len(taps) - 1 and len(lines["motor's axis"].get_xdata()) == len(taps)
    none = vibrissa.contour({key: np.asarray(column)[:2] for key, column in {**poses, "theta_deg": taps["theta_deg"], "strain": taps["strain"]}.items()}, calibration)
    assert none.kind == "" and len(none.curve) == 0 and "three points" in none.result["curve"]["why"] and none.plot()
    for call, key in ((lambda: traced.plot("far"), "kind"), (lambda: bent.plot("beauty"), "kind"), (lambda: bent.plot(taps=7), "taps"), (lambda: bent.plot(taps="all"), "taps")):
        with pytest.raises(vibrissa.InputError) as caught:
            call()
        assert caught.value.key == key and caught.value.allowed
    plt.close("all")


def test_the_next_tap_of_an_object(tmp_path):
    model = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=5e-5))
    taps = dict(a=[21, 26, 31, 36, 41, 46], theta=[1, 3, 5, 7, 9])
    rig = vibrissa.simulate(**model, tap=taps, repeats=2, seed=4)
    locator = vibrissa.Locator(vibrissa.calibrate(rig, **model))
    first = locator.next()
    assert first.taps == 0 and first.distance_mm is None and 1 <= first.drive <= 9
    readings = []
    sigmas = [first.sigma_mm]
    for _ in range(3):
        told = locator.next(readings)
        readings.append((told.drive, locator.expected(33.0, told.drive)))
        after = locator.next(readings)
        assert after.taps == len(readings) and after.sigma_mm < sigmas[-1]
        sigmas.append(after.sigma_mm)
    assert abs(after.distance_mm - 33) < 3 * after.sigma_mm and after.least_sigma_mm < after.sigma_mm
    assert len(after.drives) == len(after.sigmas_mm) == len(after.statuses) == 33
    assert 2 <= locator.next(readings, within=(2, 4)).drive <= 4
    for bad in (dict(within=(5, 2)), dict(within=(90, 99)), dict(readings=[1.0]), dict(readings=[("a", 1.0)])):
        with pytest.raises(vibrissa.InputError):
            locator.next(**bad)


def test_signals_of_a_sensor_at_the_root():
    rig = dict(whisker=dict(D=10, d=4, L_a=50, root=dict(k_theta=1000)), gauge=dict(x_ss=5, l=2))
    taps = dict(a=[21, 26, 31, 36, 41, 46], theta=[2, 4, 6])
    both = vibrissa.sweep(**rig, sensor=dict(signal=["moment", "force"], noise=[0.02, 0.001]), tap=taps, estimate=dict(K=1)).tuples
    assert np.allclose(both["distance_mm"], np.abs(both["signal_moment"] / both["signal_force"]), rtol=1e-6)
    moment = dict(signal="moment", noise=0.01)
    one = vibrissa.sweep(**rig, sensor=moment, tap=taps).tuples
    assert np.allclose(one["signal"], both["signal_moment"], rtol=1e-5)
    measured = vibrissa.simulate(**rig, sensor=moment, tap=taps, repeats=2, seed=2)
    locator = vibrissa.Locator(vibrissa.calibrate(measured, **rig, sensor=moment))
    found = locator.locate(4.0, locator.expected(33.0, 4.0))
    assert abs(found.distance_mm - 33) < 0.3 and found.sigma_mm > 0
    assert 2 <= vibrissa.tap(**rig, sensor=moment, tap=dict(a=[21, 33, 45], theta=[2, 6])).optimum["theta_deg"] <= 6


def test_several_channels_are_calibrated_and_answer_together(tmp_path):
    rig = dict(whisker=dict(D=10, d=4, L_a=50, root=dict(k_theta=1000)), gauge=dict(x_ss=5, l=2))
    sensor = dict(signal=["moment", "force"], noise=[0.02, 0.001])
    measured = vibrissa.simulate(**rig, sensor=sensor, tap=dict(a=[21, 25, 29, 33, 37, 41, 45], theta=[1, 2, 3, 4, 5]), repeats=2, zero_every=5)
    found = vibrissa.calibrate(measured, **rig, sensor=sensor)
    assert found.channels["moment_Nmm"].shape == found.channels["distance_mm"].shape
    with pytest.raises(AttributeError, match="channels"):
        found.K_table
    locator = found.locator()
    assert locator.channels == ["moment_Nmm", "force_N"] and locator.noise.shape == (2,)
    tap = locator.expected(30.0, 3.0, -1.0)
    at = locator.locate(3.0, tap)
    assert abs(at.distance_mm - 30.0) < 1e-3 and at.status == 0
    # Two channels tell the drive, too; arrays broadcast; a name for each is as good as an order.
    assert abs(locator.locate(None, tap).distance_mm - 30.0) < 1e-2
    many = locator.locate([2.0, 3.0], np.stack([locator.expected(30.0, 2.0, -1.0), tap]))
    assert np.allclose(many.distance_mm, 30.0, atol=1e-3) and many.sigma_mm.shape == (2,)
    named = locator.locate(3.0, dict(zip(locator.channels, tap)))
    assert named.distance_mm == at.distance_mm
    located = locator.table(measured.measurements)
    assert np.nanmax(np.abs(located["distance_mm"] - located["a_mm"])) < 2.0
    found.save(tmp_path / "calibration.toml")
    again = pickle.loads(pickle.dumps(vibrissa.Calibration.load(tmp_path / "calibration.toml")))
    assert again.locate(3.0, tap).distance_mm == at.distance_mm
    wrong = [lambda: locator.export(), lambda: locator.locate(3.0, tap[:1]), lambda: locator.locate(3.0, dict(force_N=1.0)), lambda: locator.next([]), lambda: vibrissa.Locator(found, zero=1.0)]
    for call in wrong:
        with pytest.raises(vibrissa.InputError):
            call()


def looks(lines):
    return [(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines]


def test_designs_of_a_figure_can_be_told_apart():
    tap = dict(a=[21, 30, 48], theta=[1, 4, 9])
    result = vibrissa.sweep(whisker=dict(D=vibrissa.axis(8, 12, steps=10), d=[3, 4, 5, 6], L_a=50), gauge=dict(x_ss=5, l=2), tap=tap, run=CPU)
    ax = result.plot("sd")
    behind = [line for line in ax.get_lines() if line.get_color() == "lightgrey"]
    named = [line for line in ax.get_lines() if line.get_color() != "lightgrey"]
    assert len(named) == 7 and len(behind) == 33 and len(set(looks(named))) == 7
    legend = ax.get_legend()
    assert "7 designs of least spread" in legend.get_title().get_text() and legend.get_texts()[-1].get_text() == "the other 33 designs"
    designs = result.designs
    least = {}
    for D, d, sd in zip(designs["D_mm"], designs["d_tip_mm"], designs["K_sd"]):
        least[D, d] = min(sd, least.get((D, d), np.inf))
    best = sorted(least, key=least.get)[:7]
    assert [text.get_text() for text in legend.get_texts()[:7]] == [f"D = {D:g}, d = {d:g} mm" for D, d in best]
    for line, (D, d) in zip(named, best):
        rows = (designs["D_mm"] == D) & (designs["d_tip_mm"] == d)
        np.testing.assert_array_equal(line.get_ydata(), designs["K_sd"][rows])
    plt.close("all")
    # Of so many not all are drawn, and the figure says so.
    many = vibrissa.sweep(whisker=dict(D=vibrissa.axis(8, 12, steps=500), d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=tap, run=CPU, output=dict(tuples=False)).plot("sd")
    assert many.get_legend().get_texts()[-1].get_text() == "300 of the other 493 designs" and len(many.get_lines()) == 307
    drives = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30, 48], theta=vibrissa.axis(1, 10, steps=60)), run=CPU)
    for kind, first in (("K", 0), ("distance", 1)):
        lines = drives.plot(kind, drives=drives.tuples["theta_deg"][:49]).get_lines()[first:]
        assert len(lines) == 49 and len(set(looks(lines))) == 49
        with pytest.raises(vibrissa.InputError, match="told apart"):
            drives.plot(kind, drives=drives.tuples["theta_deg"][:60])
    bent = vibrissa.shape(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=vibrissa.axis(1, 10, steps=30)), nodes=3)
    assert len(set(looks(bent.plot("strain", taps=range(28)).get_lines()))) == 28
    with pytest.raises(vibrissa.InputError, match="told apart"):
        bent.plot("strain", taps=range(30))
    plt.close("all")


def test_a_file_is_saved_whole_or_not_at_all(tmp_path):
    swept = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30], theta=[1, 4]), run=CPU)
    folder = tmp_path / "folder"
    folder.mkdir()
    for path in (folder, f"{tmp_path / 'new'}/"):
        with pytest.raises(vibrissa.InputError) as caught:
            swept.save(path)
        assert caught.value.key == "path" and "folder" in str(caught.value)
    with pytest.raises(OSError):
        swept.save(tmp_path / "none" / "sweep.npz")
    assert [p.name for p in tmp_path.rglob("*")] == ["folder"]
    # What has a name like that of a part is somebody else's.
    (tmp_path / "sweep.npz.part").write_text("mine")
    swept.save(tmp_path / "sweep.npz")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "sweep.npz", "sweep.npz.part"] and (tmp_path / "sweep.npz.part").read_text() == "mine"
    assert (tmp_path / "sweep.npz").stat().st_mode == (tmp_path / "sweep.npz.part").stat().st_mode
