"""Strains in PyTorch: :func:`strain` has a backward. Imported on demand; needs torch."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _taps
from ._errors import InputError
from ._keywords import keywords

try:
    import torch
except ImportError:
    raise ImportError("vibrissa.torch needs torch (pip install torch)") from None

__all__ = ["strain"]

_strain: Any = _taps.strain

_NAMES = ("D", "d", "L_a", "x_ss", "l", "a")


class _Strain(torch.autograd.Function):  # type: ignore[misc,unused-ignore]
    @staticmethod
    def forward(ctx: Any, names: tuple[str, ...], model: dict[str, Any], *arguments: Any) -> Any:
        given = {name: x.detach().cpu().to(torch.float64).numpy() for name, x in zip(names, arguments)}
        like = arguments[0]
        asked = tuple(name for name, needed in zip(names, ctx.needs_input_grad[2:]) if needed)
        if not asked:
            return torch.as_tensor(np.asarray(_strain(**given, **model))).to(like)
        value, jacobian = _strain(**given, **model, grad=asked)
        ctx.slopes = dict(zip(asked, torch.as_tensor(jacobian).to(like).unbind(-1)))
        ctx.names = names
        return torch.as_tensor(np.asarray(value)).to(like)

    @staticmethod
    def backward(ctx: Any, gradient: Any) -> Any:
        if torch.is_grad_enabled():
            raise RuntimeError("vibrissa.torch.strain has first derivatives only: call backward without create_graph")
        return (None, None, *(gradient * ctx.slopes[name] if name in ctx.slopes else None for name in ctx.names))


@keywords
def strain(D: Any, d: Any, L_a: Any, x_ss: Any, l: Any, a: Any, theta: Any = None, *, delta: Any = None, **model: Any) -> Any:
    """Mean strain of the gauge, as :func:`vibrissa.strain`, of tensors.

    Values and derivatives are computed in f64 on the CPU and come back in the type and on the device of the arguments. There are first derivatives;
    a double backward (``create_graph=True``) is refused.

    Args:
        D, d, L_a, x_ss, l, a: tensors or numbers, mm; quantities with units, also round tensors, are converted.
        theta: tap angle, degrees; or
        delta: displacement of the object, mm.
        **model: as of :func:`vibrissa.strain`; no tensors.

    Returns:
        A tensor of the common shape.

    Raises:
        InputError: no drive, or two; what is no number; a quantity that does not convert; a model that is not allowed.
        RuntimeError: a double backward.
    """
    if (theta is None) == (delta is None):
        raise InputError("a tap has one drive", key="theta", allowed="theta (degrees) or delta (mm)")
    name, drive = ("theta", theta) if delta is None else ("delta", delta)
    _taps.of_model(model)
    given = _taps.without_units(dict(zip((*_NAMES, name), (D, d, L_a, x_ss, l, a, drive))), torch.Tensor).values()
    like = next((x for x in given if isinstance(x, torch.Tensor) and x.is_floating_point()), torch.empty(0, dtype=torch.float64))
    tensors = [x.to(like) if isinstance(x, torch.Tensor) else torch.as_tensor(x, dtype=like.dtype, device=like.device) for x in given]
    return _Strain.apply((*_NAMES, name), model, *torch.broadcast_tensors(*tensors))
