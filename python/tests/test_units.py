"""Quantities with units are converted to the unit of their key, or refused with key, value and unit: never read as bare numbers."""

import datetime
import warnings

import astropy.table
import astropy.units as u
import dask.array
import numpy as np
import pandas as pd
import pint
import pint_pandas  # noqa: F401  (columns with units)
import pytest
import quantities as pq
import unyt
import xarray

import vibrissa

ur = pint.get_application_registry()
GOOD = dict(D=10.0, d=4.0, L_a=50.0, x_ss=5.0, l=2.0, a=30.0, theta=4.0)
RIG = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5))
CPU = dict(backend="cpu")


def unyted(value, unit):
    return unyt.unyt_array(value, unit)


MAKERS = [lambda x, unit: x * ur(unit), lambda x, unit: x * u.Unit(unit), lambda x, unit: pq.Quantity(x, unit), unyted]
NAMES = ["pint", "astropy", "quantities", "unyt"]
of_libraries = pytest.mark.parametrize("quantity", MAKERS, ids=NAMES)


def strain(**changes):
    return vibrissa.strain(**{**GOOD, **changes})


def refused(call, key, *parts):
    with pytest.raises(vibrissa.InputError) as caught:
        call()
    e = caught.value
    assert e.key == key and e.allowed, str(e)
    for part in parts:
        assert part in str(e), f"{part} is not in {e}"


@of_libraries
def test_lengths_and_angles_are_converted(quantity):
    for key in ("D", "d", "L_a", "x_ss", "l", "a"):
        for unit, size in (("cm", 10.0), ("m", 1000.0), ("mm", 1.0)):
            assert strain(**{key: quantity(GOOD[key] / size, unit)}) == pytest.approx(strain(), rel=1e-5)
            assert strain(**{key: quantity(np.full(3, GOOD[key] / size), unit)}) == pytest.approx([strain()] * 3, rel=1e-5)
    assert strain(theta=quantity(np.deg2rad(4.0), "rad")) == pytest.approx(strain(), rel=1e-5)
    assert strain(theta=quantity(4.0, "deg")) == strain()
    assert strain(tilt=quantity(0.2, "rad"), lean=quantity(3.0, "deg")) == pytest.approx(strain(tilt=np.rad2deg(0.2), lean=3.0), rel=1e-5)
    assert vibrissa.strain(10, 4, 50, 5, 2, 30, delta=quantity(0.2, "cm")) == vibrissa.strain(10, 4, 50, 5, 2, 30, delta=2.0)
    # In lists, nested ones and arrays of objects; beside plain numbers, which are in mm.
    few = [quantity(1.0, "cm"), 12, quantity(11.0, "mm")]
    objects = np.empty(3, dtype=object)
    objects[:] = [few[0], 12, 11]
    for mixed in (few, tuple(few), [few], objects):
        np.testing.assert_array_equal(np.ravel(strain(D=mixed)), strain(D=[10.0, 12.0, 11.0]))


@of_libraries
def test_what_does_not_convert_is_named(quantity):
    refused(lambda: strain(D=quantity(1.0, "s")), "D", "mm")
    refused(lambda: strain(D=[10.0, quantity(1.0, "s")]), "D", "mm")
    refused(lambda: strain(theta=quantity(1.0, "mm")), "theta", "degrees")
    refused(lambda: strain(a=quantity(0.5, "rad")), "a", "mm")
    refused(lambda: strain(nu=quantity(0.3, "mm")), "model.nu", "pure number")
    # A pure number is no angle, and an angle no pure number, whatever a library takes radians for.
    refused(lambda: strain(theta=quantity(4.0, "deg") / quantity(1.0, "deg")), "theta", "degrees")
    refused(lambda: strain(nu=quantity(0.3, "rad")), "model.nu", "pure number")


