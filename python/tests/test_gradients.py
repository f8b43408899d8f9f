"""Derivatives of taps: against differences, in scipy, JAX and PyTorch, and distances that follow from them."""

import numpy as np
import pytest

import vibrissa

TAP = dict(D=10, d=4, L_a=50, x_ss=5, l=2, a=30, theta=4.0)
NEO = dict(material={"neo-hookean": 3.2}, surface=True, shear=True, extension=True, pole_radius=2.0)


def difference(name, step, **model):
    """By the reference, extrapolated to a step of 0."""
    def at(x):
        changed = {**TAP, **model}
        if name in changed:
            changed[name] += x
        return vibrissa.strain(**changed, backend="reference")

    one, two = ((at(h) - at(-h)) / (2 * h) for h in (step, step / 2))
    return (4 * two - one) / 3


@pytest.mark.parametrize("model", [{}, NEO, dict(geometry="linear"), dict(contact="stick", extension=True), dict(hub=4.0, side="far"), dict(exponent=1.4)])
def test_they_are_those_of_the_reference(model):
    names = ("D", "d", "L_a", "x_ss", "l", "a", "theta", *(name for name in ("hub", "pole_radius", "exponent") if name in model))
    value, slopes = vibrissa.strain(**TAP, **model, grad=names)
    assert value == vibrissa.strain(**TAP, **model) and slopes.shape == (len(names),)
    for name, slope in zip(names, slopes):
        expected = difference(name, 2e-3, **model)
        assert slope == pytest.approx(expected, rel=2e-7, abs=2e-9), name


def test_shapes_and_every_output():
    tap, jacobian = vibrissa.strain(10, 4, 50, 5, 2, np.array([[21.0], [30.0]]), np.array([1.0, 4.0, 8.0]), full=True, grad=["a", "theta"])
    assert tap.strain.shape == (2, 3) and jacobian.strain.shape == (2, 3, 2) and jacobian.K is jacobian.K_deviation
    h = 1e-3
    more, less = (vibrissa.strain(10, 4, 50, 5, 2, np.array([[21.0], [30.0]]) + x, np.array([1.0, 4.0, 8.0]), full=True) for x in (h, -h))
    for name in ("strain", "strain_linear", "K_deviation", "normal_force_N", "contact_arc_mm"):
        slope = (getattr(more, name) - getattr(less, name)) / (2 * h)
        assert getattr(jacobian, name)[..., 0] == pytest.approx(slope, rel=1e-5, abs=1e-8), name
    empty, none = vibrissa.strain(10, 4, 50, 5, 2, np.empty((0, 2)), 4.0, grad="a")
    assert empty.shape == (0, 2) and none.shape == (0, 2, 1)
    value, slopes = vibrissa.strain(10, 4, 50, 5, 2, [30.0, 60.0], 4.0, grad="a")
    assert np.isnan(value[1]) and np.isnan(slopes[1, 0]) and np.isfinite(slopes[0, 0])


@pytest.mark.parametrize("grad", ["b", "mu", "C10", "root.k_theta", ("a", "a"), 3])
def test_what_is_no_input_is_refused(grad):
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.strain(**TAP, grad=grad)
    assert caught.value.key == "grad"


def test_f64_is_the_default():
    fine = vibrissa.strain(**TAP)
    assert fine == vibrissa.strain(**TAP, precision="f64") != vibrissa.strain(**TAP, precision="f32")
    assert fine == pytest.approx(vibrissa.strain(**TAP, backend="reference"), rel=1e-8)


def fit(jacobian):
    """A whisker of 200 readings, by scipy; how often it asked for strains."""
    optimize = pytest.importorskip("scipy.optimize")
    rng = np.random.default_rng(3)
    a, theta = rng.uniform(20, 48, 200), rng.uniform(1, 8, 200)
    truth = np.array([10.2, 4.1, 5.3, 0.05])
    readings = vibrissa.strain(truth[0], truth[1], 50, truth[2], 2, a, theta + truth[3])
    readings = readings + 1e-6 * rng.standard_normal(200)
    asked = [0]

    def residuals(x):
        asked[0] += 1
        return (vibrissa.strain(x[0], x[1], 50, x[2], 2, a, theta + x[3]) - readings) / 1e-6

    def slopes(x):
        return vibrissa.strain(x[0], x[1], 50, x[2], 2, a, theta + x[3], grad=("D", "d", "x_ss", "theta"))[1] / 1e-6

    found = optimize.least_squares(residuals, [10, 4, 5, 0], jac=slopes if jacobian else "2-point", x_scale=[1, 1, 1, 0.1])
    assert found.success and np.abs(found.x - truth).max() < 0.05, found.x
    return asked[0]


def test_a_whisker_is_fitted_with_a_third_of_the_evaluations():
    assert 3 * fit(True) < fit(False)


