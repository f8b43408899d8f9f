"""JAX, f32, jit + vmap over taps on all cores, or with JAX_PLATFORMS=cuda on a GPU, where the taps are repeated until they fill it:
classical Runge-Kutta shooting with a fixed number of steps and corrections."""

import functools
import os
import sys

CORES = len(os.sched_getaffinity(0))
ON_CPU = os.environ.setdefault("JAX_PLATFORMS", "cpu") == "cpu"
if ON_CPU:
    os.environ["XLA_FLAGS"] = f"--xla_force_host_platform_device_count={CORES}"

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from problem import Taps, best_time, report
from shooting import shoot


def main(path):
    taps = Taps(path)
    taps = taps.take(slice(len(taps) // CORES * CORES) if ON_CPU else np.arange(1 << 22) % len(taps))
    spread = NamedSharding(Mesh(jax.devices(), "taps"), PartitionSpec("taps"))
    columns = [jax.device_put(x.astype("float32"), spread) for x in (*taps.inputs(), *taps.start())]
    for steps, corrections in ((12, 5), (24, 8)):
        run = jax.jit(jax.vmap(functools.partial(shoot, steps, corrections)))
        gauge, seconds = best_time(lambda: run(*columns).block_until_ready())
        report(f"JAX f32 jit+vmap, RK4 {steps} steps x {corrections}", taps, seconds, taps.strain_of(1, gauge))


main(sys.argv[1])
