"""Labelled arrays are paired by their labels, and answers have them."""

import numpy as np
import pandas as pd
import pytest
import xarray

import vibrissa

RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5))
PLACES = [22.0, 30.0, 41.0]
A = pd.Series(PLACES, index=["x", "y", "z"], name="a")
THETA = pd.Series([2.0, 4.0, 6.0], index=["x", "y", "z"])


def strain(a, theta, **more):
    return vibrissa.strain(10, 4, 50, 5, 2, a, theta, **more)


def refused(call, *parts):
    with pytest.raises(vibrissa.InputError) as caught:
        call()
    assert caught.value.allowed and all(part in str(caught.value) for part in parts), str(caught.value)


EXPECTED = [strain(a, theta) for a, theta in zip(PLACES, [2.0, 4.0, 6.0])]


def test_a_series_in_is_a_series_out():
    for a, theta in ((A, THETA), (A, THETA.iloc[::-1]), (A, [2.0, 4.0, 6.0]), (PLACES, THETA)):
        found = strain(a, theta)
        assert isinstance(found, pd.Series) and found.to_dict() == pytest.approx(dict(zip("xyz", EXPECTED)), rel=1e-12)
    # In the order of the first.
    assert list(strain(A.iloc[::-1], THETA).index) == ["z", "y", "x"]
    one = strain(A, 4.0)
    assert isinstance(one, pd.Series) and one["y"] == pytest.approx(strain(30, 4.0), rel=1e-12)
    assert list(strain(A.iloc[:0], 4.0).index) == []


def test_every_answer_of_a_tap_has_the_labels():
    tap, jacobian = strain(A, THETA.iloc[::-1], full=True, grad=("a", "theta"))
    for name in ("strain", "K", "normal_force_N", "contact_arc_mm", "status", "sticks"):
        assert list(getattr(tap, name).index) == ["x", "y", "z"], name
    assert list(jacobian.strain.columns) == ["a", "theta"] and list(jacobian.strain.index) == ["x", "y", "z"]
    by_theta = strain(30, 4.0, grad="theta")[1][0]
    assert jacobian.strain.loc["y", "theta"] == pytest.approx(by_theta, rel=1e-9)
    words = vibrissa.status_words(tap.status)
    assert words.to_dict() == dict.fromkeys("xyz", "ok")


def test_series_whose_labels_differ_are_refused():
    refused(lambda: strain(A, THETA.set_axis(["x", "y", "w"])), "theta", "labels")
    refused(lambda: strain(A, THETA.iloc[:2]), "theta", "'z'")
    refused(lambda: strain(A.set_axis(["x", "x", "y"]), THETA.set_axis(["x", "y", "x"])), "more than once")
    # The same labels in the same order are no question, also where one is there twice.
    assert list(strain(A.set_axis(["x", "x", "y"]), THETA.set_axis(["x", "x", "y"]))) == pytest.approx(EXPECTED)
    refused(lambda: strain(A, xarray.DataArray([2.0, 4.0, 6.0], dims="k")), "xarray", "pandas")
    # An array that is wider has places without a label; one value goes with every place.
    refused(lambda: strain(A, np.ones((2, 3))), "theta", "labels")
    assert strain(A.iloc[:1], [2.0, 4.0]).shape == (2,)


def test_frames_of_one_shape():
    a = pd.DataFrame([[22.0, 30.0], [41.0, 35.0]], index=[1, 2], columns=["l", "r"])
    theta = pd.DataFrame([[6.0, 5.0], [4.0, 2.0]], index=[2, 1], columns=["l", "r"])
    found = strain(a, theta)
    assert found.loc[2, "l"] == pytest.approx(strain(41, 6.0), rel=1e-12) and found.loc[1, "r"] == pytest.approx(strain(30, 2.0), rel=1e-12)
    slopes = strain(a, theta, grad=("a", "theta"))[1]
    assert list(slopes.index) == [1, 2] and slopes.loc[2, ("l", "theta")] == pytest.approx(strain(41, 6.0, grad="theta")[1][0], rel=1e-9)
    refused(lambda: strain(a, theta["l"]), "Series", "DataFrame")


