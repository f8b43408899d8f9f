"""Single taps: numbers and arrays in, numbers and arrays out."""

from __future__ import annotations

import enum
import numbers as numbers_
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._errors import InputError, short, warn
from ._keywords import keywords
from ._labels import Shape, aligned
from ._progress import Progress, shown
from ._spec import document, flag
from ._units import UNITS, bare, filled, has_flags

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._sections import TapModel

Number = Union[float, NDArray[np.float64]]
Grad = Union[str, "list[str]", "tuple[str, ...]"]


class Status(enum.IntFlag):
    """What there is to say of a tap or a distance; 0 is ok. The words of the column ``status`` (docs/reference.md) as bits."""

    ok = 0
    invalid_geometry = 1
    no_strain = 2
    not_converged = 4
    material_limit = 8
    at_knot = 1024
    slipped_off = 16
    strain_limit = 32
    no_root = 64
    ambiguous = 128
    outside_calibration = 256
    inconsistent = 2048
    bad_input = 512

    @classmethod
    def _missing_(cls, value: object) -> Any:
        """Whole numbers of numpy are bits, too."""
        return super()._missing_(int(value) if isinstance(value, np.integer) else value)

    @property
    def words(self) -> str:
        """``"ok"``, or words joined by +, as tables have them."""
        return "+".join(s.name or "" for s in Status if s and s in self) or "ok"


@keywords
def status_words(status: ArrayLike) -> NDArray[np.object_]:
    """Status bits as the words of tables, element by element; labels are kept."""
    _, labels = aligned({"status": status})
    bits = np.asarray(status)
    whole = bits.dtype.kind in "iu" and (bits.size == 0 or 0 <= bits.min() and bits.max() < 2 * Status.inconsistent)
    if bits.size > 0 and not whole:
        raise InputError("these are no bits of a status", key="status", value=short(status), allowed=f"integers 0 … {2 * Status.inconsistent - 1}")
    different, place = np.unique(np.atleast_1d(bits), return_inverse=True)
    names = np.array([Status(int(s)).words for s in different], dtype=object)[place].reshape(bits.shape)
    found: NDArray[np.object_] = names if labels is None else labels.put(names)
    return found


class Tap(NamedTuple):
    """What taps give; each a number, or an array of the common shape. NaN where there is no value: ``status`` says why."""

    strain: Any
    """Mean strain of the gauge, positive for tension."""
    strain_linear: Any
    """The same by the theory of the estimate, ±θ f (model.md §4.1)."""
    K_deviation: Any
    """K − 1 at full relative precision (21)."""
    normal_force_N: Any
    """Contact force across the whisker P, N."""
    tangential_force_N: Any
    """Contact force along the whisker T, N."""
    contact_arc_mm: Any
    """Arc length of the contact c, mm."""
    status: Any
    """Bits of :class:`Status`."""
    sticks: Any
    """Whether the contact sticks."""
    strain_2: Any = float("nan")
    """Strain of a second gauge, 90° round the whisker; with ``second=True``."""
    bending_azimuth_deg: Any = float("nan")
    """Azimuth φ of the plane in which the whisker bends, degrees; with ``second=True``, or a pole that is not upright."""
    slide_mm: Any = float("nan")
    """Slide λ of the contact along the object's edge, mm; likewise."""

    @property
    def K(self) -> Any:
        """strain_linear/strain (20)."""
        return 1.0 + self.K_deviation


class Jacobian(NamedTuple):
    """Derivatives of what taps give, each by the inputs that ``grad`` names: an array of the taps' common shape with one more axis, per mm, per degree,
    or per unit of the key. NaN where the number has no value."""

    strain: Any
    """Of the strain."""
    strain_linear: Any
    """Of the strain of the estimate's theory."""
    K_deviation: Any
    """Of K − 1, hence of K."""
    normal_force_N: Any
    """Of P, N."""
    tangential_force_N: Any
    """Of T, N."""
    contact_arc_mm: Any
    """Of c, mm."""
    strain_2: Any
    """Of the strain of the second gauge."""
    bending_azimuth_deg: Any
    """Of φ, degrees."""
    slide_mm: Any
    """Of λ, mm."""

    @property
    def K(self) -> Any:
        """Of K: that of K − 1."""
        return self.K_deviation