@of_libraries
def test_sections_of_a_spec_are_converted(quantity):
    said = dict(
        whisker=dict(D=quantity(1.0, "cm"), d=[quantity(4.0, "mm"), 0.7 * quantity(1.0, "cm")], L_a=vibrissa.axis(quantity(5.0, "cm"), quantity(0.06, "m"), steps=2)),
        gauge=dict(x_ss=quantity(5.0, "mm"), l=2, noise_strain=quantity(20.0, "um") / quantity(1.0, "m")),
        tap=dict(a=quantity(np.array([2.1, 3.0]), "cm"), theta=[quantity(0.07, "rad"), quantity(4.0, "deg")]),
        model=dict(material={"mooney-rivlin": [quantity(350.0, "kPa"), quantity(0.15, "MPa")]}, pole_radius=quantity(0.2, "cm"), surface=True),
        optimise=dict(limits=dict(force_N=quantity(1.0, "kN")), budget=dict(seconds=quantity(1.0, "min")), variables=dict(D=[quantity(0.8, "cm"), 12]),
                      robust=dict(x_ss=quantity(0.03, "cm"), theta=quantity(0.01, "rad"))))
    plain = vibrissa.spec_text(**said)
    result = vibrissa.sweep(**{name: keys for name, keys in said.items() if name != "optimise"}, run=CPU)
    assert set(result.designs["D_mm"]) == {10.0} and np.allclose(sorted(set(result.designs["d_tip_mm"])), [4, 7])
    assert np.allclose(sorted(set(result.designs["L_a_mm"])), [50, 60]) and np.allclose(sorted(set(result.tuples["a_mm"])), [21, 30])
    assert np.allclose(sorted(set(result.tuples["theta_deg"])), [4, np.rad2deg(0.07)])
    assert float(plain.split("noise_strain = ")[1].split()[0]) == pytest.approx(2e-5)
    for part in ("force_N = 1000", "seconds = 60", "0.35", "0.15", "pole_radius = 2", "theta = 0.57295"):
        assert part in plain, plain
    for sections, key, unit in [
        (dict(whisker=dict(D=quantity(1.0, "s"))), "whisker.D", "mm"),
        (dict(whisker=dict(D=[1, quantity(1.0, "s")])), "whisker.D", "mm"),
        (dict(whisker=dict(D=vibrissa.axis(1, quantity(9.0, "s"), steps=3))), "whisker.D.to", "mm"),
        (dict(model=dict(material={"hooke": quantity(1.0, "mm")})), "model.material.hooke", "MPa"),
        (dict(gauge=dict(noise_strain=quantity(1.0, "mm"))), "gauge.noise_strain", "pure number"),
        (dict(optimise=dict(limits=dict(force_N=quantity(1.0, "mm")))), "optimise.limits.force_N", "N"),
        (dict(whisker=dict(width=quantity(1.0, "mm"))), "whisker.width", "none is known"),
    ]:
        refused(lambda: vibrissa.spec_text(**sections), key, unit)


@pytest.fixture(scope="module")
def desk():
    measured = vibrissa.simulate(**RIG, tap=dict(a=range(21, 49, 3), theta=[2, 4, 8]), repeats=3)
    return measured.measurements, vibrissa.calibrate(measured, **RIG)


@of_libraries
def test_measurements_are_converted(quantity, desk):
    taps, calibration = desk
    one = quantity(1.0, "mm") / quantity(1.0, "mm")
    columns = dict(a_mm=quantity(taps["a_mm"] / 10, "cm"), theta_deg=quantity(np.deg2rad(taps["theta_deg"]), "rad"), strain=taps["strain"] * one)
    again = vibrissa.calibrate(columns, **RIG)
    assert again.estimator == calibration.estimator
    assert again.result["noise_strain" if "noise_strain" in again.result else "noise"] == pytest.approx(calibration.result["noise_strain" if "noise_strain" in again.result else "noise"], rel=1e-6)
    locator, near = calibration.locator(), dict(rel=1e-6)
    expected = locator.locate(4.0, 0.02).distance_mm
    angle = quantity(np.deg2rad(4.0), "rad")
    assert locator.locate(angle, 0.02 * one).distance_mm == pytest.approx(expected, **near)
    assert locator.locate([angle], quantity(20000.0, "um") / quantity(1.0, "m")).distance_mm == pytest.approx([expected], **near)
    assert next(iter(locator.stream([(angle, 0.02)]))).distance_mm == pytest.approx(expected, **near)
    assert locator.expected(quantity(3.0, "cm"), angle) == pytest.approx(locator.expected(30.0, 4.0), **near)
    for table, names in [
        (dict(theta_deg=quantity(np.deg2rad([4.0, 4.0]), "rad"), strain=[0.02, 0.021]), None),
        (dict(ang=quantity(np.deg2rad([4.0, 4.0]), "rad"), strain=[0.02, 0.021]), dict(theta="ang")),
        (dict(ang=quantity(np.deg2rad([4.0, 4.0]), "rad"), eps=[0.02, 0.021] * one), "theta=ang, strain=eps"),
        (dict(theta_deg=[4.0, 4.0], microstrain=[0.02, 0.021] * one), None),
    ]:
        assert locator.table(table, columns=names)["distance_mm"][0] == pytest.approx(expected, **near)
    refused(lambda: locator.locate(quantity(4.0, "mm"), 0.02), "drive", "degrees")
    refused(lambda: locator.locate(4.0, quantity(4.0, "mm")), "reading", "pure number")
    refused(lambda: list(locator.stream([(quantity(4.0, "s"), 0.02)])), "readings", "degrees")
    refused(lambda: locator.table(dict(theta_deg=quantity([4.0], "s"), strain=[0.02])), "theta_deg", "degrees")
    refused(lambda: vibrissa.calibrate({**columns, "a_mm": quantity(taps["a_mm"], "s")}, **RIG), "a_mm", "mm")
    # What a sensor shows, and the zero of it, have no unit that is known.
    refused(lambda: vibrissa.calibrate(dict(a_mm=[1.0], theta_deg=[1.0], reading=quantity([1.0], "V"))), "reading", "none is known")
    refused(lambda: vibrissa.Locator(calibration, zero=quantity(1.0, "V")), "zero", "none is known")
    refused(lambda: vibrissa.simulate(**RIG, tap=dict(a=30, theta=4), drive_offset=quantity(1.0, "deg")), "drive_offset", "none is known")


