"""What other libraries understand: tables as mappings, data of every origin, saved results."""

import collections.abc
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import vibrissa

SECTIONS = dict(whisker=dict(D=10, d=[4, 7], L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30, 45], theta=[1, 4]), run=dict(backend="cpu"))
ONE = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=2e-5), tap=dict(a=[21, 30, 39, 48], theta=[2, 4, 6]))


@pytest.fixture(scope="module")
def swept():
    return vibrissa.sweep(**SECTIONS)


def test_a_table_is_a_mapping(swept):
    table = swept.tuples
    assert isinstance(table, collections.abc.Mapping) and [*dict(table.items())] == table.columns and len(table.values()) == len(table.columns)
    assert table.get("nothing") is None and table.get("nothing", 3) == 3 and table.get("K") is not None
    # pandas asks whatever is no dict for one array.
    with pytest.raises(TypeError, match="dict"):
        pd.DataFrame(table)
    frame = pd.DataFrame(dict(table))
    assert list(frame.columns) == table.columns and frame["K"].tolist() == table["K"].tolist() and len(frame) == len(table)
    with pytest.raises(TypeError, match="take a column"):
        np.asarray(table)
    shown = table._repr_html_()
    assert shown.startswith("<table>") and "D_mm" in shown and f"{len(table)} rows" in shown


def test_status_of_numpy():
    assert vibrissa.Status(np.uint16(96)) == vibrissa.Status.strain_limit | vibrissa.Status.no_root


def data_of_every_origin():
    measured = vibrissa.simulate(**ONE, seed=2).measurements
    frame = measured.to_pandas()[["a_mm", "theta_deg", "strain"]]
    yield "pandas", frame
    yield "structured", frame.to_records(index=False)
    pl, pa = pytest.importorskip("polars"), pytest.importorskip("pyarrow")
    yield "LazyFrame", pl.DataFrame(frame).lazy()
    table = pa.Table.from_pandas(frame, preserve_index=False)
    yield "RecordBatchReader", table.to_reader()
    yield "RecordBatch", table.to_batches()[0]

    class Capsule:
        def __arrow_c_stream__(self, requested_schema=None):
            return table.__arrow_c_stream__(requested_schema)

    yield "capsule", Capsule()
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed here")
    yield "DuckDB", duckdb.sql("select * from frame")


def test_data_of_every_origin():
    texts = {name: vibrissa.calibrate(data, whisker=ONE["whisker"], gauge=ONE["gauge"]).K_table["K"].tolist() for name, data in data_of_every_origin()}
    assert len(texts) >= 6 and all(text == texts["pandas"] for text in texts.values())


def test_saved_and_loaded(swept, tmp_path):
    swept.save(tmp_path / "sweep.npz")
    again = vibrissa.Sweep.load(tmp_path / "sweep.npz")
    assert again.run == swept.run
    for name in ("tuples", "designs", "distances"):
        one, other = getattr(swept, name), getattr(again, name)
        pd.testing.assert_frame_equal(one.to_pandas(), other.to_pandas())
    (tmp_path / "bad.npz").write_text("nothing")
    with pytest.raises(vibrissa.InputError):
        vibrissa.Sweep.load(tmp_path / "bad.npz")
    calibration = vibrissa.calibrate(vibrissa.simulate(**ONE, repeats=2), whisker=ONE["whisker"], gauge=ONE["gauge"])
    calibration.save(tmp_path / "calibration.toml")
    assert vibrissa.Calibration.load(tmp_path / "calibration.toml").locate(4.0, 0.02) == calibration.locator().locate(4.0, 0.02)


def test_tuples_with_a_property_of_their_own():
    columns = dict(D_mm=[10.0, 10.0], d_mm=[4.0, 4.0], L_a_mm=[50.0, 50.0], x_ss_mm=[5.0, 5.0], l_mm=[2.0, 2.0], a_mm=[30.0, 30.0], theta_deg=[4.0, 4.0],
                   k_theta_Nmm_per_rad=[300.0, 3000.0])
    result = vibrissa.sweep(tuples=pd.DataFrame(columns), run=dict(backend="cpu", precision="f64"))
    expected = [vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, root={"k_theta": k}) for k in (300.0, 3000.0)]
    assert result.tuples["strain"] == pytest.approx(expected, rel=1e-7) and expected[0] != expected[1]


def test_python_m():
    done = subprocess.run([sys.executable, "-m", "vibrissa"], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and vibrissa.__version__ in done.stdout, done.stderr


def test_a_law_from_a_curve():
    def stress(e, c=(0.5, -0.08, 0.02)):
        l = 1 + e
        i = l * l + 2 / l - 3
        return 2 * (l - 1 / l**2) * (c[0] + 2 * c[1] * i + 3 * c[2] * i * i)

    strains = np.linspace(-0.3, 0.9, 25)
    fit = vibrissa.fit_material(pd.DataFrame(dict(strain=strains, stress_MPa=stress(strains))))
    assert fit.material["yeoh"] == pytest.approx([0.5, -0.08, 0.02], rel=1e-8) and fit.points == 25 and fit.rms_MPa < 1e-12
    assert vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, material=fit.material) > 0
    for bad in (dict(strain=[0.1, 0.2], stress_MPa=[0.3, 0.6]), pd.DataFrame(), dict(strain=[0.1, np.nan, 0.3, 0.4, 0.5], stress_MPa=[0.3, 0.4, 0.5, 0.6, 0.7])):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.fit_material(bad)
        assert caught.value.file is None and "curve.csv" not in str(caught.value)


def test_parameters_of_a_fit():
    calibration = vibrissa.calibrate(vibrissa.simulate(**ONE, repeats=4, a_offset=0.4, noise=5e-6), whisker=ONE["whisker"], gauge=ONE["gauge"], fit=["a_offset"])
    assert calibration.params["a_offset"] == pytest.approx(0.4, abs=5 * np.sqrt(np.diag(calibration.cov))[list(calibration.params).index("a_offset")])
    assert calibration.cov.shape == (len(calibration.params),) * 2 and np.allclose(calibration.cov, calibration.cov.T, rtol=1e-9)