_SECTION = {
    "hub": "whisker", "side": "gauge", "strain_limit": "gauge", "second": "gauge", "foil": "gauge", "theory": "estimate",
    "exponent": "whisker", "bore": "whisker", "core": "whisker", "curvature": "whisker", "curvature_slope": "whisker", "root": "whisker",
    "signal": "sensor",
    "backend": "run", "adapter": "run", "precision": "run", "tolerance": "run", "threads": "run",
}
# Of a tap, beside status and whether it sticks.
_NUMBERS = 9
_SCALARS = frozenset({float, int, np.float64, np.float32, np.int64, np.int32})
_NAMES = ("D", "d", "L_a", "x_ss", "l", "a", "theta")
_solvers: dict[str, tuple[_native.Taps, list[str]]] = {}
_quick: dict[Any, tuple[_native.Taps, list[str]]] = {}
"""The same by keywords of plain values, whose text need not be written each time."""
_PLAIN = frozenset({str, bool, int, float})
_MOST_SOLVERS = 64


def _solver(model: dict[str, Any], displaced: bool) -> tuple[_native.Taps, list[str]]:
    """What solves taps of this model, made once, and what should be known of it."""
    # As keys True, 1 and 1.0 are one; in a spec they are not.
    quick = (displaced, *model.items(), *map(type, model.values()))
    try:
        return _quick[quick]
    except (KeyError, TypeError):
        plain = all(type(value) in _PLAIN for value in model.values())
    text = ""
    if model or displaced:
        sections: dict[str, dict[str, Any]] = {}
        for key, value in model.items():
            sections.setdefault(_SECTION.get(key, "model"), {})[key] = value
        if displaced:
            sections["tap"] = {"drive": "displacement"}
        text = document(sections)
    found = _solver_of(text)
    if plain:
        if len(_quick) >= _MOST_SOLVERS:
            _quick.clear()
        _quick[quick] = found
    return found


def _solver_of(text: str) -> tuple[_native.Taps, list[str]]:
    """What solves taps of the model that ``text``, sections of a spec, describes."""
    found = _solvers.get(text)
    if found is None:
        if len(_solvers) >= _MOST_SOLVERS:
            _solvers.clear()
        taps = _native.Taps(text)
        found = _solvers[text] = taps, taps.warnings
    return found


def of_model(model: Mapping[str, Any]) -> None:
    """Refuses keywords of :func:`strain` that say what comes back, and are none of a model."""
    for key in ("full", "grad", "progress"):
        if key in model:
            raise InputError("this is no key of a model", key=key, value=short(model[key]), allowed="keys of [model]; vibrissa.strain has this one")


def forget_solvers() -> object:
    """What there was of them, for a forked process in which it cannot be used."""
    global _solvers, _quick
    old, _solvers, _quick = (_solvers, _quick), {}, {}
    return old


def _inputs(grad: Any) -> list[str]:
    """Names of inputs."""
    names = [grad] if isinstance(grad, str) else grad
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise InputError("these are no names of inputs", key="grad", value=short(grad), allowed='different names, ("d", "a", "theta")')
    return list(names)


def number_array(name: str, value: Any, allowed: str, unit: str | None) -> NDArray[np.float64]:
    """``value``, of which quantities are told in ``unit``, as an array of float64, NaN where it is missing; complaints name the argument."""

    def wrong(why: str) -> InputError:
        return InputError(why, key=name, value=short(value), allowed=allowed)

    try:
        if has_flags(value):
            raise wrong("truth values are no numbers")
        numbers, missing = filled(bare(name, value, unit))
        array = np.asarray(numbers)
        if array.dtype.kind == "O":
            array = bare(name, array, unit)
    except InputError:
        raise
    except (TypeError, ValueError, RecursionError) as e:
        raise wrong(f"this is no array of numbers: {e}") from None
    if array.dtype.kind == "O":
        real = all(isinstance(x, numbers_.Real) and not isinstance(x, (bool, np.bool_)) for x in array.flat)
        if not real:
            raise wrong("some of these objects are no numbers")
        try:
            return array.astype(np.float64)
        except (OverflowError, TypeError, ValueError) as e:
            raise wrong(f"some of these objects are no numbers: {e}") from None
    if array.dtype.kind not in "fiu":
        raise wrong(f"{array.dtype} is no type of numbers")
    found = array.astype(np.float64, copy=False)
    return found if missing is None else np.where(missing, np.nan, found)


