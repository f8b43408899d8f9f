"""Each function against the tables that the program writes: every number to the last bit, every word."""

import io
import json
import re

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from conftest import same_table

import vibrissa

CPU = dict(backend="cpu")
SWEEPS = ["prototypes", "practical", "effects", "best-tap-drives"]


def spec_of(name, root, tmp_path):
    """A shipped spec; of a search or a best tap its whisker at a few drives."""
    if name != "best-tap-drives":
        return root / "sweeps" / f"{name}.toml"
    text = (root / "sweeps" / "best-tap.toml").read_text()
    path = tmp_path / "drives.toml"
    path.write_text(text.replace("[model]", "theta = [0.5, 4, 9]\n[model]"))
    return path


@pytest.mark.parametrize("name", SWEEPS)
@pytest.mark.parametrize("run", [CPU, dict(backend="cpu", precision="f64"), dict(backend="gpu")], ids=lambda r: "-".join(r.values()))
def test_sweep(name, run, root, cli, tmp_path):
    spec = spec_of(name, root, tmp_path)
    flags = [x for key, value in run.items() for x in (f"--{key}", value)]
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out", *flags)
    result = vibrissa.sweep(spec, run=run)
    compared = 0
    for table in ("tuples", "designs", "distances"):
        path = tmp_path / "out" / f"{table}.csv"
        assert path.exists() == (getattr(result, table) is not None)
        if path.exists():
            same_table(getattr(result, table), path)
            compared += len(getattr(result, table))
    assert compared > 0
    written = json.loads((tmp_path / "out" / "run.json").read_text())
    # Kernels that the first of both had to check the second knows.
    for one in (result.run, written):
        one["backend"].pop("device", None)
    for key in ("counts", "backend", "material_fit", "warnings", "version"):
        assert result.run[key] == written[key], key


def test_sweep_of_keywords_is_the_sweep_of_their_text(cli, tmp_path):
    sections = dict(
        whisker=dict(D=np.array([9.0, 10.5]), d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2.0, noise_strain=15e-6),
        tap=dict(a=range(21, 49, 9), theta=vibrissa.axis(0.5, 10, steps=4, scale="log")),
        model=dict(material={"neo-hookean": 3.2}, surface=True), output=dict(top=3, by="total_rms_mm"), run=CPU)
    spec = tmp_path / "keywords.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out")
    result = vibrissa.sweep(**sections)
    for table in ("tuples", "designs", "distances"):
        same_table(getattr(result, table), tmp_path / "out" / f"{table}.csv")
    assert len(result.designs) == 3


def test_ranked_sweep_and_samples(cli, tmp_path):
    sections = dict(
        whisker=dict(D=vibrissa.samples(8, 12, 300, seed=4), d=vibrissa.samples(3, 7, 300, seed=4), L_a=50), gauge=dict(x_ss=5, l=2),
        tap=dict(a=[24, 30, 44], theta=[1, 4, 9]), output=dict(top=20, per="design"), run=CPU)
    spec = tmp_path / "samples.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out")
    result = vibrissa.sweep(spec)
    for table in ("tuples", "designs", "distances"):
        same_table(getattr(result, table), tmp_path / "out" / f"{table}.csv")


def untimed(told):
    """What is told of effects left off, but for how long it took."""
    return {key: value for key, value in told.items() if key != "seconds"}


