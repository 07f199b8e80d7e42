"""Case a3: a physical pendulum with a viscous damper in its joint, and with a quadratic one beside it."""

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
