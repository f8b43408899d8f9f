"""Forked children, which have none of the threads of their parent."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")

BEGIN = """
import os, sys
import numpy as np
import vibrissa
SECTIONS = dict(whisker=dict(D=vibrissa.axis(9, 11, steps=40), d=4, L_a=50), gauge=dict(x_ss=5, l=2, noise_strain=1e-5), tap=dict(a=[21, 30, 39, 48], theta=[1, 4, 8]))
MANY = np.linspace(9, 11, 50_000)
ONE = {**SECTIONS, "whisker": dict(D=10, d=4, L_a=50)}

def all_of_it(backend="cpu"):
    swept = vibrissa.sweep(**SECTIONS, run=dict(backend=backend))
    measured = vibrissa.simulate(**ONE, repeats=3)
    locator = vibrissa.calibrate(measured, whisker=ONE["whisker"], gauge=ONE["gauge"]).locator()
    return [vibrissa.strain(MANY, 4, 50, 5, 2, 30, 4.0).tolist(), vibrissa.strain(MANY[:100], 4, 50, 5, 2, 30, 4.0).tolist(),
            vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0), vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0, backend="auto") > 0,
            vibrissa.shape(**ONE, nodes=3).shape["y_mm"].tolist(), swept.designs["K_sd"].tolist(), locator.locate(4.0, 0.02), locator.locate(measured).distance_mm.tolist(), vibrissa.tap(**{**ONE, "tap": dict(a=[21, 30])}).optimum]

def child(f):
    sys.stdout.flush()
    if (pid := os.fork()) == 0:
        try:
            print(f(), flush=True)
        finally:
            os._exit(0)
    os.waitpid(pid, 0)
"""


def said(text):
    done = subprocess.run([sys.executable, "-c", BEGIN + text], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and not done.stderr.replace("DeprecationWarning", "").count("Error"), done.stderr
    return done.stdout.splitlines()


def test_a_child_computes_the_same():
    assert said("expected = all_of_it()\nchild(lambda: all_of_it() == expected)\nchild(lambda: (child(lambda: all_of_it() == expected), all_of_it() == expected)[1])") == ["True"] * 3


def test_a_gpu_is_left_to_the_parent():
    lines = said("""
taken = vibrissa.sweep(**SECTIONS, run=dict(backend="gpu")).run["backend"]
print(taken["name"])
child(lambda: vibrissa.sweep(**SECTIONS).run["backend"])
def told():
    import warnings
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for _ in range(2):
            vibrissa.sweep(**SECTIONS)
    return [str(w.message) for w in told if "forked" in str(w.message)]
child(lambda: len(told()))
def asked():
    try:
        return vibrissa.sweep(**SECTIONS, run=dict(backend="gpu"))
    except vibrissa.RunError as e:
        return e
child(asked)
""")
    assert "'cpu'" in lines[1] and "forked" in lines[1] and lines[2] == "1" and "forked" in lines[3] and "spawn" in lines[3], lines


def test_a_child_forked_amid_work_says_so():
    lines = said("""
def refused():
    answers = []
    for call in (all_of_it, lambda: vibrissa.strain(10, 4, 50, 5, 2, 30, 4.0), lambda: vibrissa.strain(MANY, 4, 50, 5, 2, 30, 4.0), vibrissa.devices):
        try:
            answers.append(call())
        except vibrissa.RunError as e:
            answers.append("forked" in str(e) and "spawn" in str(e))
    return answers
class Enough(Exception):
    pass
def part(done, total):
    # The first of many: the others are under way.
    child(refused)
    raise Enough
try:
    vibrissa.strain(np.linspace(9, 11, 3_000_000), 4, 50, 5, 2, 30, 4.0, contact=dict(coulomb=0.3), extension=True, progress=part)
except Enough:
    print(len(all_of_it()))
""")
    assert lines == ["[True, True, True, True]", "9"], lines
