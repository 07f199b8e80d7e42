"""Round feet and soles: what touches does not slip, what strikes keeps its moment of momentum, and shapes agree."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.constraints.soles import sole_of
from mbd.errors import CapabilityError, ModelError
from mbd.tape.table import Table
from tests.helpers import FreeScope
from tests.instances import SOLE, egg

RADIUS, INERTIA = 0.2, 0.02


@cache
def wheel(kind="arc", friction=None, slope=0.1):
    model, body = mbd.Model("wheel", gravity=mbd.on_slope(slope)), mbd.RigidBody("wheel", 1.0, (1.0, 1.0, INERTIA))
    model.connect(mbd.Planar("p", model.ground.origin, body.origin))
    hub = body.point(0.0, 0.0, name="hub")
    foot = (
        mbd.rolling_touchdown(hub, RADIUS)
        if kind == "arc"
        else mbd.profile_touchdown(hub, lambda psi: RADIUS + 0 * psi)
    )
    model.constrain(mbd.Unilateral("foot", foot, friction=friction))
    return model


@pytest.mark.parametrize("kind", ["arc", "sole"])
def test_a_round_foot_rolls_down_a_slope_over_any_number_of_turns(kind):
    """``a = g sin γ/(1 + I/(m r²))``, v = −r ω, x = −r φ."""
    until = 3.0 if kind == "arc" else 0.5
    start = mbd.assemble(wheel(kind), closed="foot", position={"p.x": 0.0, "p.angle": 0.7})
    run = mbd.simulate(wheel(kind), start, mbd.HHT(), dt=2e-3, until=until)
    way = 0.5 * 9.81 * math.sin(0.1) / (1.0 + INERTIA / RADIUS**2) * until**2
    assert run["p.x"][-1] == pytest.approx(way, rel=1e-9)
    assert run["p.x"][-1] == pytest.approx(-RADIUS * (run["p.angle"][-1] - 0.7), rel=1e-12)
    assert not run.events


def test_its_radius_is_a_run_time_parameter():
    start = mbd.assemble(wheel(), closed="foot", parameters={"wheel.hub.radius": 0.4})
    run = mbd.simulate(wheel(), start, mbd.HHT(), dt=1e-2, until=1.0, parameters={"wheel.hub.radius": 0.4})
    assert run["p.y"][-1] == pytest.approx(0.4)
    assert run["p.x"][-1] == pytest.approx(0.5 * 9.81 * math.sin(0.1) / (1.0 + INERTIA / 0.4**2), rel=1e-9)


def test_a_spinning_wheel_slides_and_then_rolls():
    """Friction gives it ``v = r ω₀/(1 + m r²/I)`` whatever μ is, after ``v/(μ g)``."""
    model = wheel(friction=0.3, slope=0.0)
    start = mbd.assemble(model, closed="foot", velocity={"p.x": 0.0, "p.angle": -10.0})
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=0.5)
    speed = RADIUS * 10.0 / (1.0 + RADIUS**2 / INERTIA)
    (stuck,) = run.events
    assert (stuck.kind, stuck.time) == ("stuck", pytest.approx(speed / (0.3 * 9.81), rel=1e-6))
    assert run["p.x.rate"][-1] == pytest.approx(speed, rel=1e-9)


@settings(max_examples=10)
@given(vx=st.floats(-2.0, 2.0), spin=st.floats(-5.0, 5.0))
def test_a_strike_keeps_the_moment_of_momentum_about_the_touching_point(vx, spin):
    model = wheel(slope=0.0)
    start = mbd.assemble(
        model, open="foot", position={"p.y": RADIUS + 0.01}, velocity={"p.x": vx, "p.y": -1.0, "p.angle": spin}
    )
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=0.05)
    after = run.at([run.events[0].time], side="after")
    moment = -RADIUS * vx + INERTIA * spin  # about z, of the momentum at a height r
    assert -RADIUS * after["p.x.rate"][0] + INERTIA * after["p.angle.rate"][0] == pytest.approx(moment, abs=1e-9)
    assert after["p.x.rate"][0] == pytest.approx(-RADIUS * after["p.angle.rate"][0], abs=1e-9)


@settings(max_examples=20)
@given(
    angle=st.floats(-3.1, 3.1), place=st.tuples(st.floats(-1, 1), st.floats(-1, 1)), shape=st.sampled_from([SOLE, egg])
)
def test_the_row_of_a_sole_is_the_velocity_of_its_lowest_point(angle, place, shape):
    """The gap is the height of the lowest point, and the tangent's rate is ``v_O + ω × (p_lowest − p_O)`` along x."""
    body = mbd.RigidBody("foot", 1.0, (1.0, 1.0, 1.0))
    scope, measure = FreeScope(), mbd.profile_touchdown(body.origin, shape)
    scope.move("foot", (*place, 0.0, 0.0, 0.0, angle))
    gap, (sigma,) = measure.gap(scope), measure.captured(scope)
    table = Table("sole", *measure.sole.pieces)
    depth, ahead = table.value(-angle, 1), table.value(-angle, 2)
    assert scope.value(gap)[0] == pytest.approx(place[1] - depth, abs=1e-12)
    rates = scope.matrix([scope_gradient(scope, row) for row in (gap, sigma)])
    np.testing.assert_allclose(rates, [[0.0, 1.0, ahead], [1.0, 0.0, depth]], atol=1e-9)


