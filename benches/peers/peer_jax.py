"""JAX, f32, jit + vmap over taps on all cores: classical Runge-Kutta shooting with a fixed number of steps and corrections."""

import functools
import os
import sys

CORES = len(os.sched_getaffinity(0))
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = f"--xla_force_host_platform_device_count={CORES}"

import jax
import jax.numpy as jnp
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from problem import Taps, best_time, report


def shoot(steps, corrections, tau, a, theta, x1, x2, q, c):
    """q and S(x1) - S(x2) of one tap."""

    def slope(q, c, t, y):
        u = 1 / (1 - tau * (c - t))
        return jnp.stack([q * y[1] * u**4, jnp.cos(y[0]), jnp.sin(y[0]), y[1] * u**3])

    def march(q, c, begin, end, n, y):
        h = (end - begin) / n

        def step(i, y):
            t = begin + i * h
            k1 = slope(q, c, t, y)
            k2 = slope(q, c, t + h / 2, y + h / 2 * k1)
            k3 = slope(q, c, t + h / 2, y + h / 2 * k2)
            k4 = slope(q, c, t + h, y + h * k3)
            return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

        return jax.lax.fori_loop(0, n, step, y)

    def correct(_, state):
        q, c, _ = state
        far = march(q, c, 0.0, c - x2, steps - 2 * (steps // 6), jnp.zeros(4))
        near = march(q, c, c - x2, c - x1, steps // 6, far)
        base = march(q, c, c - x1, c, steps // 6, near)
        angle = base[0] - jnp.arctan2(base[2], base[1])
        gauge = q * (near[3] - far[3])
        return q * theta / angle, c + a - jnp.hypot(base[1], base[2]), gauge

    q, c, gauge = jax.lax.fori_loop(0, corrections, correct, (q, c, q))
    return gauge


def main(path):
    taps = Taps(path)
    taps = taps.take(slice(len(taps) // CORES * CORES))
    spread = NamedSharding(Mesh(jax.devices(), "taps"), PartitionSpec("taps"))
    columns = [jax.device_put(x.astype("float32"), spread) for x in (*taps.inputs(), *taps.start())]
    for steps, corrections in ((12, 5), (24, 8)):
        run = jax.jit(jax.vmap(functools.partial(shoot, steps, corrections)))
        gauge, seconds = best_time(lambda: run(*columns).block_until_ready())
        report(f"JAX f32 jit+vmap, RK4 {steps} steps x {corrections}", taps, seconds, taps.strain_of(1, gauge))


main(sys.argv[1])
