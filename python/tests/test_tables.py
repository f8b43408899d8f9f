"""Tables: one memory for numpy, pandas, polars and pyarrow; missing values; words."""

import gc
import subprocess
import sys

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import vibrissa

CPU = dict(backend="cpu")


@pytest.fixture(scope="module")
def tuples():
    return vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[3, 30, 45], theta=[1, 20, 60]), run=CPU).tuples


def test_every_reader_sees_the_same(tuples):
    frames = tuples.to_pandas(), tuples.to_polars().to_pandas(), tuples.to_arrow().to_pandas(), pa.table(tuples).to_pandas(), pl.DataFrame(tuples).to_pandas()
    for frame in frames:
        assert list(frame.columns) == tuples.columns and len(frame) == len(tuples) == 9
        for name, kind in zip(tuples.columns, tuples.kinds()):
            if kind == "words":
                assert [None if x != x else x for x in frame[name].astype(object)] == tuples[name].tolist()
            else:
                np.testing.assert_array_equal(frame[name], tuples[name])
    assert tuples.to_arrow()["strain"].null_count == np.isnan(tuples["strain"]).sum() > 0
    assert len(set(tuples["status"])) > 2 and None in tuples["contact_state"]


def test_numbers_are_read_where_they_lie(tuples):
    address = tuples["strain"].__array_interface__["data"][0]
    frame = tuples.to_pandas()
    assert frame["strain"].to_numpy().__array_interface__["data"][0] == address
    assert tuples.to_arrow()["strain"].chunk(0).buffers()[1].address == address
    assert np.shares_memory(frame["strain"].to_numpy(), tuples["strain"])
    with pytest.raises(ValueError, match="read-only"):
        tuples["strain"][0] = 1
    copy = frame.copy()
    copy.loc[0, "strain"] = 1.0
    assert tuples["strain"][0] != 1.0


def test_a_column_outlives_its_table():
    column = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=np.linspace(0.5, 10, 5000)), run=CPU).tuples["strain"]
    before = column.copy()
    gc.collect()
    [np.ones(5000) for _ in range(100)]
    np.testing.assert_array_equal(column, before)


def test_arrow_outlives_its_table():
    table = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=[1, 2]), run=CPU).tuples
    arrow, expected = pa.table(table), table["strain"].copy()
    stream, schema = table.__arrow_c_stream__(), table.__arrow_c_schema__()
    assert pa.schema(table) == arrow.schema
    del table, stream, schema
    gc.collect()
    np.testing.assert_array_equal(arrow["strain"], expected)


def test_columns_have_names(tuples):
    assert "strain" in tuples and "stress" not in tuples
    with pytest.raises(KeyError, match="there are D_mm"):
        tuples["stress"]
    with pytest.raises(KeyError, match="column of numbers"):
        tuples.codes("strain")
    assert "9 rows" in repr(tuples)
    assert list(tuples) == tuples.keys() == tuples.columns and 3 not in tuples and None not in tuples
    columns = dict(tuples)
    assert list(columns) == tuples.columns and columns["strain"] is not None and len(columns["status"]) == 9
    with pytest.raises(KeyError, match="by its name, not for 0"):
        tuples[0]


def test_a_table_without_rows_has_its_columns():
    empty = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=3, theta=[60]), output=dict(top=1), run=CPU).designs
    assert len(empty) == 0 and "K_sd" in empty and empty.to_pandas()["K_sd"].dtype == float
    assert empty["status"].tolist() == [] and empty["n"].dtype == np.int64
    assert pa.table(empty).num_rows == 0


MEASURE = """
import sys
import numpy as np, pandas
import vibrissa
pandas.DataFrame({"x": pandas.Categorical(["a"])}, copy=False)
rows = int(float(sys.argv[1]))
# Not ru_maxrss: a process begins with that of the one that started it.
peak = lambda: int(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))) / 1024
result = vibrissa.sweep(whisker=dict(D=vibrissa.axis(9, 11, steps=rows // 1000), d=4, L_a=50), gauge=dict(x_ss=5, l=2),
                        tap=dict(a=vibrissa.axis(21, 48, steps=10), theta=vibrissa.axis(1, 10, steps=100)),
                        output=dict(designs=False, distances=False), run=dict(backend="cpu"))
table = 17 * 8 + 2 * 4
before = peak()
frame = result.tuples.to_pandas()
assert len(frame) == rows and np.shares_memory(frame["strain"].to_numpy(), result.tuples["strain"])
sums = frame["strain"].sum()
print(before, peak() - before, rows * table / 2**20)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_large_result_is_in_memory_once():
    done = subprocess.run([sys.executable, "-c", MEASURE, "1e6"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    _, more, table = map(float, done.stdout.split())
    # Codes of words are narrowed by pandas: 2 bytes of 144.
    assert more < 0.1 * table, f"pandas took {more:.0f} MB more, of a table of {table:.0f} MB"