def columns(given: Mapping[str, Any], allowed: Mapping[str, str], units: Mapping[str, str | None] | None = None,
            prefix: str = "") -> tuple[Shape, int, list[NDArray[np.float64]]]:
    """The common shape of all arguments, its size, and each as a contiguous array of that many values, or of one; ``prefix`` stands before their
    names in complaints. Arguments with labels are paired by them."""
    units = _OF_TAPS if units is None else units
    paired, labels = aligned(given, prefix)
    arrays = {name: number_array(prefix + name, value, allowed[name], units[name]) for name, value in paired.items()}
    try:
        shape = Shape(np.broadcast_shapes(*(a.shape for a in arrays.values())))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arrays.items() if a.ndim)
        raise InputError("these shapes do not broadcast", key="shapes", value=shapes, allowed="shapes that numpy broadcasts together") from None
    if labels is not None and labels.shape != shape and np.prod(labels.shape) == 1:
        labels = None  # One value goes with every place, as a number does.
    if labels is not None and labels.shape != shape:
        name = next(name for name, a in arrays.items() if np.broadcast_shapes(a.shape, labels.shape) != labels.shape)
        raise InputError("this array has more values than there are labels", key=prefix + name, value=f"shape {arrays[name].shape}",
                         allowed=f"a number, or an array that broadcasts to the shape {labels.shape} of the labelled ones")
    shape.labels = labels
    flat = []
    for a in arrays.values():
        if a.size != 1:
            a = np.broadcast_to(a, shape)
        flat.append(np.require(a, np.float64, ["C", "ALIGNED"]).reshape(-1))
    return shape, int(np.prod(shape, dtype=np.int64)), flat


ALLOWED = {
    "D": "numbers > 0, mm", "d": "numbers > 0, mm", "L_a": "numbers > 0, mm", "x_ss": "numbers ≥ 0, mm", "l": "numbers > 0, mm",
    "a": "numbers > 0 and ≤ L_a, mm", "theta": "numbers > 0 and < 90, degrees", "delta": "numbers > 0, mm",
    "tilt": "numbers > −90 and < 90, degrees", "lean": "numbers > −90 and < 90, degrees",
}


def without_units(given: Mapping[str, Any], kind: Any) -> dict[str, Any]:
    """Arguments of taps as arrays of this kind, of another library, where they are some; others as numbers or arrays of numpy, in mm and degrees."""
    paired, _ = aligned(given)

    def one(name: str, value: Any) -> Any:
        found = value if type(value) in _SCALARS or isinstance(value, kind) else bare(name, value, _OF_TAPS[name])
        several = isinstance(found, (list, tuple)) and any(isinstance(x, kind) for x in found)
        if any(isinstance(x, kind) and "bool" in str(x.dtype) for x in (found if several else [found])):
            raise InputError("truth values are no numbers", key=name, value=short(value), allowed=ALLOWED[name])
        if type(found) in _SCALARS or isinstance(found, kind) or several or type(found) is np.ndarray and found.dtype.kind in "fiu":
            return found
        return number_array(name, value, ALLOWED[name], _OF_TAPS[name])

    return {name: one(name, value) for name, value in paired.items()}


_OF_TAPS = {name: UNITS[key] for name in ALLOWED for key in (f"whisker.{name}", f"gauge.{name}", f"tap.{name}") if key in UNITS}


@overload
def strain(D: float, d: float, L_a: float, x_ss: float, l: float, a: float, theta: float | None = None, *,
           delta: float | None = None, tilt: float = 0.0, lean: float = 0.0, full: Literal[False] = False, grad: None = None, progress: Progress = None,
           **model: Unpack[TapModel]) -> float: ...