@of_libraries
def test_other_arguments_are_converted(quantity, desk):
    _, calibration = desk
    tap = dict(a=30, theta=4)
    offset = [vibrissa.simulate(**RIG, tap=tap, noise=0, a_offset=x).measurements["strain"] for x in (quantity(0.1, "cm"), 1.0)]
    np.testing.assert_array_equal(*offset)
    poses = dict(base_x_mm=quantity([0.0, 0.1], "cm"), base_y_mm=[0.0, 0.0], heading_deg=quantity([0.5 * np.pi] * 2, "rad"), theta_deg=[4.0, 4.0], strain=[0.02, 0.021])
    points = vibrissa.contour(poses, calibration, angle_noise=quantity(0.1, "deg"), base_noise=quantity(1e-4, "m")).points
    plain = vibrissa.contour({**poses, "base_x_mm": [0.0, 1.0], "heading_deg": [90.0, 90.0]}, calibration, base_noise=0.1).points
    np.testing.assert_allclose(points["x_mm"], plain["x_mm"])
    np.testing.assert_allclose(points["sigma_major_mm"], plain["sigma_major_mm"], rtol=1e-6)
    where = dict(name="left", calibration=calibration, x=0, y=quantity(4.0, "cm"), heading=quantity(0.5 * np.pi, "rad"))
    reading = dict(whisker=["left"], theta_deg=[4.0], strain=[0.02])
    found = vibrissa.Array([where]).locate(reading)["y_mm"]
    np.testing.assert_allclose(found, vibrissa.Array([{**where, "y": 40.0, "heading": 90.0}]).locate(reading)["y_mm"])
    refused(lambda: vibrissa.Array([{**where, "x": quantity(1.0, "s")}]), "whisker.x", "mm")
    refused(lambda: vibrissa.contour(poses, calibration, angle_noise=quantity(1.0, "mm")), "angle_noise", "degrees")
    taps = dict(D_mm=quantity([1.0], "cm"), d_mm=[4.0], L_a_mm=[50.0], x_ss_mm=[5.0], l_mm=[2.0], a_mm=quantity([0.03], "m"), theta_deg=[4.0])
    listed = vibrissa.sweep(tuples=taps, run=CPU).tuples
    assert listed["D_mm"][0] == 10.0 and listed["a_mm"][0] == 30.0
    refused(lambda: vibrissa.sweep(tuples={**taps, "D_mm": quantity([1.0], "s")}, run=CPU), "tuples.D", "mm")