def test_data_arrays_are_paired_by_their_dimensions():
    a = xarray.DataArray(PLACES, dims="place", coords=dict(place=["x", "y", "z"]), attrs=dict(units="mm"))
    theta = xarray.DataArray([1.0, 4.0, 9.0], dims="drive")
    found = strain(a, theta)
    assert found.dims == ("place", "drive") and list(found.place.values) == ["x", "y", "z"] and not found.attrs
    for i, x in enumerate(PLACES):
        for k, t in enumerate([1.0, 4.0, 9.0]):
            assert found.values[i, k] == pytest.approx(strain(x, t), rel=1e-9)
    same = strain(a, xarray.DataArray([6.0, 4.0, 2.0], dims="place", coords=dict(place=["z", "y", "x"])))
    assert list(same.values) == pytest.approx(EXPECTED) and same.dims == ("place",)
    beside = strain(a, [2.0, 4.0, 6.0])
    assert beside.dims == ("place",) and list(beside.values) == pytest.approx(EXPECTED)
    value, slopes = strain(a, 4.0, grad=("a", "theta"))
    assert slopes.dims == ("place", "by") and list(slopes.by.values) == ["a", "theta"]
    assert slopes.sel(place="y", by="theta").item() == pytest.approx(strain(30, 4.0, grad="theta")[1][0], rel=1e-9)
    refused(lambda: strain(a, xarray.DataArray([2.0, 4.0, 6.0], dims="place", coords=dict(place=["x", "y", "w"]))), "theta", "labels")
    refused(lambda: strain(a.rename(place="by"), 4.0, grad="a"), "grad", "rename")
    refused(lambda: strain(a, xarray.DataArray([2.0, 4.0], dims="place")), "fit")
    refused(lambda: vibrissa.strain(10, [4, 5, 6], 50, 5, 2, a, theta), "d", "dimensions")


@pytest.fixture(scope="module")
def calibration():
    tap = dict(a=vibrissa.axis(21, 45, steps=7), theta=[1, 2, 4, 6])
    return vibrissa.calibrate(vibrissa.simulate(**RIG, tap=tap, repeats=3, seed=4), **RIG)


def test_readings_and_distances(calibration):
    readings = pd.Series(EXPECTED, index=["x", "y", "z"])
    found = calibration.locator().locate(THETA, readings.iloc[::-1])
    for name in found._fields:
        assert list(getattr(found, name).index) == ["x", "y", "z"], name
    assert found.distance_mm.to_numpy() == pytest.approx(PLACES, abs=0.5)
    refused(lambda: calibration.locator().locate(THETA, readings.set_axis([0, 1, 2])), "reading", "labels")
    array = calibration.locator().locate(xarray.DataArray([2.0, 4.0, 6.0], dims="k"), xarray.DataArray(EXPECTED, dims="k"))
    assert array.distance_mm.dims == ("k",)
    told = vibrissa.distance(readings, THETA.iloc[::-1], **RIG)
    assert told.distance_mm.to_dict() == pytest.approx(dict(zip("xyz", PLACES)), abs=1e-3)


def test_channels_by_their_names():
    rig = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), sensor=dict(signal=["moment", "force"], noise=[0.01, 0.001]))
    measured = vibrissa.simulate(**rig, tap=dict(a=vibrissa.axis(21, 45, steps=7), theta=[1, 2, 4, 6]), repeats=3, seed=4)
    locator = vibrissa.calibrate(measured, **rig).locator()
    frame = measured.to_pandas()
    frame = frame[frame["a_mm"] == 33][["theta_deg", *locator.channels]]
    by_place = locator.locate(frame["theta_deg"].to_numpy(), frame[locator.channels].to_numpy())
    swapped = frame[locator.channels[::-1]]
    for readings in (swapped, dict(swapped), swapped.to_records(index=False), xarray.DataArray(swapped.to_numpy(), dims=("k", "of"), coords={"of": locator.channels[::-1]})):
        drive = frame["theta_deg"] if isinstance(readings, (pd.DataFrame, dict)) else frame["theta_deg"].to_numpy()
        found = locator.locate(drive, readings)
        assert np.asarray(found.distance_mm).tolist() == by_place.distance_mm.tolist()
    one = locator.locate(float(frame["theta_deg"].iloc[0]), swapped.iloc[0])
    assert one.distance_mm == by_place.distance_mm[0]
    refused(lambda: locator.locate(4.0, frame), "channels")


def test_a_coordinate_that_differs_between_arguments_is_left_out_and_no_other():
    places = xarray.Dataset({"a": (("run", "p"), [[20.0, 30.0], [25.0, 35.0]]), "theta": (("run", "p"), [[1.0, 2.0], [3.0, 4.0]])}, coords={"run": [1, 2], "p": ["a", "b"]})
    found = strain(places.a.sel(run=1), places.theta.sel(run=2))
    assert list(found.coords) == ["p"] and found.p.values.tolist() == ["a", "b"]
    assert list(strain(places.a.sel(run=1), places.theta.sel(run=1)).coords) == ["run", "p"]
