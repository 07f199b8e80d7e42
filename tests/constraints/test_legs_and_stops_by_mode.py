"""A hopper whose leg a mode lengthens, and a viscoelastic stop in steps that follow a tolerance, beside scipy."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd

GRAVITY, MASS, STIFFNESS, LOSS = 9.81, 10.0, 4000.0, 3.0
SHORT, LONG, THRUST = 0.5, 0.53, 0.1


def hopper():
    """A body over a spring leg, which is longer for 0.1 s from the deepest point on."""
    model = mbd.Model("hopper")
    body = mbd.PointMass("body", MASS)
    lift = mbd.Prismatic("p", model.ground.origin, body.origin, axis=(0, 1, 0), loss=mbd.Viscous(LOSS))
    model.connect(lift)
    tip = mbd.measure(lambda y, length: y - length, "p.displacement", "phase.length")
    causes = [
        mbd.Transition("flight", "compression", on="leg"),
        mbd.Transition("compression", "thrust", when="p.rate", direction=1),
        mbd.Transition("thrust", "flight", after=THRUST),
    ]
    model.constrain(
        mbd.Penalty("leg", tip, STIFFNESS, 0.0),
        mbd.Mode("phase", ("flight", "compression", "thrust"), transitions=causes, numbers={"length": SHORT},
                 sets={"phase.length": {"thrust": LONG}}),
    )  # fmt: skip
    return model, mbd.assemble(model, {"p.displacement": 0.8})


def test_the_ledger_closes_where_a_mode_lengthens_a_leg():
    model, start = hopper()
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=2.0)
    assert not run.stats["notes"]
    assert np.max(np.abs(run.energy.numerical)) < 1e-10
    leg = run.energy["leg"]
    thrusts = [event for event in run.events if event.name == "phase: compression to thrust"]
    ends = [event for event in run.events if event.name == "leg" and event.kind == "opened"]
    row = ends[-1].row
    inside = [event for event in thrusts if event.time < ends[-1].time]
    given = sum(
        0.5 * STIFFNESS * ((SHORT - y + LONG - SHORT) ** 2 - (SHORT - y) ** 2)
        for y in (float(run.at([event.time])["p.displacement"][0]) for event in inside)
    )
    assert len(inside) >= 2 and leg[row] == pytest.approx(given, rel=1e-9)


def test_a_maxwell_stop_is_struck_in_steps_that_follow_a_tolerance():
    k, branch, c, mass = 400.0, 900.0, 12.0, 2.0
    model = mbd.Model("stop")
    body = mbd.PointMass("body", mass)
    model.connect(mbd.Prismatic("p", model.ground.origin, body.origin, axis=(0, 1, 0)))
    model.constrain(mbd.MaxwellStop("stop", mbd.measure(lambda y: y, "p.displacement"), k, branch, c))
    start, touch = mbd.assemble(model, {"p.displacement": 0.3}), float(np.sqrt(0.6 / GRAVITY))

    def rates(t: float, y: Any) -> list[float]:
        stretch = -y[0] - y[2]
        return [y[1], -GRAVITY + (-k * y[0] + branch * stretch) / mass, branch * stretch / c]

    pressed = solve_ivp(rates, (touch, touch + 0.05), [0.0, -GRAVITY * touch, 0.0], "DOP853", rtol=1e-13, atol=1e-14)
    for scheme in mbd.RungeKutta853(), mbd.RadauIIA():
        run = mbd.simulate(model, start, scheme, tol=1e-9, until=touch + 0.05)
        found = run["p.displacement"][-1], run["p.rate"][-1], run["stop.flow"][-1]
        np.testing.assert_allclose(found, pressed.y[:, -1], atol=1e-7)
        assert len(run.time) < 200