def test_frames_with_units(desk):
    _, calibration = desk
    locator = calibration.locator()
    frame = pd.DataFrame(dict(theta_deg=pd.Series(np.deg2rad([4.0, 8.0]), dtype="pint[rad]"), strain=[0.02, 0.05], warm=pd.Series([20.0, 21.0], dtype="pint[kelvin]")))
    frame.index = ["a", "b"]
    found = locator.table(frame).to_pandas()
    plain = locator.table(pd.DataFrame(dict(theta_deg=[4.0, 8.0], strain=[0.02, 0.05])))
    np.testing.assert_allclose(found["distance_mm"], plain["distance_mm"])
    np.testing.assert_allclose(found["theta_deg"], [4.0, 8.0])
    assert list(found.index) == ["a", "b"] and "20.0" in found["warm"].iloc[0] and "kelvin" in found["warm"].iloc[0]
    # As objects, too; times and quantities of whatever is not read are the user's.
    things = pd.DataFrame(dict(theta_deg=pd.Series([np.deg2rad(4.0) * ur.rad, 8.0], dtype=object), strain=[0.02, 0.05], when_s=np.array([1, 2], "M8[ns]"), dt_mm=[True, False]))
    found = locator.table(things).to_pandas()
    np.testing.assert_allclose(found["distance_mm"], plain["distance_mm"])
    assert found["theta_deg"].tolist() == pytest.approx([4.0, 8.0]) and found["when_s"].dtype == "M8[ns]" and found["dt_mm"].dtype == bool
    waited = locator.table(dict(theta_deg=[4.0, 8.0], strain=[0.02, 0.05], wait_s=[1.0, 2.0] * u.min, kind_mm=[1.0, 2.0] * u.V, ang=[1, 2] * u.s), columns=dict(ignore="ang"))
    assert waited["wait_s"].tolist() == [60.0, 120.0] and waited["kind_mm"].tolist() == ["1.0 V", "2.0 V"] and waited["ang"].tolist() == ["1.0 s", "2.0 s"]
    for name, column in (("theta_deg", np.array([1, 2], "m8[ns]")), ("strain", [True, False]), ("theta_deg", np.array([1j, 2j])), ("strain", pd.Series([True, False]))):
        refused(lambda: locator.table({"theta_deg": [4.0, 8.0], "strain": [0.02, 0.05], name: column}), name, "no type of numbers")
    assert strain(D=pd.Series([1.0, 1.2], dtype="pint[cm]")).tolist() == strain(D=[10.0, 12.0]).tolist()
    table = astropy.table.QTable(dict(a=[1.0, 1.2] * u.cm))
    assert strain(D=table["a"]).tolist() == strain(D=[10.0, 12.0]).tolist()
    named = astropy.table.Table(dict(a=[1.0, 1.2]))
    assert strain(a=10 * named["a"]).tolist() == strain(a=[10.0, 12.0]).tolist()
    named["a"].unit = "cm"
    assert strain(D=named["a"]).tolist() == strain(D=[10.0, 12.0]).tolist()


def test_labels_of_units(desk):
    """A unit that is only written beside an array is read where it is that of the key."""
    ten = np.array([10.0, 12.0])
    for text in ("mm", "millimetre"):
        assert strain(D=xarray.DataArray(ten, attrs=dict(units=text))).values.tolist() == strain(D=ten).tolist()
    assert strain(D=xarray.DataArray(ten)).values.tolist() == strain(D=dask.array.from_array(ten)).tolist() == strain(D=ten).tolist()
    assert strain(D=xarray.DataArray(ten / 10 * ur.cm)).values.tolist() == strain(D=ten).tolist()
    refused(lambda: strain(D=xarray.DataArray(ten, attrs=dict(units="cm"))), "D", "cm", "mm")
    refused(lambda: strain(theta=xarray.DataArray([0.07], attrs=dict(units="rad"))), "theta", "rad", "degrees")
    refused(lambda: vibrissa.spec_text(whisker=dict(D=xarray.DataArray(ten, attrs=dict(units="cm")))), "whisker.D", "cm", "mm")
    # Of a frame, for each of its columns; those that are not read may have any.
    frame = pd.DataFrame(dict(theta_deg=[4.0, 4.0], strain=[0.02, 0.021], warm=[20.5, 21.0]))
    plain = desk[1].locator().table(frame)
    frame.attrs["units"] = dict(theta_deg="deg", warm="K")
    found = desk[1].locator().table(frame)
    assert found["warm"].tolist() == [20.5, 21.0] and found["distance_mm"].tolist() == plain["distance_mm"].tolist()
    frame.attrs["units"] = dict(theta_deg="rad")
    refused(lambda: desk[1].locator().table(frame), "theta_deg", "rad", "degrees")
    centimetres = pd.Series(ten)
    centimetres.attrs["unit"] = "cm"
    refused(lambda: strain(D=centimetres), "D", "cm", "mm")


