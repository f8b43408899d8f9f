"""Value and gradient (d, a, θ) of the ideal rod in JAX (jit, vmap, f64) and here, on the same taps, in one run. Prints a table.

    python benches/gradients/against_jax.py [TAPS]

In JAX it is the shooting problem of benches/peers/shooting.py, by the classical Runge-Kutta method with as many steps and corrections as its error needs.
"""

import functools
import pathlib
import sys
import time

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp

import vibrissa

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "peers"))
from shooting import shoot


def strain(steps, corrections, d, a, theta, D, L_a, x_ss, l):
    tau, cos = (D - d) / (D * L_a), 1 / jnp.sqrt(1 + ((D - d) / (2 * L_a)) ** 2)
    x1, x2, theta = x_ss, x_ss + l * cos, jnp.radians(theta)
    begin = 3 * theta * (1 - tau * a) / a**2
    return 0.5 * D * shoot(steps, corrections, tau, a, theta, x1, x2, begin, a) / (x2 - x1)


def timed(run, repeats=3):
    found, seconds = run(), []
    for _ in range(repeats):
        begun = time.perf_counter(), time.process_time()
        run()
        seconds.append((time.perf_counter() - begun[0], time.process_time() - begun[1]))
    return found, min(wall for wall, _ in seconds), min(cpu for _, cpu in seconds)


def main(n=2000):
    g = np.random.default_rng(1)
    D, d, L_a, x_ss, l, a, theta = g.uniform([8, 3, 50, 3, 1, 21, 0.5], [12, 8, 55, 8, 4, 45, 10], (n, 7)).T
    names = ("d", "a", "theta")
    columns = dict(D=D, d=d, L_a=L_a, x_ss=x_ss, l=l, a=a, theta=theta)
    (value, slopes), wall, cpu = timed(lambda: vibrissa.strain(**columns, grad=names))
    plain = timed(lambda: vibrissa.strain(**columns))[1:]
    largest = np.abs(slopes).max(0)
    print("| | taps | wall, µs a tap | CPU, µs a tap | error of the strain | of the gradient, of the column's largest |\n|---|---|---|---|---|---|")
    print(f"| `vibrissa.strain`, f64 | {n} | {1e6 * plain[0] / n:.2f} | {1e6 * plain[1] / n:.2f} | | |")
    print(f"| `vibrissa.strain(grad=(\"d\", \"a\", \"theta\"))`, f64 | {n} | {1e6 * wall / n:.2f} | {1e6 * cpu / n:.2f} | | |", flush=True)
    for steps, corrections in ((24, 8), (48, 12), (96, 16)):
        both = jax.jit(jax.vmap(jax.value_and_grad(functools.partial(strain, steps, corrections), argnums=(0, 1, 2))))
        arguments = [jnp.asarray(x) for x in (d, a, theta, D, L_a, x_ss, l)]
        (found, by), wall_, cpu_ = timed(lambda: jax.block_until_ready(both(*arguments)), 2)
        off = np.abs(np.asarray(found) / value - 1).max(), (np.abs(np.stack(by, -1) - slopes) / largest).max()
        print(f"| JAX, RK4 of {steps} steps, {corrections} corrections, f64 | {n} | {1e6 * wall_ / n:.1f} ({wall_ / wall:.1f} ×) | {1e6 * cpu_ / n:.1f} ({cpu_ / cpu:.1f} ×) | {off[0]:.1e} | {off[1]:.1e} |",
              flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
