"""Ctrl-C within two seconds, callbacks, threads."""

import os
import pathlib
import queue
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import vibrissa

SWEEP = ("vibrissa.sweep(whisker=dict(D=vibrissa.axis(9, 11, steps=10**12), d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=vibrissa.axis(21, 48, steps=100),"
         "theta=vibrissa.axis(1, 10, steps=100)), output=dict(tuples=False, top=1), run={})")
ONE = "whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5)"
# Calls that no machine ends by itself.
ENDLESS = {
    "sweep": SWEEP.format('dict(backend="cpu", precision="f64")'),
    "sweep on a device": SWEEP.format('dict(backend="gpu")'),
    "sweep by the reference": SWEEP.format('dict(backend="reference")'),
    "strain": "vibrissa.strain(np.linspace(9, 11, 3_000_000), 4, 50, 5, 2, 30, 4.0, contact=dict(coulomb=0.3), extension=True, backend='reference')",
    "tap by the reference": f"vibrissa.tap({ONE}, tap=dict(a=vibrissa.axis(21, 48, steps=100_000)), run=dict(backend='reference'))",
    "verify": "vibrissa.verify(samples=10**6, run=dict(backend='cpu'))",
    # What these may be asked is bounded: one call after the other, each of many seconds.
    "tap": f"while True: vibrissa.tap({ONE}, tap=dict(a=vibrissa.axis(21, 48, steps=100_000)))",
    "chart": "while True: vibrissa.chart(whisker=dict(D=[8, 12], d=[0.2, 7], L_a=50), gauge=dict(x_ss=[3, 15], l=[1, 4]), tap=dict(a=vibrissa.axis(21, 48, steps=64), theta=[0.5, 60]),"
             "model=dict(contact=dict(coulomb=0.3), extension=True, surface=True))",
    "shape": "while True: vibrissa.shape(whisker=dict(D=10, d=0.2, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=vibrissa.axis(21, 48, steps=100), theta=vibrissa.axis(1, 80, steps=100)),"
             "model=dict(extension=True, contact=dict(coulomb=0.3)))",
}
RUN = """
import sys, time, signal
import numpy as np
import vibrissa
print("go", flush=True)
try:
    {call}
except KeyboardInterrupt as stop:
    print("stopped", getattr(getattr(stop, "result", None), "value", None), flush=True)
    time.sleep(3600)
"""
# Work that may still be done after Ctrl-C: two seconds of every core. Unlike the clock it does not depend on what else the machine does.
PROMPT = 2.0 * os.cpu_count()