@pytest.mark.parametrize("value", [
    "10 mm", "10", b"10", ["10"], True, [True, 2.0], np.array([True]), 10 + 0j, np.array([10 + 0j]), datetime.timedelta(1), datetime.datetime(2026, 1, 1), datetime.date(2026, 1, 1),
    np.timedelta64(10, "ms"), np.array([1], "m8[ns]"), np.array([1], "M8[ns]"), pd.Timedelta(1), pd.Timestamp(1), pd.Series([pd.Timedelta(1)]),
    np.ma.masked_array([True, False], [True, False]), np.ma.masked_array([1j, 2j], [True, False]), np.ma.masked_array(["1", "2"], [True, False]), None, {"D": 1}, {10.0}, object()])
def test_what_is_no_number_is_refused(value, desk):
    locator = desk[1].locator()
    refused(lambda: strain(D=value), "D")
    refused(lambda: strain(tilt=value), "tilt")
    refused(lambda: locator.locate(4.0, value) if value is not None else locator.locate(value, 0.02), "reading" if value is not None else "drive")
    refused(lambda: list(locator.stream([(4.0, value)])), "readings")
    if not isinstance(value, (dict, set)) and value is not None:
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.sweep(whisker=dict(D=value, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=4), run=CPU)
        assert caught.value.key.startswith("whisker.D")


def test_no_library_of_units_is_needed(monkeypatch):
    """Only what a quantity can do is asked for."""

    class Length:
        def __init__(self, value, unit):
            self.magnitude, self.units = value, unit

        def to(self, unit):
            if unit != "mm":
                raise KeyError(unit)
            return Length(25.4 * self.magnitude, "mm")

        def __array__(self, *_args, **_options):
            return np.asarray(self.magnitude)

        __float__ = lambda self: float(self.magnitude)

    assert strain(D=Length(1.0, "inch")) == strain(D=25.4) and "D = 25.4" in vibrissa.spec_text(whisker=dict(D=Length(1.0, "inch")))
    refused(lambda: strain(theta=Length(1.0, "inch")), "theta", "inch", "degrees")


@pytest.mark.parametrize("changes, text", [
    (dict(theta=0.07), "outside the usual 0.2 … 90 degrees"),
    (dict(material={"hooke": 3.2e6}), "outside the usual 0.005 … 420000 MPa"),
    (dict(D=0.01, d=0.004), "outside the usual 0.02 … 500 mm"),
])
def test_strain_doubts_as_sweep_does(changes, text):
    sections = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=4), model={}, run=CPU)
    for key, value in changes.items():
        next(s for s, keys in (("whisker", "D d L_a"), ("tap", "theta"), ("model", "material")) if key in keys.split() and sections[s].update({key: value}) is None)
    tuples = {f"{key}{'_deg' if key == 'theta' else '_mm'}": [{**GOOD, **changes}[key]] for key in GOOD}
    calls = [lambda: vibrissa.sweep(**sections), lambda: strain(**changes), lambda: strain(**changes), lambda: strain(**changes, full=True),
             lambda: strain(**changes, tilt=np.zeros(3)), lambda: vibrissa.strain(**{**GOOD, **changes, "a": np.full(20_000, 30.0)}),
             lambda: vibrissa.sweep(tuples=tuples, model=sections["model"], run=CPU), lambda: vibrissa.shape(tuples=tuples, model=sections["model"], nodes=3)]
    for call in calls:
        with pytest.warns(vibrissa.VibrissaWarning) as told:
            call()
        (one,) = [w for w in told if text in str(w.message)]
        assert one.category is vibrissa.VibrissaWarning and issubclass(one.category, UserWarning) and one.filename == __file__
        assert ".keywords" not in str(one.message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        strain()
        strain(theta=[0.07, 4.0], D=[0.2, 10.0], d=[0.005, 4.0])
        strain(theta=np.nan), strain(D=-1.0), strain(theta=[]), strain(D=1e300, d=1e300)
        with pytest.raises(vibrissa.VibrissaWarning, match="outside the usual"):
            strain(theta=0.07)


def test_every_warning_is_of_one_class(desk, tmp_path):
    rig = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), run=CPU)
    small, doubted = dict(a=[21, 30], theta=vibrissa.axis(0.02, 0.1, steps=3)), dict(RIG, gauge=dict(RIG["gauge"], factor=221))
    for call in (lambda: vibrissa.chart(**rig, tap=small), lambda: vibrissa.verify(**rig, tap=small, quick=True, samples=2), lambda: vibrissa.sweep(**rig, tap=small),
                 lambda: vibrissa.shape(**rig, tap=small, nodes=3), lambda: vibrissa.simulate(**{k: v for k, v in rig.items() if k != "run"}, tap=small),
                 lambda: vibrissa.calibrate(desk[0], **doubted), lambda: vibrissa.Locator(tmp_path / "cal.toml")):
        with pytest.warns(vibrissa.VibrissaWarning) as told:
            found = call()
        assert {w.category for w in told} == {vibrissa.VibrissaWarning} and {w.filename for w in told} == {__file__}
        assert any("outside the usual" in str(w.message) for w in told), [str(w.message) for w in told]
        if isinstance(found, vibrissa.Calibration):
            found.save(tmp_path / "cal.toml")


