"""Located readings bring the user's own columns back as they were; the best row is none that failed."""

import copy
import pickle

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import vibrissa

RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5))
TIMES = np.array([1763877249123456789, 1763877249123456790, 1763877249123456791, 1763877249123456792])
OWN = dict(
    specimen=["007", "nan", "NaN", "1e3"], note=["", " a, b", 'say "7"', "#4\nmore"], time=TIMES.view("M8[ns]"), stamp=TIMES, span=TIMES.view("m8[ns]") - TIMES[0].view("m8[ns]"),
    good=[True, False, True, True], x=[0.1, np.nan, -0.0, 1e300], n=[1, 2, 3, 4], day=np.array(["2026-01-01", "2026-01-02", "NaT", "1969-12-31"], "M8[D]"), huge=[2**60 + 1, None, 3, 4],
    exact=np.array([2**63 + 1, 1, 2, 3], np.uint64), pair=[1 + 2j, 0j, 1j, 2])
READINGS = dict(theta_deg=[4.0, 4.0, 8.0, 4.0], strain=[0.02, 0.021, 0.05, np.nan])


@pytest.fixture(scope="module")
def calibration():
    return vibrissa.calibrate(vibrissa.simulate(**RIG, tap=dict(a=range(21, 49, 3), theta=[2, 4, 8]), repeats=3), **RIG)


@pytest.fixture(scope="module")
def answers(calibration):
    """What gives a table of these columns, each with the readings of one whisker."""
    pose = dict(base_x_mm=[0.0, 1.0, 2.0, 3.0], base_y_mm=[0.0] * 4, heading_deg=[90.0] * 4)
    array = vibrissa.Array([dict(name="left", calibration=calibration, x=0, y=0, heading=0)])
    return [calibration.locator().table, lambda data: array.locate(with_columns(data, whisker=["left"] * 4)),
            lambda data: vibrissa.contour(with_columns(data, **pose), calibration).points]


def with_columns(data, **more):
    if isinstance(data, pd.DataFrame):
        return data.assign(**more)
    if isinstance(data, pl.DataFrame):
        return data.with_columns(*(pl.Series(name, column) for name, column in more.items()))
    if isinstance(data, pa.Table):
        for name, column in more.items():
            data = data.append_column(name, pa.array(column))
        return data
    return {**data, **more}


@pytest.mark.parametrize("kind", [dict, pd.DataFrame, pl.DataFrame, pa.table], ids=["dict", "pandas", "polars", "arrow"])
@pytest.mark.parametrize("which", range(3), ids=["table", "array", "contour"])
def test_own_columns_are_kept(which, kind, answers, calibration):
    own = {name: column for name, column in OWN.items() if kind in (dict, pd.DataFrame) or name not in ("pair", "day", "note")}
    found = answers[which](kind({**READINGS, **own}))
    assert found["specimen"].tolist() == OWN["specimen"]
    for name, dtype in (("time", "M8[ns]"), ("stamp", "i8"), ("span", "m8[ns]")):
        assert found[name].dtype == np.dtype(dtype)
        np.testing.assert_array_equal(found[name], OWN[name])
    assert found["good"].dtype == bool and found["good"].tolist() == OWN["good"] and found["n"].tolist() == OWN["n"]
    np.testing.assert_array_equal(found["x"], OWN["x"])
    assert np.signbit(found["x"][2])
    if kind is not pd.DataFrame:
        assert found["huge"].tolist() == ["1152921504606846977", None, "3", "4"]
    assert found["exact"].tolist() == ["9223372036854775809", "1", "2", "3"]
    if "note" in own:
        assert found["note"].tolist() == OWN["note"] and found["pair"].tolist()[0] == "(1+2j)"
        np.testing.assert_array_equal(found["day"], OWN["day"].astype("M8[s]"))
    # The answers are those of the readings alone.
    np.testing.assert_array_equal(found["distance_mm"], calibration.locator().table(READINGS)["distance_mm"])
    assert found["status"].tolist()[::3] == ["ok", "bad_input"]
    kinds = dict(zip(found.columns, found.kinds()))
    assert [kinds[name] for name in ("specimen", "time", "stamp", "good", "x", "distance_mm")] == ["words", "time", "count", "flag", "number", "number"]
    # Other readers see the same, and so does a copy.
    arrow = found.to_arrow()
    assert arrow["time"].to_numpy().tolist() == TIMES.tolist() and arrow["specimen"].to_pylist() == OWN["specimen"] and arrow["good"].to_pylist() == OWN["good"]
    assert found.to_polars()["stamp"].to_list() == TIMES.tolist() and found.to_polars()["specimen"].to_list() == OWN["specimen"]
    assert found.to_pandas()["specimen"].tolist() == OWN["specimen"] and (found.to_pandas()["time"].to_numpy() == OWN["time"]).all()
    for way in (lambda x: pickle.loads(pickle.dumps(x)), copy.deepcopy):
        again = way(found)
        assert again.to_arrow().equals(arrow) and again.kinds() == found.kinds()
        pd.testing.assert_frame_equal(again.to_pandas(), found.to_pandas())