@pytest.mark.parametrize("command", ["sweep", "tap", "optimise"])
def test_effects_left_off(command, cli, tmp_path):
    """`[run] model_error` is that of the program: which effects are left off, and every number without them."""
    sections = dict(
        whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=2e-5), tap=dict(a=[21, 30, 39, 48]),
        model=dict(extension=True, shear=True, surface=True), run=dict(backend="cpu", precision="f64", model_error=0.02))
    if command == "sweep":
        sections |= dict(tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 9]), output=dict(top=2))
    if command == "optimise":
        sections |= dict(optimise=dict(objective="distance", budget=dict(evaluations=300), variables=dict(theta=[0.5, 10])))
    spec = tmp_path / "effects.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli(command, spec, "--quiet", "--out", tmp_path / "out")
    result = getattr(vibrissa, command)(spec)
    tables = {"sweep": ["tuples", "designs", "distances"], "tap": ["curve"], "optimise": ["history", "sensitivity"]}[command]
    for table in tables:
        same_table(getattr(result, table), tmp_path / "out" / f"{'tap' if table == 'curve' else table}.csv")
    written = json.loads((tmp_path / "out" / "run.json").read_text())
    assert untimed(result.run["model_error"]) == untimed(written["model_error"])
    assert [part["effect"] for part in written["model_error"]["left_off"]]
    with pytest.raises(vibrissa.InputError) as caught:
        getattr(vibrissa, command)(**{**sections, "run": dict(backend="cpu", model_error=1e-9)})
    assert caught.value.key == "run.model_error" and caught.value.file is None


def test_parquet_is_the_same_columns(cli, tmp_path):
    sections = dict(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[3, 30, 45], theta=[1, 20, 60]), run=CPU, output=dict(format="parquet"))
    spec = tmp_path / "parquet.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out")
    result = vibrissa.sweep(spec)
    for table in ("tuples", "designs", "distances"):
        written, own = pq.read_table(tmp_path / "out" / f"{table}.parquet"), getattr(result, table).to_arrow()
        words = [pa.field(f.name, pa.string()) if pa.types.is_dictionary(f.type) else f for f in own.schema]
        assert own.cast(pa.schema(words)).equals(written.replace_schema_metadata(None)), table


def random_taps(n=400):
    g = np.random.default_rng(3)
    low, high = [8, 3, 50, 3, 1, 15, 0.3], [12, 10, 50, 8, 4, 55, 30]
    columns = ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg"]
    return pd.DataFrame(g.uniform(low, high, (n, 7)), columns=columns)


MODELS = [{}, dict(surface=True, shear=True, extension=True, material={"neo-hookean": 3.2}, contact={"coulomb": 0.3}),
          dict(solid=True, pole_radius=3, material={"neo-hookean": 3.2})]


@pytest.mark.parametrize("model", MODELS, ids=["plain", "real", "solid"])
def test_listed_taps_and_strain(model, cli, tmp_path):
    taps = random_taps()
    taps.to_csv(tmp_path / "taps.csv", index=False)
    spec = tmp_path / "listed.toml"
    spec.write_text(vibrissa.spec_text(model=model, tuples=dict(file="taps.csv"), run=CPU))
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out")
    for result in (vibrissa.sweep(spec), vibrissa.sweep(tuples=taps, model=model, run=CPU)):
        for table in ("tuples", "designs", "distances"):
            same_table(getattr(result, table), tmp_path / "out" / f"{table}.csv")
    written = pd.read_csv(tmp_path / "out" / "tuples.csv")
    found = vibrissa.strain(*taps.to_numpy().T, full=True, precision="f32", **model)
    np.testing.assert_array_equal(found.strain, written["strain"])
    np.testing.assert_array_equal(found.K, written["K"])
    np.testing.assert_array_equal(found.normal_force_N, written["normal_force_N"])
    # Words of the estimate (no_root, ambiguous) are those of a sweep.
    physics = ~(vibrissa.Status.no_root | vibrissa.Status.ambiguous)
    told = written["status"].map(lambda w: sum(vibrissa.Status[x] for x in w.split("+")))
    np.testing.assert_array_equal(found.status, told.to_numpy() & physics)
    ones = [vibrissa.strain(*map(float, row), precision="f32", **model) for row in taps.to_numpy()[:50]]
    np.testing.assert_array_equal(ones, written["strain"][:50])
    assert np.isnan(found.strain).any() and np.isfinite(found.strain).any()