def test_columns_of_taps_that_are_not_read_are_told():
    taps = dict(D_mm=[10.0], d_mm=[4.0], L_a_mm=[50.0], x_ss_mm=[5.0], l_mm=[2.0], a_mm=[30.0], theta_deg=[4.0], tilt=[30.0])
    for kind in (dict, pd.DataFrame):
        with pytest.warns(vibrissa.VibrissaWarning, match="ignored columns tilt"):
            vibrissa.sweep(tuples=kind(taps), run=CPU)


@pytest.mark.parametrize("missing", [np.nan, np.array([np.nan]), [np.nan, np.nan], np.array(np.nan), float("nan"), np.float32("nan"), np.ma.masked, np.ma.masked_array([5.0], [True]),
                                     pd.Series([np.nan]), pd.array([pd.NA], dtype="Float64"), pd.array([pd.NA], dtype="Int64"), np.nan * u.deg, u.Quantity([np.nan], u.deg), np.nan * ur.deg])
@pytest.mark.parametrize("key", ["tilt", "lean", "D", "a", "theta"])
def test_a_value_that_is_not_known_has_no_strain(key, missing):
    if key in ("D", "a") and hasattr(missing, "unit" if isinstance(missing, u.Quantity) else "units"):
        missing = missing.value * u.mm if isinstance(missing, u.Quantity) else missing.magnitude * ur.mm
    for a in (30.0, [21.0, 30.0], np.full(300, 30.0)):
        if key == "a" and np.size(a) > 1 or np.size(missing) > 1 and np.size(a) == 300:
            continue
        taps = {**GOOD, "a": a, key: missing}
        assert np.isnan(vibrissa.strain(**taps)).all()
        full = vibrissa.strain(**taps, full=True)
        assert np.isnan(full.strain).all() and (np.asarray(full.status) == vibrissa.Status.invalid_geometry).all()
    some = strain(tilt=[0.0, np.nan, 10.0], lean=[0.0, 0.0, np.nan])
    assert some[0] == strain() and np.isnan(some[1:]).all()