@pytest.mark.parametrize("index", [
    pd.Index(["r1", "r2", "r2", "r9"], name="row"), pd.MultiIndex.from_product([["a", "b"], [1, 2]]), pd.DatetimeIndex(TIMES, tz="Europe/Berlin"), pd.RangeIndex(3, -1, -1), None],
    ids=["words", "levels", "times", "range", "default"])
@pytest.mark.parametrize("which", range(3), ids=["table", "array", "contour"])
def test_a_frame_keeps_its_types_and_its_index(which, index, answers):
    frame = pd.DataFrame({**READINGS, **OWN}, index=index)
    frame = frame.assign(
        zoned=pd.DatetimeIndex(TIMES, tz="Asia/Tokyo"), kind=pd.Categorical(["x", "y", "x", None], categories=["y", "x"]), whole=pd.array([2**60 + 1, None, 3, 4], dtype="Int64"),
        small=np.array([0.1, 0.2, 0.3, 0.4], np.float32), line=[9, 8, 7, 6], ok=pd.array([True, None, False, True], dtype="boolean"), things=pd.Series([{"a": 1}, None, [2], 3.5], index=frame.index))
    before = frame.copy()
    found = answers[which](frame)
    back = found.to_pandas()
    assert back.index.equals(frame.index) and back.index.names == frame.index.names
    for name in frame:
        pd.testing.assert_series_equal(back["given_line" if name == "line" else name], frame[name], check_names=False)
    assert list(back["line"]) == [2, 3, 4, 5] and back["distance_mm"].iloc[0] == found["distance_mm"][0]
    joined = frame.reset_index(drop=True).join(back.reset_index(drop=True)["distance_mm"])
    np.testing.assert_array_equal(joined["distance_mm"], found["distance_mm"])
    pd.testing.assert_frame_equal(frame, before)
    # What happens to the frame later is nothing to the table.
    frame.loc[:, "specimen"] = "other"
    assert found.to_pandas()["specimen"].tolist() == OWN["specimen"]


def test_words_of_a_file_are_categories(calibration, tmp_path):
    path, words = tmp_path / "readings.csv", [f"w{i % 60}" if i % 9 else "" for i in range(120)]
    path.write_text("theta_deg,strain,note\n" + "".join(f"4,0.02,{word}\n" for word in words))
    found = calibration.locator().table(path)
    assert found.to_pandas()["note"].astype(object).fillna("").tolist() == words
    assert found["note"].tolist() == [word or None for word in words]


def test_own_columns_of_a_file(calibration, tmp_path):
    path = tmp_path / "readings.csv"
    path.write_text("theta_deg,strain,specimen,stamp,word,mixed,x,id\n4,0.02,007,1763877249123456789,nan,1763877249123456789,1.50,0\n4,0.021,010,1763877249123456790,up,,2e3,10\n")
    found = calibration.locator().table(path)
    assert found["specimen"].tolist() == ["007", "010"] and found["word"].tolist() == ["nan", "up"]
    assert found["stamp"].tolist() == TIMES[:2].tolist() and found["mixed"].tolist() == ["1763877249123456789", None]
    assert found["x"].tolist() == [1.5, 2000.0] and found["x"].dtype == float and found["id"].tolist() == [0.0, 10.0]