def test_distances_without_a_calibration():
    whisker, gauge = dict(D=10, d=4, L_a=50), dict(x_ss=5, l=2, noise_strain=2e-5)
    a, theta = np.array([[22.0], [30.0], [41.0], [47.0]]), np.array([1.0, 4.0, 8.0])
    model = dict(surface=True, shear=True)
    readings = vibrissa.strain(10, 4, 50, 5, 2, a, theta, **model)
    far = dict(range=(20, 48))
    found = vibrissa.distance(readings, theta, whisker=whisker, gauge=gauge, model=model, estimate=far, grad=("strain", "theta", "d"))
    assert found.distance_mm == pytest.approx(np.broadcast_to(a, (4, 3)), rel=1e-7) and not found.status.any()
    slope = vibrissa.strain(10, 4, 50, 5, 2, a, theta, **model, grad="a")[1][..., 0]
    assert found.sigma_mm == pytest.approx(2e-5 / np.abs(slope), rel=1e-5)
    more, less = (vibrissa.distance(readings + x, theta, whisker=whisker, gauge=gauge, model=model).distance_mm for x in (1e-6, -1e-6))
    assert (more - less) / 2e-6 == pytest.approx(found.jacobian[..., 0], rel=1e-3)
    one = vibrissa.distance(1.0, 4.0, whisker=whisker, gauge=gauge)
    assert np.isnan(one.distance_mm) and one.status == vibrissa.Status.no_root
    low = vibrissa.distance(1e-5, 4.0, whisker=whisker, gauge=gauge)
    assert low.status == vibrissa.Status.ok and 5 < low.distance_mm < 7
    outside = vibrissa.distance(0.02, [-4.0, 0.0, 90.0], whisker=whisker, gauge=gauge)
    assert np.isnan(outside.distance_mm).all() and (outside.status == vibrissa.Status.invalid_geometry).all()
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.distance(0.01, 4.0, whisker=whisker, gauge=gauge, grad=3)
    assert caught.value.key == "grad"
    with pytest.raises(vibrissa.InputError) as caught:
        vibrissa.distance(0.01, 4.0, whisker=whisker, gauge=dict(x_ss=5))
    assert caught.value.key == "gauge.l"


def test_jax():
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp
    from jax.test_util import check_grads

    import vibrissa.jax

    def f(a, theta, d):
        return vibrissa.jax.strain(10.0, d, 50.0, 5.0, 2.0, a, theta, surface=True)

    value, slope = jax.jit(jax.value_and_grad(f))(30.0, 4.0, 4.0)
    expected, slopes = vibrissa.strain(**TAP, surface=True, grad=("a",))
    assert float(value) == expected and float(slope) == slopes[0]
    many = jax.vmap(jax.grad(f), in_axes=(0, None, None))(jnp.array([21.0, 30.0]), 4.0, 4.0)
    assert float(many[1]) == pytest.approx(slopes[0], rel=1e-12)
    check_grads(f, (30.0, 4.0, 4.0), order=1, eps=1e-3, rtol=1e-5)
    with pytest.raises(vibrissa.InputError):
        vibrissa.jax.strain(10.0, 4.0, 50.0, 5.0, 2.0, 30.0, 4.0, materal=1)


def test_torch():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed: it is large, and no requirement of the tests")
    import vibrissa.torch

    a = torch.tensor([21.0, 30.0], dtype=torch.float64, requires_grad=True)
    theta = torch.tensor(4.0, dtype=torch.float64, requires_grad=True)

    def f(a, theta):
        return vibrissa.torch.strain(10.0, 4.0, 50.0, 5.0, 2.0, a, theta)

    assert torch.autograd.gradcheck(f, (a, theta), eps=1e-4, atol=1e-8, rtol=1e-5)
    (slope,) = torch.autograd.grad(f(a, theta).sum(), a, create_graph=False)
    assert slope.numpy() == pytest.approx(vibrissa.strain(10, 4, 50, 5, 2, [21.0, 30.0], 4.0, grad="a")[1][:, 0])
    with pytest.raises(RuntimeError, match="first derivatives only"):
        torch.autograd.grad(f(a, theta).sum(), a, create_graph=True)


@pytest.mark.parametrize("model", [{}, dict(shear=True), dict(hub=5.0), dict(side="far")])
def test_slopes_of_the_linear_strain_alone_are_those_of_the_tap(model):
    """To the bit, also where there is no tap."""
    names = ("D", "d", "L_a", "x_ss", "l", "a", "theta")
    taps = np.random.default_rng(3).uniform([8, 3, 50, 3, 1, 2, 0.5], [12, 8, 55, 8, 4, 56, 10], (2000, 7)).T
    strain, slopes = vibrissa.strain(*taps, geometry="linear", grad=names, **model)
    tap, jacobian = vibrissa.strain(*taps, geometry="linear", grad=names, full=True, **model)
    assert np.isnan(strain).any() and np.array_equal(strain, tap.strain, equal_nan=True)
    assert np.array_equal(slopes, jacobian.strain, equal_nan=True)
