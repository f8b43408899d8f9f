"""Derivatives of the installed package against the complex step of benches/gradients/rod.py, model by model. Prints a table.

    pip install numba scipy
    python benches/gradients/compare.py [--taps N] [--only MODEL…] [--out FILE.csv]

An error is relative to the largest derivative of its column: of one output by one input over the taps of one model, without those of whiskers a
thousand times smaller or larger. Steps of 1.5 times the number tell how far the complex step itself can be trusted; a derivative of which it is not known
to 1e-9 of that (next to a tip that is almost a point, at a fold) is not counted. Nor is a tap whose contact lies on the end of the gauge to 1e-9: which side of
the kink it is on is a matter of rounding.
"""

import argparse
import csv
import sys
import time
import warnings

import numpy as np

import rod
import taps as taps_
import vibrissa
from models import DEGREES, INPUTS, MODELS, described

OUTPUTS = ("strain", "strain_linear", "K_deviation", "normal_force_N", "tangential_force_N", "contact_arc_mm", "strain_2", "bending_azimuth_deg", "slide_mm")
BOUND = 1e-8
NAMES = ("D", "d", "L_a", "x_ss", "l", "a", "theta", "delta", "tilt", "lean", "hub", "pole_radius", "mu", "E", "C10", "C01", "C20", "C30", "nu", "clamp", "foil.stiffness",
         "foil.length", "foil.width", "exponent", "bore", "core.diameter", "core.modulus", "curvature", "curvature_slope", "root.k_theta", "root.k_y", "root.k_x")


def inputs_of(given, keywords):
    """Names that `grad` accepts for this model."""
    one = {name: float(np.atleast_1d(x)[0]) for name, x in given.items()}
    found = []
    for name in NAMES:
        try:
            vibrissa.strain(**one, grad=name, **keywords)
            found.append(name)
        except vibrissa.InputError:
            pass
    return found