def test_lists_of_several_kinds_are_kept(calibration):
    found = calibration.locator().table({**READINGS, "specimen": ["007", np.nan, 8, None], "flag": [True, 2.5, False, None], "t": [2**53 + 1, 2**60 + 1, 1, 0]})
    assert found["specimen"].tolist() == ["007", None, "8", None] and found["flag"].tolist() == ["True", "2.5", "False", None]
    assert found["t"].tolist() == [2**53 + 1, 2**60 + 1, 1, 0]
    with pytest.raises(vibrissa.InputError):
        vibrissa.calibrate(dict(a_mm=[21.0, True], theta_deg=[4.0, 4.0], strain=[0.02, 0.01]))


def test_a_table_is_no_array_of_readings(calibration):
    locator = calibration.locator()
    for table in (pd.DataFrame(READINGS), READINGS):
        with pytest.raises(vibrissa.InputError) as caught:
            locator.locate(table)
        assert caught.value.key == "reading" and "table" in caught.value.allowed


def test_the_best_row_is_none_that_failed():
    swept = vibrissa.sweep(whisker=dict(D=10, d=[4, 7, 10], L_a=[25, 50]), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30, 40], theta=[1, 4, 60]), run=dict(backend="cpu"))
    designs = swept.designs.to_pandas()
    assert designs["K_sd"].isna().any() and np.isnan(swept.designs["K_sd"][swept.designs["K_sd"].argmin()])
    for by in ("K_sd", "total_rms_mm", "error_max_mm", "strain_max", "force_max_N"):
        best = swept.best(by=by)
        whole = designs[designs["n"] == 3].dropna(subset=[by])
        assert best == {name: value for name, value in swept.designs.to_pandas().loc[whole[by].idxmin()].items()} and best["status"] in ("ok", "strain_limit")
        # As the engine ranks.
        top = vibrissa.sweep(whisker=dict(D=10, d=[4, 7, 10], L_a=[25, 50]), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30, 40], theta=[1, 4, 60]),
                             output=dict(top=1, by=by), run=dict(backend="cpu")).designs
        assert {name: top[name][0] for name in top.columns} == best
    # A row of which a tap failed may have the smallest spread of the others.
    some = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[3, 30, 40], theta=[1, 4]), run=dict(backend="cpu"))
    with pytest.raises(vibrissa.RunError, match="no_strain"):
        some.best()
    assert vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30], theta=4), estimate=dict(convention="elongation"), run=dict(backend="cpu")).best()["K_sd_mm"] > 0
    for by in ("status", "beauty", 3, None):
        with pytest.raises(vibrissa.InputError) as caught:
            swept.best(by=by)
        assert caught.value.key == "by" and "K_sd" in caught.value.allowed
    without = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30], theta=4), output=dict(designs=False), run=dict(backend="cpu"))
    with pytest.raises(vibrissa.InputError) as caught:
        without.best()
    assert caught.value.key == "output.designs"


def test_the_best_row_is_within_the_strain_limit():
    for limit in (0.05, 0.02):
        swept = vibrissa.sweep(whisker=dict(D=10, d=[2, 4, 6], L_a=80), gauge=dict(x_ss=[5, 10], l=2, noise_strain=15e-6, strain_limit=limit), tap=dict(a=[25, 40, 70], theta=[2, 6, 10]),
                               model=dict(surface=True, shear=True, extension=True), estimate=dict(theory="exact"), run=dict(backend="cpu"))
        designs = swept.designs.to_pandas()
        within = designs[designs["strain_max"] <= limit]
        assert 0 < len(within) < len(designs)
        best = swept.best(by="total_rms_mm")
        assert best["total_rms_mm"] == within["total_rms_mm"].min() > designs["total_rms_mm"].min() and best["status"] == "ok"
    # Where no row keeps it, the best of all is told, with its word.
    swept = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, strain_limit=1e-5), tap=dict(a=[21, 30], theta=[1, 4]), run=dict(backend="cpu"))
    assert swept.best()["theta_deg"] == 1 and swept.best()["status"] == "strain_limit"