@pytest.mark.parametrize("objective", ["distance", "sd"])
def test_tap(objective, root, cli, tmp_path):
    spec = root / "sweeps" / "best-tap.toml"
    told = json.loads(cli("tap", spec, "--json", "--objective", objective, "--out", tmp_path / "out"))
    result = vibrissa.tap(spec, objective=objective)
    same_table(result.curve, tmp_path / "out" / "tap.csv")
    assert result.run["result"] == {key: value for key, value in told["result"].items() if key != "answer"}
    assert result.optimum == told["result"]["optimum"]


def small(name, root, tmp_path):
    text = re.sub(r"budget = .*", "budget = { evaluations = 900 }", (root / "sweeps" / name).read_text())
    path = tmp_path / name
    path.write_text(text.replace("samples = 64", "samples = 8"))
    return path


@pytest.mark.parametrize("name", ["design.toml", "pareto.toml", "robust.toml"])
def test_optimise(name, root, cli, tmp_path):
    spec = small(name, root, tmp_path)
    told = json.loads(cli("optimise", spec, "--json", "--backend", "cpu", "--out", tmp_path / "out"))
    steps = []
    result = vibrissa.optimise(spec, run=CPU, callback=steps.append)
    same_table(result.history, tmp_path / "out" / "history.csv")
    same_table(result.sensitivity, tmp_path / "out" / "sensitivity.csv")
    if name == "pareto.toml":
        same_table(result.front, tmp_path / "out" / "pareto.csv")
        assert vibrissa.pareto(spec, run=CPU).best == result.best
    else:
        assert result.front is None
    assert result.best == told["result"]["best"] and result.value == told["result"]["value"]
    # The first line of best.toml names the spec that was searched.
    best = [(tmp_path / "out" / "best.toml").read_text(), result.best_spec]
    assert best[0].split("\n")[1:] == best[1].split("\n")[1:]
    assert steps[-1].evaluations == result.run["counts"]["evaluations"] and steps[-1].stage in ("swarm", "polish")
    again = tmp_path / "best.toml"
    again.write_text(result.best_spec)
    assert len(vibrissa.sweep(again).designs) == 1


@pytest.mark.parametrize("d", [4, 7, 10])
def test_calibrate(d, root, cli, tmp_path):
    data, whisker = root / f"examples/prototype-d{d}.csv", root / f"examples/prototype-d{d}.toml"
    cli("calibrate", data, "--whisker", whisker, "--out", tmp_path / "out", "--quiet")
    result = vibrissa.calibrate(data, whisker)
    frames = [pd.read_csv(data), pl.read_csv(data), pl.read_csv(data).to_arrow(), dict(pd.read_csv(data)[["a_mm", "theta_deg", "strain"]])]
    for found in (result, *(vibrissa.calibrate(frame, whisker) for frame in frames[: 4 if d == 10 else 1])):
        for table in ("K_table", "designs", "distances", "rows"):
            same_table(getattr(found, table), tmp_path / "out" / f"{table}.csv")
    written = (tmp_path / "out" / "calibration.toml").read_text()
    assert result.text == written
    result.save(tmp_path / "saved.toml")
    assert (tmp_path / "saved.toml").read_text() == written
    assert result.estimator in ("paper", "exact", "curve", "learned")


def test_calibrate_without_whisker(root, cli, tmp_path):
    data = root / "examples/prototype-d10.csv"
    cli("calibrate", data, "--out", tmp_path / "out", "--quiet", "--group", "0.5,0.01")
    result = vibrissa.calibrate(data, group=(0.5, 0.01))
    same_table(result.rows, tmp_path / "out" / "rows.csv")
    assert result.text == (tmp_path / "out" / "calibration.toml").read_text()


def readings(result, n=300):
    g = np.random.default_rng(5)
    drives = g.choice([0.0, 1.0, 4.0, 9.5, 20.0], n, p=[0.05, 0.3, 0.3, 0.3, 0.05])
    return drives, np.where(drives > 0, drives * g.uniform(0.0035, 0.009, n) * g.choice([1, -1], n, p=[0.9, 0.1]), 1e-6)