@pytest.mark.parametrize("missing", [np.nan, np.ma.masked_array([5.0, 1.0], [True, False]), pd.array([pd.NA, 1.0], dtype="Float64"), [np.nan, 1.0]])
@pytest.mark.parametrize("key", ["tilt_deg", "lean_deg", "D_mm"])
def test_a_value_that_is_not_known_is_no_tuple(key, missing, tmp_path):
    taps = dict(D_mm=[10.0, 10.0], d_mm=4.0, L_a_mm=50.0, x_ss_mm=5.0, l_mm=2.0, a_mm=30.0, theta_deg=4.0)
    for call in (vibrissa.sweep, vibrissa.shape):
        refused(lambda: call(tuples={**taps, key: missing}), f"tuples.{key.split('_')[0]}", "finite")
    for text in ("nan", "", "NaN"):
        (tmp_path / "taps.csv").write_text(f"D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,tilt_deg,lean_deg\n10,4,50,5,2,30,4,{text},0\n")
        refused(lambda: vibrissa.sweep(tuples={"file": str(tmp_path / "taps.csv")}), "tilt_deg", "finite")
    with pytest.raises(vibrissa.InputError, match="finite"):
        vibrissa.sweep(**{**RIG, "tap": dict(a=30, theta=4, tilt=np.nan)})
    # What a file says of its own whisker is not passed over.
    spec = tmp_path / "spec.toml"
    for text, key in (("[whisker]\nD = 5\n", "whisker.D"), ("[tap]\ntilt = 5\n", "tap.tilt"), ("[tuples]\nfile = 'taps.csv'\n", "tuples.file")):
        spec.write_text(text)
        with pytest.raises(vibrissa.InputError) as caught:
            vibrissa.sweep(spec, tuples=taps, run=CPU)
        assert caught.value.key == key and "tuples" in str(caught.value)
    # One of the two directions, without the other: upright in that.
    leaning = vibrissa.sweep(tuples={**taps, "lean_deg": [5.0, 0.0]}, run=CPU).tuples
    assert "lean_deg" in leaning and "tilt_deg" not in leaning and leaning["strain"][1] == strain(precision="f32")
    assert leaning["strain"][0] == pytest.approx(strain(lean=5.0), rel=1e-6)


@pytest.mark.parametrize("absurd", [1e300, 1e13, np.inf])
def test_no_whisker_is_that_large(absurd):
    for changes in (dict(D=absurd, d=absurd), dict(D=[absurd, absurd], d=absurd), dict(L_a=absurd), dict(D=absurd)):
        full = strain(**changes, full=True)
        assert np.isnan(full.strain).all() and (np.asarray(full.status) == vibrissa.Status.invalid_geometry).all()
        assert np.isnan(strain(**changes, backend="reference")).all()
    assert np.isnan(vibrissa.strain(10, 4, 50, 5, 2, 30, delta=absurd))
    with pytest.raises(vibrissa.InputError, match="large|finite"):
        vibrissa.sweep(whisker=dict(D=absurd, d=absurd, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=30, theta=4), run=CPU)


@of_libraries
def test_arguments_of_jax_are_converted_or_refused(quantity):
    import jax
    import vibrissa.jax

    jax.config.update("jax_enable_x64", True)
    strained = lambda **changes: vibrissa.jax.strain(**{**GOOD, **changes})
    for key in ("D", "d", "L_a", "x_ss", "l", "a"):
        for unit, size in (("cm", 10.0), ("mm", 1.0)):
            assert float(strained(**{key: quantity(GOOD[key] / size, unit)})) == pytest.approx(strain(), rel=1e-8)
            assert np.asarray(strained(**{key: quantity(np.full(3, GOOD[key] / size), unit)})) == pytest.approx([strain()] * 3, rel=1e-8)
        refused(lambda: strained(**{key: quantity(1.0, "s")}), key, "s", "mm")
    assert float(strained(theta=quantity(np.deg2rad(4.0), "rad"))) == pytest.approx(strain(), rel=1e-8)
    assert float(strained(theta=None, delta=quantity(0.2, "cm"))) == pytest.approx(strain(theta=None, delta=2.0), rel=1e-8)
    assert float(strained(hub=quantity(0.3, "cm"), tilt=quantity(0.2, "rad"))) == pytest.approx(strain(hub=3.0, tilt=np.rad2deg(0.2)), rel=1e-8)
    refused(lambda: strained(theta=quantity(4.0, "mm")), "theta", "degrees")
    refused(lambda: strained(theta=None, delta=quantity(2.0, "deg")), "delta", "mm")
    refused(lambda: strained(hub=quantity(3.0, "s")), "whisker.hub", "mm")
    for bad in ("10 mm", True, np.array([True]), jax.numpy.array(True), [jax.numpy.array(True)], 3j, pd.Series(["a"])):
        refused(lambda: strained(a=bad), "a", "numbers")
    # Round an array of JAX, under its transformations.
    if quantity is MAKERS[0]:
        slope = jax.jit(jax.grad(lambda a: vibrissa.jax.strain(10.0, 4.0, 50.0, 5.0, 2.0, a * ur.cm, 4.0)))(3.0)
        assert float(slope) == pytest.approx(10 * vibrissa.strain(**GOOD, grad="a")[1][0], rel=1e-8)
