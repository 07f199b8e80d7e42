"""Rope over a drum: `Unilateral` friction on the difference of its two lengths, the law of Euler and Eytelwein."""

import numpy as np
import pytest

import mbd

LENGTH, G = 2.0, 9.81


def over_a_drum(first: float, second: float, mu: float, wrap: float, drum: float | None = None):
    """Two masses that hang on a rope over a drum of radius 0.1 m, which turns freely with an inertia or not at all."""
    model, bodies = mbd.Model("drum"), [mbd.PointMass("first", first), mbd.PointMass("second", second)]
    for body in bodies:
        model.connect(mbd.Prismatic(f"{body.name} rail", model.ground.origin, body.origin, axis=(0, -1, 0)))
    names = ["first rail.displacement", "second rail.displacement"]
    carried = 0.0
    if drum is not None:
        wheel = mbd.RigidBody("wheel", 1.0, (drum, drum, drum))
        model.connect(mbd.Revolute("axle", model.ground.origin, wheel.origin))
        names.append("axle.angle")
        carried = 0.1
    rope = mbd.measure(
        lambda a, b, turn=0.0: LENGTH - a - b, *names, tangents=lambda a, b, turn=0.0: b - a - 2.0 * carried * turn
    )
    model.constrain(mbd.Unilateral("rope", rope, friction=float(np.tanh(0.5 * mu * wrap))))
    position = {"first rail.displacement": 1.0, "second rail.displacement": 1.0}
    return model, mbd.assemble(model, position, closed="rope")


def tensions(run):
    """T₁ and T₂: the force of the contact less and plus its friction."""
    return run["rope.force"] - run["rope.friction"], run["rope.force"] + run["rope.friction"]


@pytest.mark.parametrize("seed", range(8))
def test_the_tensions_of_a_sliding_rope_have_the_ratio_of_euler(seed):
    """It holds while the masses' ratio is below e^{μφ}; else ``a = g (m₂ − k m₁)/(m₂ + k m₁)``, k = e^{μφ}."""
    rng = np.random.default_rng(seed)
    mu, wrap = rng.uniform(0.1, 0.5), rng.uniform(0.5, 4.0)
    ratio = float(np.exp(mu * wrap))
    first = rng.uniform(0.5, 2.0)
    second = first * (ratio * rng.uniform(1.1, 2.0) if seed % 2 else ratio ** rng.uniform(-0.9, 0.9))
    model, start = over_a_drum(first, second, mu, wrap)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-2, until=0.3)
    low, high = tensions(run)
    if seed % 2:
        expected = G * (second - ratio * first) / (second + ratio * first)
        np.testing.assert_allclose(np.abs(run["second rail.rate"]), expected * run.time, atol=1e-9)
        np.testing.assert_allclose(np.maximum(low, high) / np.minimum(low, high), ratio, rtol=1e-9)
    else:
        np.testing.assert_allclose(run["second rail.rate"], 0.0, atol=1e-12)
        np.testing.assert_allclose(sorted((low[-1], high[-1])), sorted((first * G, second * G)), rtol=1e-9)
    assert run.energy["rope friction"][-1] <= 1e-12
    np.testing.assert_allclose(run.energy["numerical"], 0.0, atol=1e-6)


def test_a_drum_is_carried_along_or_slips_below_the_rope():
    """A light drum turns with the rope; one of much inertia is turned by ``r (T₂ − T₁)`` as the rope slips over it."""
    light, start = over_a_drum(1.0, 1.5, 0.3, np.pi, drum=1e-4)
    run = mbd.simulate(light, start, mbd.HHT(0.05), dt=1e-2, until=0.3)
    expected = 0.5 * G / (2.5 + 1e-4 / 0.1**2)
    np.testing.assert_allclose(run["second rail.rate"], expected * run.time, atol=1e-9)
    np.testing.assert_allclose(run["axle.rate"], 10.0 * run["second rail.rate"], atol=1e-9)
    heavy, start = over_a_drum(1.0, 6.0, 0.3, np.pi, drum=10.0)
    run = mbd.simulate(heavy, start, mbd.HHT(0.05), dt=1e-2, until=0.2)
    low, high = tensions(run)
    np.testing.assert_allclose(np.maximum(low, high) / np.minimum(low, high), np.exp(0.3 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(np.abs(run["axle.rate"]), 0.1 * np.abs(high - low) * run.time / 10.0, atol=1e-9)


def test_derivatives_by_the_friction_of_a_rope_are_those_of_the_closed_form():
    """``∂v/∂m`` with m = tanh(μφ/2): v = g t (m₂ (1 − m) − m₁ (1 + m))/(m₂ (1 − m) + m₁ (1 + m))."""
    model, start = over_a_drum(1.0, 4.0, 0.3, np.pi)
    found = mbd.sensitivities(
        model, start, mbd.HHT(0.05), 1e-2, until=0.3, wrt=["rope.mu"], of=["second rail.rate"]
    )  # fmt: skip
    m = float(np.tanh(0.15 * np.pi))
    weight = 4.0 * (1.0 - m) + (1.0 + m)
    assert found["second rail.rate", "rope.mu"] == pytest.approx(-16.0 * G * 0.3 / weight**2, rel=1e-8)
