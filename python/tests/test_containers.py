"""Taps one by one, in whatever holds them: every container gives the same table, and no column is left out without a word."""

import warnings

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
import xarray

import vibrissa

CPU = dict(backend="cpu", precision="f64")
PLAIN = dict(D_mm=[10.0, 10.0], d_mm=[4.0, 5.0], L_a_mm=[50.0, 50.0], x_ss_mm=[5.0, 5.0], l_mm=[2.0, 2.0], a_mm=[30.0, 31.0], theta_deg=[4.0, 5.0])
RIG = dict(PLAIN, hub_mm=[0.0, 4.0], E_MPa=[3.2, 3.0])
TILTED = dict(PLAIN, tilt_deg=[0.0, 10.0])


def relation(columns):
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed here")
    frame = pd.DataFrame(columns)  # noqa: F841  (DuckDB reads it by its name)
    return duckdb.sql("select * from frame")


KINDS = {
    "dict": dict,
    "pandas": pd.DataFrame,
    "pandas, an index of columns": lambda columns: pd.DataFrame(columns).set_index([name for name in columns if name not in PLAIN] or ["a_mm"]),
    "dict of Series": lambda columns: dict(pd.DataFrame(columns)),
    "polars": pl.DataFrame,
    "LazyFrame": lambda columns: pl.DataFrame(columns).lazy(),
    "Table": pa.table,
    "RecordBatch": pa.RecordBatch.from_pydict,
    "RecordBatchReader": lambda columns: pa.table(columns).to_reader(),
    "structured array": lambda columns: np.array([*zip(*columns.values())], dtype=[(name, float) for name in columns]),
    "recarray": lambda columns: pd.DataFrame(columns).to_records(index=False),
    "Dataset": lambda columns: pd.DataFrame(columns).to_xarray(),
    "Dataset with coordinates": lambda columns: xarray.Dataset({name: ("tap", x) for name, x in columns.items()}).set_coords([*columns][5:]),
    "DuckDB": relation,
}


@pytest.mark.parametrize("name", KINDS)
def test_every_container_gives_the_same_taps(name):
    for columns in (PLAIN, TILTED, RIG):
        with warnings.catch_warnings():
            warnings.simplefilter("error", vibrissa.VibrissaWarning)
            found = vibrissa.sweep(tuples=KINDS[name](columns), run=CPU).tuples["strain"]
        whole = {key: np.array(x) for key, x in columns.items()}
        hub, tilt, E = (whole.get(key, [other] * 2) for key, other in (("hub_mm", 0.0), ("tilt_deg", 0.0), ("E_MPa", 3.2)))
        for k in range(2):
            expected = vibrissa.strain(*(whole[key][k] for key in PLAIN), hub=hub[k], tilt=tilt[k], material=dict(hooke=E[k]))
            assert found[k] == pytest.approx(expected, rel=1e-6), (columns.keys(), k)
    shown = vibrissa.shape(tuples=KINDS[name](RIG), nodes=3).contacts["strain"]
    assert shown == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize("name", KINDS)
def test_what_is_missing_or_not_read_is_named(name):
    for missing in ("a_mm", "theta_deg"):
        # An index of columns is one of what is there.
        columns = {key: x for key, x in TILTED.items() if key != missing}
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.sweep(tuples=KINDS[name](columns), run=CPU)
        assert caught.value.key == "tuples" and f"column {missing} is missing" in str(caught.value)
    for more in ("colour", "delta_mm", "scale"):
        with pytest.warns(vibrissa.VibrissaWarning, match=f"ignored columns {more}"):
            vibrissa.sweep(tuples=KINDS[name]({**TILTED, more: [1.0, 2.0]}) if "index" not in name else pd.DataFrame({**TILTED, more: [1.0, 2.0]}), run=CPU)


def test_a_dataset_over_several_dimensions_is_every_tap_of_them():
    grid = xarray.Dataset(
        dict(d_mm=("whisker", [4.0, 7.0]), D_mm=10.0, L_a_mm=50.0, x_ss_mm=5.0, l_mm=2.0), coords=dict(theta_deg=[1.0, 4.0, 9.0], a_mm=("whisker", [30.0, 40.0])))
    table = vibrissa.sweep(tuples=grid, run=CPU).tuples
    assert len(table) == 6
    for row in range(6):
        expected = vibrissa.strain(10, table["d_tip_mm"][row], 50, 5, 2, table["a_mm"][row], table["theta_deg"][row])
        assert table["strain"][row] == pytest.approx(expected, rel=1e-6)
    assert sorted(zip(table["d_tip_mm"], table["a_mm"], table["theta_deg"])) == [(d, a, t) for d, a in ((4, 30), (7, 40)) for t in (1, 4, 9)]