@pytest.mark.parametrize("estimator", [None, "paper", "learned"])
def test_locate(estimator, root, cli, tmp_path):
    data, whisker = root / "examples/prototype-d10.csv", root / "examples/prototype-d10.toml"
    calibration = vibrissa.calibrate(data, whisker)
    path = tmp_path / "calibration.toml"
    calibration.save(path)
    flags = [] if estimator is None else ["--estimator", estimator]
    drives, strains = readings(calibration)
    frame = pd.DataFrame({"theta_deg": drives, "strain": strains})
    frame.to_csv(tmp_path / "readings.csv", index=False)
    cli("locate", path, tmp_path / "readings.csv", "--out", tmp_path / "out", "--quiet", *flags)
    locator = vibrissa.Locator(path, estimator=estimator)
    same_table(locator.table(tmp_path / "readings.csv"), tmp_path / "out" / "located.csv")
    same_table(locator.table(frame), tmp_path / "out" / "located.csv")
    stream = cli("locate", path, *flags, input=frame.to_csv(index=False))
    told = pd.read_csv(io.StringIO(stream))
    assert len(told) == len(frame)
    found = locator.locate(drives, strains)
    one_by_one = list(calibration.locator(estimator=estimator).stream(zip(drives.tolist(), strains.tolist())))
    for got in (found, vibrissa.Located(*map(np.array, zip(*one_by_one)))):
        np.testing.assert_array_equal(got.distance_mm, told["distance_mm"])
        np.testing.assert_array_equal(got.sigma_mm, told["sigma_mm"])
        assert vibrissa.status_words(got.status).tolist() == told["status"].tolist()
    assert np.isfinite(found.distance_mm).sum() > 100
    tap = np.flatnonzero(np.isfinite(found.distance_mm))[0]
    if not (drives[:tap] == 0).any():
        assert locator(drives[tap], strains[tap]).distance_mm == found.distance_mm[tap]


def test_export(root, cli, tmp_path):
    data, whisker = root / "examples/prototype-d10.csv", root / "examples/prototype-d10.toml"
    cli("calibrate", data, "--whisker", whisker, "--out", tmp_path / "out", "--quiet", "--export", "c")
    locator = vibrissa.Locator(tmp_path / "out" / "calibration.toml")
    assert locator.export("c") == locator.export() == (tmp_path / "out" / "locate.c").read_text()


def test_simulate(root, cli, tmp_path):
    whisker = root / "examples/prototype-d10.toml"
    cli("simulate", whisker, "--out", tmp_path / "out", "--repeats", 3, "--zero-every", 11, "--outliers", 0.02, "--signal", "microstrain",
        "--drift", 1e-8, "--hysteresis", 0.01, "--drive-offset", 0.05)
    result = vibrissa.simulate(whisker, repeats=3, zero_every=11, outliers=0.02, signal="microstrain", drift=1e-8, hysteresis=0.01, drive_offset=0.05)
    same_table(result.measurements, tmp_path / "out" / "measurements.csv")
    assert len(result.to_pandas()) > 330


def test_chart(root, cli, tmp_path):
    spec = tmp_path / "chart.toml"
    spec.write_text(vibrissa.spec_text(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[30, 40], theta=vibrissa.axis(1, 5, steps=3)),
                                       model=dict(surface=True)))
    cli("chart", spec, "--quiet", "--out", tmp_path / "out")
    found = vibrissa.chart(spec)
    assert found == json.loads((tmp_path / "out" / "chart.json").read_text())
    assert len(found["charts"]) == 2