def of_model(name, n, fine=1.0, only=None):
    """One row of the table, and all derivatives, of all taps or of those numbered in `only`."""
    model = MODELS[name]
    keywords, numbers, switches = described(model)
    kind = "delta" if model.get("displaced") else "theta"
    taps = taps_.of(model, keywords, kind, n)
    if only is not None:
        taps = {key: column[list(only)] for key, column in taps.items()}
    n = len(taps["a"])
    given = {kind if key == "drive" else key: x for key, x in taps.items() if key not in ("tilt", "lean") or model.get("tilted")}
    inputs = inputs_of(given, keywords)
    begun = time.perf_counter()
    told, jacobian = vibrissa.strain(**given, full=True, grad=inputs, **keywords)
    seconds = time.perf_counter() - begun

    p = np.zeros((n, len(rod.NUMBERS)), complex)
    for key, value in numbers.items():
        p[:, rod.NUMBERS.index(key)] = value
    for key, column in taps.items():
        p[:, rod.NUMBERS.index(key)] = np.radians(column) if key in ("tilt", "lean") or key == "drive" and kind == "theta" else column
    w = np.tile(np.array(switches), (n, 1))
    sticks = np.asarray(told.sticks, bool)
    if isinstance(model.get("contact"), dict):
        w[:, rod.SWITCHES.index("coulomb")] = np.where(sticks, 0, np.sign(told.tangential_force_N))
    second = np.where(sticks, told.tangential_force_N, told.contact_arc_mm)
    begin = np.stack([told.normal_force_N, second, np.nan_to_num(np.radians(told.bending_azimuth_deg))], 1)
    units = np.array([np.radians(1.0) if name in DEGREES else 1.0 for name in inputs])
    places = np.array([rod.NUMBERS.index(INPUTS.get(name, name)) for name in inputs])
    values, slopes, sizes = rod.many(p, w, units, places, begin, sticks, fine)
    finer, slopes_, _ = rod.many(p, w, units, places, begin, sticks, 1.5 * fine)
    unsure = np.abs(slopes - slopes_)

    got = np.stack([getattr(jacobian, output) for output in OUTPUTS], -1)
    shown = np.stack([getattr(told, output) for output in OUTPUTS], -1)
    if not model.get("tilted"):
        got[..., 6:] = slopes_[..., 6:] = np.nan
    else:
        # An upright effective pole has no azimuth; a sticking contact does not slide.
        none = np.isnan(got[..., 7])
        slopes_[..., 7][none] = slopes_[..., 8][none] = np.nan
    ends = np.stack([taps["x_ss"], np.real([rod.grid(*row)[1] for row in zip(p, w)])], 1)
    kink = np.any(np.abs(ends - told.contact_arc_mm[:, None]) <= 1e-9 * taps["a"][:, None], 1)
    # A contact that touches at or before the gauge shows no strain.
    silent = (told.status & vibrissa.Status.no_strain) != 0
    slopes_[silent, :, 0] = slopes_[silent, :, 6] = 0
    slopes_[silent, :, 2] = np.nan
    if not model.get("tilted"):
        slopes_[silent, :, 6] = np.nan
    usual = np.abs(np.log10(taps["a"] / 33)) < 2
    missing = np.isnan(got) != np.isnan(slopes_)
    # Scale of a column without derivatives: the number divided by the input.
    natural = np.where(np.arange(9) == 2, 1, np.nanmedian(np.abs(shown), 0)) / np.array([[max(abs(float(np.median(p[:, k].real))), 1e-2)] for k in places]) * units[:, None]
    with np.errstate(invalid="ignore"):
        large = [np.nanmax(np.where(rows[:, None, None] & (unsure <= 1e-6 * np.abs(slopes_)), np.abs(slopes_), 0), 0, initial=0) for rows in (usual, usual | True)]
    scale = np.maximum(large[0], 0.1 * np.nan_to_num(natural))
    scale = np.where(scale > 0, scale, np.nan)
    scales = np.where(usual[:, None, None], scale, np.maximum(scale, large[1]))
    sure = (unsure <= 1e-9 * scales) & ~kink[:, None, None] & ~np.isnan(slopes_)
    error = np.where(sure, np.abs(got - slopes_) / scales, 0)
    large = sure & (np.abs(slopes_) > 1e-6 * scales)
    own = np.abs(got - slopes_)[large] / np.abs(slopes_[large])
    whole = ~np.isnan(slopes_) & ~np.isnan(scales)
    k, i, m = np.unravel_index(np.nanargmax(error), error.shape)
    apart = np.where(silent, 0, np.abs(shown[:, 0] - finer[:, 0])) / np.nanmax(np.abs(np.where(usual, finer[:, 0], np.nan)))
    row = dict(model=name, taps=n, inputs=len(inputs), derivatives=int(whole.sum()), told=float(sure.sum() / whole.sum()), worst=float(np.nanmax(error)), of=OUTPUTS[m], by=inputs[i], tap=k,
               over=int((error > BOUND).sum()), typical=float(np.median(own)), most=float(np.quantile(own, 0.999)), missing=int((missing & ~kink[:, None, None]).sum()),
               value=float(np.nanmax(apart)), seconds=seconds)
    return row, dict(taps=taps, inputs=inputs, got=got, expected=slopes_, unsure=unsure, error=error, scale=scale, told=told, values=finer, sizes=sizes, missing=missing)


def main():
    warnings.simplefilter("ignore", vibrissa.VibrissaWarning)
    parser = argparse.ArgumentParser()
    parser.add_argument("--taps", type=int, default=2000)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--out")
    asked = parser.parse_args()
    rows = []
    print("| model | taps | inputs | derivatives | told | worst, of the column's largest | where | above 1e-8 | median, of its own |\n|---|---|---|---|---|---|---|---|---|")
    for name in asked.only or MODELS:
        row, _ = of_model(name, asked.taps)
        rows.append(row)
        print(f"| {name} | {row['taps']} | {row['inputs']} | {row['derivatives']} | {100 * row['told']:.2f} % | {row['worst']:.1e} | {row['of']} by {row['by']} | {row['over']} | {row['typical']:.1e} |",
              flush=True)
        if row["missing"] or row["value"] > 1e-7:
            print(f"<!-- {name}: {row['missing']} missing; strains apart by {row['value']:.1e} -->", flush=True)
        if asked.out:
            with open(asked.out, "w", newline="") as file:
                writer = csv.DictWriter(file, rows[0].keys())
                writer.writeheader()
                writer.writerows(rows)
    return int(any(row["over"] or row["missing"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