def test_numbers_beside_columns_and_a_column_twice():
    one = vibrissa.sweep(tuples={**RIG, "D_mm": 10.0, "L_a_mm": 50, "l_mm": [2.0]}, run=CPU).tuples["strain"]
    assert one.tolist() == vibrissa.sweep(tuples=RIG, run=CPU).tuples["strain"].tolist()
    frame = pd.DataFrame(RIG)
    assert vibrissa.sweep(tuples=frame.iloc[1], run=CPU).tuples["strain"].tolist() == one.tolist()[1:]
    with pytest.raises(vibrissa.InputError, match="column hub_mm is there 2 times"):
        vibrissa.sweep(tuples=pd.concat([frame, frame[["hub_mm"]]], axis=1), run=CPU)


@pytest.mark.parametrize("bad", ["taps.csv", 3, [1.0, 2.0], np.zeros(3), pl.Series([1.0]), pa.array([1.0])])
def test_what_is_no_table_is_refused(bad):
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.sweep(tuples=bad, run=CPU)
    assert caught.value.key == "tuples" and "DataFrame" in caught.value.allowed


def test_units_of_properties():
    import pint

    ur = pint.get_application_registry()
    quantities = {**RIG, "hub_mm": [0.0, 0.4] * ur.cm, "E_MPa": [3.2e6, 3.0e6] * ur.Pa}
    assert vibrissa.sweep(tuples=quantities, run=CPU).tuples["strain"] == pytest.approx(vibrissa.sweep(tuples=RIG, run=CPU).tuples["strain"], rel=1e-9)
    for bad in (dict(hub_mm=[0.0, 4.0] * ur.s), dict(E_MPa=[3.2, 3.0] * ur.mm), dict(hub_mm=[0.0, np.nan])):
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.sweep(tuples={**RIG, **bad}, run=CPU)
        assert caught.value.key == f"tuples.{next(iter(bad))}"
    stiff = dict(PLAIN, k_y_N_per_mm=[2.0, 3.0])
    found = vibrissa.sweep(tuples={**stiff, "k_y_N_per_mm": [20.0, 30.0] * ur("N/cm")}, run=CPU).tuples["strain"]
    assert found == pytest.approx(vibrissa.sweep(tuples=stiff, run=CPU).tuples["strain"], rel=1e-9)


def test_what_the_engine_refuses_is_told_without_a_file_of_its_own():
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.sweep(tuples=dict(PLAIN, foil_N_per_mm=[100.0, 200.0]), run=CPU)
    assert caught.value.file is None and "foil" in str(caught.value) and "tuples.csv" not in str(caught.value)


def test_measurements_of_every_container():
    measured = vibrissa.simulate(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=2e-5), tap=dict(a=[21, 30, 39, 48], theta=[2, 4, 6]), seed=2).measurements
    frame = measured.to_pandas()[["a_mm", "theta_deg", "strain"]]
    calibrated = lambda data: vibrissa.calibrate(data, whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2)).K_table["K"].tolist()
    expected = calibrated(frame)
    for other in (frame.set_index("a_mm"), frame.to_xarray(), dict(frame), frame.to_records(index=False), pl.DataFrame(frame)):
        assert calibrated(other) == expected
    shuffled = frame["strain"].sample(frac=1, random_state=3)
    assert calibrated({**dict(frame), "strain": shuffled}) == expected
    with pytest.raises(vibrissa.InputError, match="labels"):
        calibrated({**dict(frame), "strain": frame["strain"].set_axis(range(1, len(frame) + 1))})


def test_rows_of_a_dataset_are_those_of_the_columns_that_are_read():
    measured = pd.DataFrame(dict(vibrissa.simulate(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30, 45], theta=[2, 4]), noise=1e-5).measurements))
    for extra in (lambda ds: ds.assign_coords(sample=np.arange(3)), lambda ds: ds.assign(wave=(("index", "sample"), np.zeros((len(measured), 4))))):
        found = vibrissa.calibrate(extra(measured.to_xarray()), whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2))
        assert found.run["counts"]["rows"] == len(measured)


def test_decimals_and_an_index_that_is_a_column_too_are_read():
    expected = vibrissa.sweep(tuples=PLAIN, run=CPU).tuples["strain"]
    frames = [pa.table(PLAIN).cast(pa.schema([(name, pa.decimal128(9, 3)) for name in PLAIN])), pl.DataFrame(PLAIN).cast(pl.Decimal(9, 3)),
              pd.DataFrame(PLAIN).set_index("theta_deg", drop=False)]
    for frame in frames:
        np.testing.assert_array_equal(vibrissa.sweep(tuples=frame, run=CPU).tuples["strain"], expected)