def scope_gradient(scope, row):
    """∂/∂(x, y, turn about z)."""
    from mbd.tape.derivatives import gradient

    q = scope.coordinates("foot")
    return gradient(scope.tape.lift(row), [q[0], q[1], q[5]])


def test_a_sole_touches_each_of_its_points():
    """The depth below the frame is that of the lowest of all points, at every tangent between heel and toe, nearly."""
    table = Table("sole", *sole_of(SOLE, "sole").pieces)
    for psi in np.linspace(-0.25, 0.38, 61):
        lowest = max(x * math.sin(psi) - y * math.cos(psi) for x, y in SOLE)
        assert -1e-6 < table.value(psi, 1) - lowest < 2.5e-3  # bulging between them
    for psi, (x, y) in (-1.0, SOLE[0]), (1.0, SOLE[-1]), (2.0, SOLE[-1]):
        assert table.value(psi, 1) == pytest.approx(x * math.sin(psi) - y * math.cos(psi), abs=1e-5)


def test_points_of_an_arc_make_the_arc():
    points = [(0.3 * math.sin(a), 0.3 - 0.3 * math.cos(a)) for a in np.linspace(-0.5, 0.5, 41)]
    table = Table("sole", *sole_of(points, "sole").pieces)
    for psi in np.linspace(-0.45, 0.45, 19):
        assert table.value(psi, 1) == pytest.approx(0.3 - 0.3 * math.cos(psi), abs=2e-6)


def test_the_circumference_is_that_of_the_hull():
    corners = [(-0.06, 0.01), (0.0, 0.0), (0.16, 0.03)]
    hull = sum(math.dist(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))
    assert sole_of(corners, "sole").circumference == pytest.approx(hull, rel=2e-2)


@pytest.mark.parametrize(
    ("sole", "told"),
    [
        ([(0, 0), (1, 0)], "a heel and toe"),
        ([(0, 0), (0, 1), (1, 0)], "must increase"), ([(0, 0), (1, 1), (2, 0)], "hollow"),
        ([(0, 0), (1, math.nan), (2, 0)], "missing"), ("arc", "points"),
        (lambda psi: 0.1 - 0.2 * mbd.cos(3 * psi), "not convex"),
        (lambda psi: 0.1 + 0.01 * psi, "a turn apart"), (0.3, "points"),
    ],
)  # fmt: skip
def test_impossible_soles_are_named(sole, told):
    with pytest.raises(ModelError, match=told):
        mbd.profile_touchdown(mbd.RigidBody("foot", 1.0, (1, 1, 1)).origin, sole)


def test_what_does_not_roll_in_the_plane_is_refused():
    body = mbd.RigidBody("foot", 1.0, (1, 1, 1))
    with pytest.raises(ModelError, match="must be positive"):
        mbd.rolling_touchdown(body.origin, 0.0)
    with pytest.raises(ModelError, match="is a mbd.Plane"):
        mbd.rolling_touchdown(body.origin, 0.1, lambda x: 0.1 * x)
    with pytest.raises(ModelError, match="x-y plane"):
        mbd.rolling_touchdown(body.origin, 0.1, mbd.Plane((0, 1, 1)))
    model = mbd.Model("tilting")
    model.connect(mbd.Revolute("hinge", model.ground.origin, body.origin, axis="x"))
    model.constrain(mbd.Unilateral("disk", mbd.rolling_touchdown(body.origin, 0.1)))
    with pytest.raises(CapabilityError, match="turn about z only"):
        mbd.assemble(model)