def work(process):
    """CPU time of a process so far, s."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def interrupted(call, under_way="go", ends=False):
    """What is said after Ctrl-C in the middle of a call, which has said ``under_way`` and then computed for a second. With ``ends`` work does not go on."""
    # A job in the background of a shell inherits that the signal is ignored.
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    process = subprocess.Popen([sys.executable, "-c", RUN.format(call=call)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
    lines = queue.SimpleQueue()
    reader = threading.Thread(target=read, args=(process.stdout, lines))
    reader.start()
    try:
        while (said := lines.get()) != under_way:
            assert said != ENDED, process.stderr.read()
        before, begun = work(process), time.monotonic()
        # A device may do all the work.
        while work(process) < before + 1.0 and time.monotonic() < begun + 30.0:
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)
        most = work(process) + PROMPT
        process.send_signal(signal.SIGINT)
        while (said := answer(process, lines, most)) == under_way:
            pass
        # A thread that was left behind ends soon, too.
        while ends and said != ENDED and works_on(process):
            assert work(process) < most, "it works on after the interrupt"
        return said
    finally:
        process.kill()
        reader.join()
        process.communicate()


ENDED = "no more lines"


def read(stream, lines):
    for line in stream:
        lines.put(line.strip())
    lines.put(ENDED)


def answer(process, lines, most):
    """The next line of a process; fails if it works for longer instead."""
    while True:
        try:
            return lines.get(timeout=0.02)
        except queue.Empty:
            assert work(process) < most, f"{work(process) - most + PROMPT} s of work after Ctrl-C"


def works_on(process):
    """Whether a process works within a second."""
    before = work(process)
    time.sleep(1.0)
    return work(process) > before


on_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="CPU time of another process is read from /proc")


@on_linux
@pytest.mark.parametrize("name", ["sweep", "sweep on a device", "sweep by the reference", "strain", "verify"])
def test_ctrl_c(name):
    assert interrupted(ENDLESS[name]).startswith("stopped")


@on_linux
@pytest.mark.parametrize("name", ["chart", "shape", "tap", "tap by the reference"])
def test_work_ends_with_its_call(name):
    assert interrupted(ENDLESS[name], ends=True).startswith("stopped")


@on_linux
def test_a_search_keeps_the_best_so_far(root):
    # Whiskers that are calibrated as another one have no charts: their taps are solved.
    solved = dict(D=0.05, x_ss=0.3, samples=4096, calibrated="nominal")
    tell = "lambda step: print('a design', flush=True)"
    call = f"vibrissa.optimise({str(root / 'sweeps/robust.toml')!r}, optimise=dict(robust={solved}), run=dict(backend='cpu'), callback={tell})"
    assert float(interrupted(call, under_way="a design").split()[1]) > 0


def test_a_callback_ends_a_search(root):
    seen = []
    result = vibrissa.optimise(root / "sweeps/design.toml", run=dict(backend="cpu"), callback=lambda step: seen.append(step) or step.evaluations >= 200)
    assert result.ended_by == "interrupted" and 200 <= result.run["counts"]["evaluations"] < 5000
    assert seen[0].evaluations < seen[-1].evaluations and seen[-1].left is not None

    def broken(step):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        vibrissa.optimise(root / "sweeps/design.toml", run=dict(backend="cpu"), callback=broken)


def test_progress():
    seen = []
    sections = dict(whisker=dict(D=vibrissa.axis(9, 11, steps=40), d=4, L_a=50), gauge=dict(x_ss=5, l=2), run=dict(backend="cpu"))
    vibrissa.sweep(**sections, tap=dict(a=vibrissa.axis(21, 48, steps=100), theta=vibrissa.axis(1, 10, steps=100)), output=dict(tuples=False), progress=lambda *at: seen.append(at))
    assert seen[-1] == (400_000, 400_000) and all(a <= b for (a, _), (b, _) in zip(seen, seen[1:]))
    seen.clear()
    vibrissa.strain(np.linspace(9, 11, 300_000), 4, 50, 5, 2, 30, 4.0, progress=lambda *at: seen.append(at))
    assert seen[-1] == (300_000, 300_000) and len(seen) > 1

    def broken(done, total):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        vibrissa.sweep(**sections, tap=dict(a=[30], theta=[1]), progress=broken)
    vibrissa.sweep(**sections, tap=dict(a=[30], theta=[1]), progress=True)


@pytest.mark.parametrize("backend, n", [("cpu", 100_000), ("reference", 200)])
def test_the_lock_is_free_while_taps_are_solved(backend, n):
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    try:
        # However many taps there are, a thread that waits for the lock counts no more than one or two.
        for times in 4 ** np.arange(3):
            D, before = np.linspace(9, 11, n * times), counted[0]
            vibrissa.strain(D, 4, 50, 5, 2, 30, 4.0, backend=backend)
            if (free := counted[0] - before > 20):
                break
    finally:
        done.set()
        counter.join()
    assert free


def test_threads_share():
    expected = vibrissa.strain(np.linspace(9, 11, 500), 4, 50, 5, 2, 30, 4.0)
    found = [None] * 8

    def ask(k):
        for _ in range(20):
            found[k] = vibrissa.strain(np.linspace(9, 11, 500), 4, 50, 5, 2, 30, 4.0)

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    for answer in found:
        np.testing.assert_array_equal(answer, expected)


@pytest.mark.parametrize("n", [1, 3])
def test_threads_as_asked(n):
    result = vibrissa.sweep(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30], theta=[1, 2]), run=dict(backend="cpu", threads=n))
    assert result.run["backend"]["threads"] == n