@overload
def strain(D: ArrayLike, d: ArrayLike, L_a: ArrayLike, x_ss: ArrayLike, l: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None, *,
           delta: ArrayLike | None = None, tilt: ArrayLike = 0.0, lean: ArrayLike = 0.0, full: Literal[False] = False, grad: None = None, progress: Progress = None,
           **model: Unpack[TapModel]) -> Number: ...
@overload
def strain(D: ArrayLike, d: ArrayLike, L_a: ArrayLike, x_ss: ArrayLike, l: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None, *,
           delta: ArrayLike | None = None, tilt: ArrayLike = 0.0, lean: ArrayLike = 0.0, full: Literal[True], grad: None = None, progress: Progress = None,
           **model: Unpack[TapModel]) -> Tap: ...
@overload
def strain(D: ArrayLike, d: ArrayLike, L_a: ArrayLike, x_ss: ArrayLike, l: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None, *,
           delta: ArrayLike | None = None, tilt: ArrayLike = 0.0, lean: ArrayLike = 0.0, full: Literal[False] = False, grad: Grad, progress: Progress = None,
           **model: Unpack[TapModel]) -> tuple[Number, NDArray[np.float64]]: ...
@overload
def strain(D: ArrayLike, d: ArrayLike, L_a: ArrayLike, x_ss: ArrayLike, l: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None, *,
           delta: ArrayLike | None = None, tilt: ArrayLike = 0.0, lean: ArrayLike = 0.0, full: Literal[True], grad: Grad, progress: Progress = None,
           **model: Unpack[TapModel]) -> tuple[Tap, Jacobian]: ...
