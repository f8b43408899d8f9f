"""The ideal rod in JAX: classical Runge-Kutta shooting with a fixed number of steps and corrections."""

import jax
import jax.numpy as jnp


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
