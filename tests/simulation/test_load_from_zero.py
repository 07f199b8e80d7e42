"""Feet that rest without any load, and a force that grows from zero: with r the pull beyond friction, x″ = r tᵖ/m."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd

MASS, MU = 2.0, 0.25
SCHEMES = [
    (mbd.HHT(0.05), {"dt": 1e-3}, 1e-6), (mbd.HHT(0.05, formulation="index3"), {"dt": 1e-3}, 1e-6),
    (mbd.Newmark(), {"dt": 1e-3}, 1e-6), (mbd.RadauIIA(), {"dt": 1e-2}, 1e-11),
    (mbd.RungeKutta853(), {"dt": 1e-2}, 1e-11), (mbd.RungeKutta4(), {"dt": 1e-3}, 1e-11),
    (mbd.RadauIIA(), {"tol": 1e-9}, 1e-8), (mbd.RungeKutta853(), {"tol": 1e-9}, 1e-8),
    (mbd.HHT(0.05), {"dt": 1e-3, "contact": "nonsmooth"}, 1e-6),
]  # fmt: skip
NAMES = [f"{scheme!r} {settings}" for scheme, settings, _ in SCHEMES]


def at_rest(feet, space, pressure, pull, power, angle):
    """A body on feet in a line without gravity; the pull goes sideways, at an angle in space."""
    model = mbd.Model("unloaded", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("block", MASS, (0.1, 0.1, 0.1))
    joint = mbd.Free if space else mbd.Planar
    model.connect(joint("move", model.ground.origin, body.origin))
    places = [0.0] if feet == 1 else np.linspace(-0.2, 0.2, feet)
    for k, x in enumerate(places):
        touch = mbd.touchdown(body.point(float(x), 0.0 if feet == 1 else -0.08, 0.0))
        model.constrain(mbd.Unilateral(f"foot {k}", touch, friction=MU))
    along, across = pull * np.cos(angle), pull * np.sin(angle)
    model.apply(
        mbd.Applied(
            "push", body.origin, arguments=("t",),
            force=lambda t: (along * t**power, -pressure * t**power, across * t**power),
        )
    )  # fmt: skip
    return model, mbd.assemble(model, closed=[f"foot {k}" for k in range(len(places))])


@pytest.mark.parametrize(("scheme", "steps", "close"), SCHEMES, ids=NAMES)
@settings(max_examples=6)
@given(
    feet=st.integers(1, 3), space=st.booleans(), pressure=st.sampled_from([0.0, 0.4, 1.0]),
    pull=st.sampled_from([-1.0, 0.6, 1.3]), power=st.integers(1, 2), angle=st.sampled_from([0.7, 2.5, 4.0]),
)  # fmt: skip
def test_a_foot_slides_the_way_that_a_force_from_zero_pulls_it(
    scheme, steps, close, feet, space, pressure, pull, power, angle
):
    if feet > 1 and pressure == 0.4:  # ends by name: a foot would lift while both stick, at the instant when they slip
        pressure = 1.0
    feet, angle = (1, angle) if space else (feet, 0.0)
    model, start = at_rest(feet, space, pressure, pull, power, angle)
    run = mbd.simulate(model, start, scheme, until=1.0, progress=False, **steps)
    size = abs(pull)
    acceleration = max(0.0, size - MU * pressure) / MASS * np.sign(pull)
    end = acceleration / ((power + 1) * (power + 2))
    assert run["move.x"][-1] == pytest.approx(end * np.cos(angle), abs=close)
    if space:
        assert run["move.z"][-1] == pytest.approx(end * np.sin(angle), abs=close)
    assert len(run.events) <= 2 * feet  # each slips, and may open