@keywords
def strain(D: Any, d: Any, L_a: Any, x_ss: Any, l: Any, a: Any, theta: Any = None, *,
           delta: Any = None, tilt: Any = 0.0, lean: Any = 0.0, full: bool = False, grad: Any = None, progress: Progress = None, **model: Any) -> Any:
    """Mean strain of the gauge when a whisker taps an object.

    Arguments are numbers or arrays that broadcast together; the result is a float, or an array of their common shape. Quantities with units
    (pint, astropy, unyt, quantities) are converted. Series and DataFrames of pandas are paired by their index and columns, DataArrays of xarray by their
    dimensions and coordinates, in any order; the result has these labels.

    Args:
        D, d: diameter at base and tip, mm, > 0.
        L_a: length, mm, > 0.
        x_ss, l: place of the gauge's near end (≥ 0) and length of its grid (> 0), mm; x_ss + l ≤ L_a.
        a: contact distance, mm, 0 < a ≤ L_a.
        theta: tap angle, degrees, 0 < θ < 90; or
        delta: displacement of the object, mm.
        tilt: turns the object's edge, and the contact, round the whisker's axis, degrees, between −90 and 90.
        lean: leans the edge along the whisker, degrees, between −90 and 90.
        full: return a :class:`Tap` with forces, contact, K and ``status`` beside the strain.
        grad: names of inputs, ``("d", "a", "theta")``: derivatives by them, too. Any of D, d, L_a, x_ss, l, a, theta (or delta), tilt, lean, and of what
            the model has: hub, pole_radius, mu, E, C10, C01, C20, C30, nu, clamp, foil.stiffness, foil.length, foil.width, exponent, scale, bore,
            core.diameter, core.modulus, curvature, curvature_slope, root.k_theta, root.k_y, root.k_x.
        progress: True (a bar, if tqdm is installed) or a function of (taps done, taps).
        **model: keys of a spec's [model] (``geometry``, ``shear``, ``extension``, ``surface``, ``pole_radius``, ``nu``,
            ``contact``, ``material={"neo-hookean": 3.2}``, ``clamp``, ``indentation``, ``section``, ``solid``), and ``hub``, ``side``, ``second``,
            ``foil={"stiffness": 100, "length": 6.3, "width": 2.8}`` (N/mm, mm), ``strain_limit``, ``theory``, those of [whisker]
            (``exponent``, ``bore``, ``core={"diameter": 0.5, "modulus": 60000}``, ``curvature``, ``curvature_slope``, ``root={"k_theta": 500}``),
            ``signal`` ("moment": N mm, or "force": N, is then told in place of the strain),
            ``backend`` ("cpu" by default), ``adapter``, ``precision`` ("f64" on the CPU, where the program has "f32": differences find no slope in f32),
            ``tolerance`` (1e-8 in f64, 1e-5 in f32), ``threads``.

    Returns:
        float, ndarray of float64 (or what has the labels of the arguments), or :class:`Tap`. A tap that has no value (outside the domain, slipped off with ``status``,
        not converged; a NaN or a masked value in any argument) is NaN; ``full=True`` says why. With ``grad`` a pair: that, and its derivatives, an
        array of the common shape with one more axis, in the order asked, per mm, per degree, or per unit of the key (``full=True``: a
        :class:`Jacobian` of such arrays). They follow from the equations of the tap, not from differences. At a kink (``sticks`` changes, the
        contact leaves the gauge) they are those of the side on which the tap lies.

    Raises:
        InputError: what is no number, a quantity that does not convert to the unit above, shapes that do not broadcast, labels that differ, a key or
            value of the model that is not allowed.

    Warns:
        VibrissaWarning: numbers outside the usual range of their key, most likely in another unit (``theta=0.07``, ``material={"hooke": 3.2e6}``).
        RunError: a device that fails.

    Source: the geometrically exact rod of docs/model.md §3; K by (20), (21).

    >>> round(strain(10, 4, 50, 5, 2, 30, 4.0), 5)
    0.02233
    >>> value, slopes = strain(10, 4, 50, 5, 2, 30, 4.0, grad=("a", "theta"))
    >>> slopes.round(6)
    array([-0.000979,  0.005568])
    """
    if theta is None:
        if delta is None:
            raise InputError("the drive is missing", key="theta", allowed="theta (degrees) or delta (mm)")
        name, drive = "delta", delta
    elif delta is not None:
        raise InputError("a tap has one drive", key="delta", allowed="theta (degrees) or delta (mm), not both")
    else:
        name, drive = "theta", theta
    if full is not False:
        full = flag("full", full)
    solver, doubts = _solver(model, delta is not None)
    if doubts:
        warn(doubts)
    by = None if grad is None else _inputs(grad)
    if by is None and {type(D), type(d), type(L_a), type(x_ss), type(l), type(a), type(drive), type(tilt), type(lean)} <= _SCALARS:
        try:
            numbers, status, sticks, of_tap = solver.one((D, d, L_a, x_ss, l, a, drive, tilt, lean), bool(full))
        except OverflowError as e:
            raise InputError(str(e), key="arguments", allowed="numbers that a float holds") from None
        if of_tap:
            warn(of_tap)
        return Tap(*[*numbers[:6], Status(status), sticks, *numbers[6:]]) if full else numbers[0]
    upright = type(tilt) in _SCALARS and type(lean) in _SCALARS and tilt == 0 and lean == 0
    given = {"D": D, "d": d, "L_a": L_a, "x_ss": x_ss, "l": l, "a": a, name: drive}
    if not upright:
        given |= {"tilt": tilt, "lean": lean}
    shape, n, flat = columns(given, ALLOWED)
    if n == 0:
        empty = shape.of(np.empty(0))
        nothing = Tap(empty, empty, empty, empty, empty, empty, shape.of(np.empty(0, np.uint16)), shape.of(np.empty(0, bool)), empty, empty, empty)
        if by is not None:
            none = shape.of(np.empty(0), by)
            return (nothing, Jacobian(*[none] * 9)) if full else (empty, none)
        return nothing if full else empty
    with shown(progress) as tell:
        found, slopes, of_taps = solver.many(n, flat, full, by or [], tell)
    if of_taps:
        warn(of_taps)
    if not full:
        value = shape.of(found[0])
        return value if by is None else (value, shape.of(slopes, by))
    rows, *words = found
    first, last = np.split(np.ascontiguousarray(rows.reshape(n, _NUMBERS).T), [6])
    values = Tap(*map(shape.of, [*first, *words, *last]))
    if by is None:
        return values
    by_inputs = np.ascontiguousarray(slopes.reshape(n, _NUMBERS, len(by)).swapaxes(0, 1))
    return values, Jacobian(*[shape.of(x, by) for x in by_inputs])
