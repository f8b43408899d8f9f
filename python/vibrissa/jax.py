"""Strains in JAX: :func:`strain` works under ``jit``, ``vmap``, ``grad`` and ``jacfwd``. Imported on demand; needs jax."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _taps
from ._errors import InputError
from ._keywords import keywords

try:
    import jax
    import jax.numpy as jnp
except ImportError:
    raise ImportError("vibrissa.jax needs jax (pip install jax)") from None

__all__ = ["strain"]

_strain: Any = _taps.strain
_Shape: Any = jax.ShapeDtypeStruct

_NAMES = ("D", "d", "L_a", "x_ss", "l", "a")


@keywords
def strain(D: Any, d: Any, L_a: Any, x_ss: Any, l: Any, a: Any, theta: Any = None, *, delta: Any = None, **model: Any) -> Any:
    """Mean strain of the gauge, as :func:`vibrissa.strain`, of JAX arrays.

    Values and derivatives are computed in f64 on the host (``pure_callback``) and come back in the type of the arguments: enable
    ``jax_enable_x64`` for f64. There are first derivatives, forward and reverse; second ones are refused by JAX.

    Args:
        D, d, L_a, x_ss, l, a: mm; quantities with units, also round JAX arrays, are converted.
        theta: tap angle, degrees; or
        delta: displacement of the object, mm.
        **model: as of :func:`vibrissa.strain`; no JAX arrays.

    Returns:
        An array of the common shape.

    Raises:
        InputError: no drive, or two; what is no number; a quantity that does not convert; a model that is not allowed.
    """
    if (theta is None) == (delta is None):
        raise InputError("a tap has one drive", key="theta", allowed="theta (degrees) or delta (mm)")
    name, drive = ("theta", theta) if delta is None else ("delta", delta)
    _check(name, model)
    given = _taps.without_units(dict(zip((*_NAMES, name), (D, d, L_a, x_ss, l, a, drive))), jax.Array)
    arguments = jnp.broadcast_arrays(*(jnp.asarray(x) for x in given.values()))
    kind = jnp.result_type(float, *arguments)
    return _function(name, model)(*(x.astype(kind) for x in arguments))


def _check(drive: str, model: dict[str, Any]) -> None:
    """Refuses a model now, and not in a callback."""
    _taps.of_model(model)
    _strain(10, 4, 50, 5, 2, np.empty(0), **{drive: 1.0}, **model)


def _function(drive: str, model: dict[str, Any]) -> Any:
    names = (*_NAMES, drive)

    def values(*arguments: Any) -> Any:
        given = dict(zip(names, (np.asarray(x, np.float64) for x in arguments)))
        return np.asarray(_strain(**given, **model), arguments[0].dtype)

    def slopes(*arguments: Any) -> Any:
        given = dict(zip(names, (np.asarray(x, np.float64) for x in arguments)))
        value, jacobian = _strain(**given, **model, grad=names)
        return np.asarray(value, arguments[0].dtype), np.asarray(jacobian, arguments[0].dtype)

    @jax.custom_jvp
    def function(*arguments: Any) -> Any:
        shape = _Shape(arguments[0].shape, arguments[0].dtype)
        return jax.pure_callback(values, shape, *arguments, vmap_method="broadcast_all")

    @function.defjvp
    def _(arguments: Any, tangents: Any) -> Any:
        one = arguments[0]
        shapes = (_Shape(one.shape, one.dtype), _Shape((*one.shape, len(names)), one.dtype))
        value, jacobian = jax.pure_callback(slopes, shapes, *arguments, vmap_method="broadcast_all")
        return value, sum(jacobian[..., k] * tangent for k, tangent in enumerate(tangents))

    return function