def test_verify(root, cli, tmp_path):
    spec = root / "sweeps/prototypes.toml"
    cli("verify", spec, "--samples", 40, "--backend", "cpu", "--quiet", "--out", tmp_path / "out")
    found = vibrissa.verify(spec, samples=40, run=CPU)
    same_table(found.census, tmp_path / "out" / "verify.csv")
    assert found and found.ok
    assert not vibrissa.verify(spec, samples=40, run=CPU, bound=1e-12)


def test_devices(cli):
    told = json.loads(cli("devices", "--json"))
    found = vibrissa.devices()
    assert found["adapters"] == told["result"]["adapters"] and found["cpu"] == told["result"]["cpu"]
    told["backend"].pop("device", None)
    found["auto"].pop("device", None)
    assert found["auto"] == told["backend"]


def test_tilted_taps(cli, tmp_path):
    """Directions and a second gauge, as axes, as tuples and tap by tap: the numbers of the program."""
    gauge = dict(x_ss=5, l=2, second=True)
    sections = dict(whisker=dict(D=10, d=4, L_a=50), gauge=gauge, tap=dict(a=[21, 33], tilt=[-20, 0, 30], lean=10, theta=[1, 10]), run=CPU)
    spec = tmp_path / "tilted.toml"
    spec.write_text(vibrissa.spec_text(**sections))
    cli("sweep", spec, "--quiet", "--out", tmp_path / "out")
    swept = vibrissa.sweep(spec)
    for table in ("tuples", "designs", "distances"):
        same_table(getattr(swept, table), tmp_path / "out" / f"{table}.csv")
    taps = pd.read_csv(tmp_path / "out" / "tuples.csv")
    listed = vibrissa.sweep(tuples=taps, gauge=dict(second=True), run=CPU)
    np.testing.assert_array_equal(listed.tuples["strain_2"], swept.tuples["strain_2"])
    assert listed.tuples.columns == swept.tuples.columns
    one = vibrissa.sweep(tuples=taps.drop(columns="lean_deg"), gauge=dict(second=True), run=CPU)
    assert "tilt_deg" in one.tuples.columns and "lean_deg" not in one.tuples.columns
    place = (10, 4, 50, 5, 2, taps.a_mm, taps.theta_deg)
    told = vibrissa.strain(*place, tilt=taps.tilt_deg, lean=10, second=True, full=True)
    for mine, column in [(told.strain, "strain"), (told.strain_2, "strain_2"), (told.bending_azimuth_deg, "bending_azimuth_deg"), (told.slide_mm, "slide_mm")]:
        np.testing.assert_allclose(mine, taps[column], rtol=1e-5, atol=1e-9)
    alone = vibrissa.strain(10, 4, 50, 5, 2, 21, 10, tilt=30, lean=10, second=True, full=True)
    assert alone.strain_2 == pytest.approx(taps.strain_2[5], rel=1e-5)
    assert np.isnan(vibrissa.strain(10, 4, 50, 5, 2, 21, 10, full=True).strain_2)
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.strain(10, 4, 50, 5, 2, 21, 10, tilt=[0, 30], extension=True, contact={"coulomb": 0.3})
    assert caught.value.key == "tilt"


def test_the_bias_is_read_by_both_of_its_names():
    whisker, gauge = dict(D=9, d=4, L_a=50), dict(x_ss=5, l=2, noise_strain=15e-6)
    best = vibrissa.tap(whisker=whisker, gauge=gauge, tap=dict(a=[21, 30, 39], theta=[3, 4]))
    assert best.optimum["bias_rms_mm"] == best.optimum["error_rms_mm"]
    assert (best.curve["bias_rms_mm"] == best.curve["error_rms_mm"]).all()
    swept = vibrissa.sweep(whisker=whisker, gauge=gauge, tap=dict(a=[21, 30, 39], theta=[3, 4]), output=dict(by="bias_rms_mm", top=1))
    assert (swept.designs["bias_rms_mm"] == swept.designs["error_rms_mm"]).all()
    assert "bias_rms_mm" not in swept.designs.columns
