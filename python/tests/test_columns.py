"""Columns as labs have them: masked, missing, of other libraries, with words in them, next to a header in memory."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import vibrissa

WHISKER = dict(D=10, d=4, L_a=50)
GAUGE = dict(x_ss=5, l=2)


@pytest.fixture(scope="module")
def taps():
    sim = vibrissa.simulate(whisker=WHISKER, gauge=GAUGE, tap=dict(a=vibrissa.axis(21, 45, steps=7), theta=[2.0, 4.0]), repeats=3, noise=1e-5)
    return sim.measurements.to_pandas()[["a_mm", "theta_deg", "strain"]]


def calibrated(data):
    return vibrissa.calibrate(data, whisker=WHISKER, gauge=GAUGE)


def test_masked_values_are_missing(taps):
    wrong = taps["strain"].to_numpy().copy()
    wrong[3] = 99.0
    columns = {name: taps[name].to_numpy() for name in taps}
    masked = calibrated({**columns, "strain": np.ma.array(wrong, mask=np.arange(len(wrong)) == 3)})
    missing = calibrated({**columns, "strain": np.where(np.arange(len(wrong)) == 3, np.nan, wrong)})
    assert masked.text == missing.text


def test_tables_of_arrow_are_those_of_pandas(taps):
    taps = taps.assign(fault=pd.Series([None] * len(taps), dtype=object))
    table = pa.Table.from_pandas(taps, preserve_index=False)
    held = [calibrated(data).text for data in (table, table.to_batches()[0])]
    assert held[0] == held[1]
    assert len(calibrated({"a_mm": taps["a_mm"], "theta_deg": taps["theta_deg"], "strain": taps["strain"],
                           "n": pd.array(["x", pd.NA] * (len(taps) // 2), dtype="string")}).text) > 0


def test_words_with_line_ends_stay_in_their_row(taps):
    assert calibrated(taps.assign(note='a,b\nc"d')).run["result"] == calibrated(taps.assign(note="x")).run["result"]


def test_arrays_that_are_not_aligned():
    distances = np.array([21.0, 30.0, 48.0])
    odd = np.frombuffer(b"\0" + distances.tobytes(), "f8", offset=1)
    assert np.array_equal(vibrissa.strain(10, 4, 50, 5, 2, odd, 4.0), vibrissa.strain(10, 4, 50, 5, 2, distances, 4.0))


def test_words_of_a_status():
    one = vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, full=True).status
    assert vibrissa.status_words(one)[()] == "ok"
    assert vibrissa.status_words(2048)[()] == "inconsistent"
    assert vibrissa.status_words([[1, 96]]).tolist() == [["invalid_geometry", "strain_limit+no_root"]]
    for wrong in ([1.5], [4096], [-1], float("nan"), "ok"):
        with pytest.raises(vibrissa.InputError):
            vibrissa.status_words(wrong)
