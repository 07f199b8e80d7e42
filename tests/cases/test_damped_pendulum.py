"""Case a3: a physical pendulum with a viscous damper in its joint; where its energy goes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import INDEX_3, SCHEMES, name_of
from tests.helpers import assert_second_order
from tests.problems import case, integrated

A3 = case("a3-physical-pendulum-damper")
m, J_c, d, c, g = (A3.definition[name] for name in ("m", "I_com", "d", "c", "g"))


def bar(loss: Any, cut: str = "auto") -> mbd.Model:
    """A rigid body whose mass center hangs d below its pivot."""
    model = mbd.Model("bar", gravity=(0.0, -g, 0.0), cut=cut)
    body = mbd.RigidBody("bar", mass=m, inertia=(0.2, 0.1, J_c), center=(0.0, -d, 0.0))
    model.connect(mbd.Revolute("pivot", model.ground.origin, body.origin, loss=loss))
    return model


def lagrangian() -> mbd.Lagrangian:
    """The same by its energies and its dissipation function."""
    return mbd.Lagrangian(
        "bar",
        [mbd.Coordinate("pivot.angle")],
        kinetic=lambda pivot_angle_rate: 0.5 * (J_c + m * d * d) * pivot_angle_rate**2,
        potential=lambda pivot_angle: -m * g * d * mbd.cos(pivot_angle),
        dissipation=lambda pivot_angle_rate: 0.5 * c * pivot_angle_rate**2,
    )


def viscous() -> mbd.Model:
    return bar(mbd.Viscous(c))


def dissipation_function() -> mbd.Model:
    return bar(mbd.Dissipation(lambda rate: 0.5 * c * rate * rate))


def cut() -> mbd.Model:
    return bar(mbd.Viscous(c), cut="all")


def started(model: Any, angle: float, rate: float = 0.0) -> mbd.State:
    name = "bar floating.angle" if getattr(model, "cut", "auto") == "all" else "pivot.angle"
    return mbd.assemble(model, position={name: angle}, velocity={f"{name}.rate": rate})


PAIRS = [
    pytest.param(build, scheme, id=f"{build.__name__}, {scheme!r}")
    for build in (viscous, dissipation_function, lagrangian, cut)
    for scheme in ([*SCHEMES, *INDEX_3] if build is cut else SCHEMES)
]


@pytest.mark.parametrize(("build", "scheme"), PAIRS)
def test_a_damped_swing_meets_the_reference_to_second_order(build: Any, scheme: NewmarkFamily) -> None:
    model = build()
    start, reference = started(model, A3.start["theta0"]), A3["[theta, thetadot]"]

    def errors(dt: float) -> list[float]:
        runs = [mbd.simulate(model, start, scheme, dt=dt, until=t, store=100000) for t in reference.t]
        found = np.array([[run["pivot.angle"][-1], run["pivot.angle.rate"][-1]] for run in runs])
        return [float(np.linalg.norm(each)) for each in found - reference.value]

    assert_second_order(errors, 0.004)


@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_the_damper_takes_the_energy_that_the_swing_loses(scheme: NewmarkFamily) -> None:
    """The loss is integrated on its own; what is left over is the integrator's, and falls with dt²."""
    model = viscous()
    start, lost = started(model, A3.start["theta0"]), A3["energy dissipated"]

    def errors(dt: float) -> list[float]:
        energy = mbd.simulate(model, start, scheme, dt=dt, until=lost.t).energy
        assert sum(energy.sums.values()) == pytest.approx(energy.change, abs=1e-12)
        assert set(energy.sums) == {"pivot loss", "numerical"}
        return [energy.sums["pivot loss"] + lost.value, energy.change + lost.value]

    assert_second_order(errors, 0.004)


def test_a_small_swing_decays_and_oscillates_as_the_linear_oscillator_does() -> None:
    """Logarithmic decrement and period between zero crossings, extrapolated to dt = 0, at an amplitude of 1e-4."""
    model = viscous()
    model.constrain(mbd.Event("lowest", mbd.measure("pivot.angle", unit="rad")))
    start = started(model, 1e-4)

    def measured(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, mbd.Newmark(), dt=dt, until=8.0)
        times = np.array([event.time for event in run.events])
        speeds = np.abs(run.at(times)["pivot.angle.rate"])
        damped, decay = math.pi * (len(times) - 1) / (times[-1] - times[0]), math.log(speeds[0] / speeds[-1])
        decay /= times[-1] - times[0]
        return np.array([decay / math.hypot(decay, damped), math.hypot(decay, damped)])

    coarse, fine = measured(2e-3), measured(1e-3)
    found = fine + (fine - coarse) / 3.0
    assert found[0] == pytest.approx(A3["small-angle damping ratio"].value, abs=1e-7)
    assert found[1] == pytest.approx(A3["small-angle natural frequency"].value, abs=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_viscous_and_quadratic_losses_add_up(scheme: NewmarkFamily) -> None:
    """Another bar, started with speed, against its own equation of motion with the loss as an extra state."""
    quadratic, until, first = 0.8, 3.0, [-0.4, 6.0]
    model, J = bar(mbd.Viscous(c) + mbd.Quadratic(quadratic)), J_c + m * d * d

    def motion(t: float, y: Any) -> list[float]:
        torque = c * y[1] + quadratic * abs(y[1]) * y[1]
        return [y[1], -(m * g * d * math.sin(y[0]) + torque) / J, torque * y[1]]

    angle, rate, lost = integrated(motion, [*first, 0.0], until)
    start = started(model, *first)

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=until)
        return [run["pivot.angle"][-1] - angle, run["pivot.rate"][-1] - rate, run.energy.sums["pivot loss"] + lost]

    assert_second_order(errors, 2e-3)
