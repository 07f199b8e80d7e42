"""Friction that slides on rows that depend on each other: what is reported is what has moved the mechanism."""

from functools import cache, lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.equations.programs import balance_with
from mbd.kernel.algebra.redundancy import MIN_LIMIT_SHARE
from tests.helpers import one_body
from tests.simulation.frictions import check_friction
from tests.simulation.mechanisms import G

SCHEMES = [
    mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.Newmark(), mbd.HHT(0.05, formulation="index3"),
    mbd.GeneralizedAlpha(0.5, formulation="index3"),
]  # fmt: skip
every_scheme = pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
every_strategy = pytest.mark.parametrize("contact", ["events", "nonsmooth"])
PLACES, COEFFICIENTS = (-0.5, 0.1, 0.5), (0.1, 0.3, 0.6)
MASS, HIGH = 1.0, 0.2


@cache
def sled(order=(0, 1, 2), slope=0.0, restitution=0.0):
    """A body on three runners in a row, HIGH below its center, with different friction."""
    model = mbd.Model("sled", gravity=mbd.on_slope(slope, G))
    body = mbd.RigidBody("body", mass=MASS, inertia=0.1)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    for k in order:
        touch = mbd.touchdown(body.point(PLACES[k], -HIGH))
        model.constrain(mbd.Unilateral(f"runner {k}", touch, friction=COEFFICIENTS[k], restitution=restitution))
    return model


def start_of(model, speed):
    """The model, and its start with all runners on the ground."""
    closed = [f"runner {k}" for k in range(3)]
    return model, mbd.assemble(model, position={"place.y": HIGH}, velocity={"place.x": speed}, closed=closed)


def slide(model, scheme=SCHEMES[0], speed=3.0, **options):
    return mbd.simulate(*start_of(model, speed), scheme, **{"dt": 1e-2, "until": 0.5, **options})


def imbalance(run):
    """(R,) largest component of M v̇ + f + Bᵀλ with what is reported, friction included, over the largest force."""
    equations = run.record.equations
    nodes = balance_with(equations, range(len(equations.rows)), ())
    left = [np.broadcast_to(value, run.time.shape) for value in run.columns.evaluate(nodes, run.columns.rows)]
    return np.max(np.abs(left), axis=0) / np.maximum(1.0, np.max(np.abs(run.record.lam), axis=1, initial=0.0))


def drag_of_least_norm(sign):
    """Forces N and deceleration with ΣN = m g, Σ x N = HIGH · drag, N orthogonal to what makes no force."""
    x, mu = np.array(PLACES), np.array(COEFFICIENTS)
    idle = np.cross(np.ones(3), x)
    push = np.linalg.solve([np.ones(3), x - HIGH * sign * mu, idle], [MASS * G, 0.0, 0.0])
    return push, mu @ push / MASS


# the sled ------------------------------------------------------------------------------------------------------------
@every_scheme
@every_strategy
def test_a_sled_on_three_runners_slides_with_the_drag_that_it_reports(scheme, contact):
    run = slide(sled(), scheme, contact=contact)
    push, slowing = drag_of_least_norm(1.0)
    assert np.min(push) > 0.0
    for k in range(3):
        assert run[f"runner {k}.force"] == pytest.approx(np.full(len(run.time), push[k]), abs=1e-9)
        assert run[f"runner {k}.friction"] == pytest.approx(-COEFFICIENTS[k] * run[f"runner {k}.force"], abs=1e-12)
    drag = -sum(run[f"runner {k}.friction"] for k in range(3))
    assert drag == pytest.approx(-MASS * run["place.x.acceleration"], abs=1e-12)
    assert run["place.x"] == pytest.approx(3.0 * run.time - 0.5 * slowing * run.time**2, abs=1e-9)
    assert "nor is the drag" in run.stats["notes"][0]


@pytest.mark.parametrize("order", [(2, 0, 1), (1, 2, 0), (2, 1, 0)])
@every_strategy
def test_the_order_of_the_runners_changes_nothing(order, contact):
    runs = [slide(sled(numbers, 0.2), speed=-2.0, until=1.0, contact=contact) for numbers in ((0, 1, 2), order)]
    assert runs[0].final.q == pytest.approx(runs[1].final.q, abs=1e-12)
    for k in range(3):
        for what in "force", "friction":
            name = f"runner {k}.{what}"
            assert runs[0][name] == pytest.approx(runs[1][name], abs=1e-9)
    stops = [{(event.name, round(event.time, 9)) for event in run.events} for run in runs]
    assert stops[0] == stops[1]


@every_scheme
@every_strategy
def test_it_halts_on_a_slope_and_its_runners_then_share_by_their_limits(scheme, contact):
    run = slide(sled(slope=0.2), scheme, speed=-2.0, until=1.0, contact=contact)
    assert {event.kind for event in run.events} == {"stuck"}
    assert len({event.time for event in run.events}) == 1
    assert np.max(imbalance(run)) < 1e-12
    if contact == "events":  # a non-smooth step slides on until its end
        check_friction(sled(slope=0.2), run)
    used = [run[f"runner {k}.friction"][-1] / (COEFFICIENTS[k] * run[f"runner {k}.force"][-1]) for k in range(3)]
    assert used == pytest.approx([used[0]] * 3, abs=1e-9)
    assert MIN_LIMIT_SHARE < abs(used[0]) < 1.0


# impacts -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
@every_strategy
def test_impulses_of_redundant_runners_are_the_change_of_momentum(law, restitution, contact):
    model = sled(restitution=restitution)
    start = mbd.assemble(model, position={"place.y": 0.4}, velocity={"place.x": 2.0, "place.y": -1.0})
    run = mbd.simulate(model, start, dt=5e-3, until=0.3, impact=law, contact=contact)
    struck = [event for event in run.events if event.impulse.any()]
    after = struck[0].row
    first = [event for event in struck if event.row == after]
    assert len(first) == 3
    change = run.record.v[after] - run.record.v[after - 1]
    push = {event.name: event.impulse for event in first}
    x = np.array([PLACES[int(name[-1])] for name in push])
    along, up = np.array([impulse[1] for impulse in push.values()]), np.array([i[0] for i in push.values()])
    assert MASS * change[0] == pytest.approx(along.sum(), abs=1e-12)
    assert MASS * change[1] == pytest.approx(up.sum(), abs=1e-12)
    assert 0.1 * change[2] == pytest.approx(x @ up + HIGH * along.sum(), abs=1e-12)
    for name, (normal, tangent) in push.items():
        assert tangent == pytest.approx(-COEFFICIENTS[int(name[-1])] * normal, abs=1e-12)  # it goes on sliding
        assert normal > 0.0
    lost = run.energy.kinetic[after - 1] - run.energy.kinetic[after]
    assert sum(event.energy_loss for event in first) == pytest.approx(lost, abs=1e-12)


# any mechanism -------------------------------------------------------------------------------------------------------
@lru_cache(maxsize=8)
def laden(feet, swings):
    """A body on feet in a row, with a load that swings on it; coefficients are run-time parameters."""
    model, body = one_body(mbd.RigidBody("body", mass=2.0, inertia=0.3), mbd.Planar, "place", title="laden")
    if swings:
        load = mbd.Link("load", mass=0.7, length=0.4, center=0.3, inertia=0.01)
        model.connect(mbd.Revolute("hinge", body.origin, load.start, loss=mbd.Coulomb(0.05)))
    for k, x in enumerate(feet):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(body.point(x, -0.1)), friction=0.1))
    return model


@settings(max_examples=25)
@given(
    feet=st.sampled_from([(-0.9, 0.1, 0.8), (-0.9, -0.8, 0.3, 0.9)]), swings=st.booleans(),
    mu=st.lists(st.floats(0.02, 0.4), min_size=4, max_size=4), speed=st.floats(-2.0, 2.0),
    scheme=st.sampled_from(SCHEMES), contact=st.sampled_from(["events", "nonsmooth"]), high=st.sampled_from([0.1, 0.3]),
)  # fmt: skip
def test_reported_forces_balance_in_every_row_and_obey_coulomb(feet, swings, mu, speed, scheme, contact, high):
    model = laden(feet, swings)
    changed = {f"foot {k}.mu": mu[k] for k in range(len(feet))}
    start = mbd.assemble(
        model, position={"place.y": high} | ({"hinge.angle": 1.0} if swings else {}), velocity={"place.x": speed},
        parameters=changed, closed=[f"foot {k}" for k in range(len(feet))] if high == 0.1 else [],
    )  # fmt: skip
    run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.6, contact=contact)
    equations = run.record.equations
    assert np.max(imbalance(run)) < 1e-8
    for each in equations.contacts:
        force = run[f"{each.name}.force"]
        assert np.min(force) > -1e-9 * np.max(np.abs(run.record.lam))
        assert np.all(np.abs(run[f"{each.name}.friction"]) <= changed[f"{each.name}.mu"] * force + 1e-9 * force.max())


@pytest.mark.parametrize("scheme", [SCHEMES[0], SCHEMES[3]], ids=repr)
@pytest.mark.parametrize("loss", [None, mbd.Coulomb(0.2), mbd.PinFriction(0.2, 0.05)], ids=repr)
def test_pins_of_redundant_cranks_balance_while_their_rows_turn(scheme, loss):
    model = mbd.Model("parallel cranks")
    coupler = mbd.RigidBody("coupler", mass=2.0, inertia=0.1)
    cranks = [mbd.Link(f"crank {k}", mass=1.0, length=1.0, center=0.5, inertia=1 / 12) for k in range(3)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0), crank.start))
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"pin {k}", crank.end, coupler.point(k - 1.0, 0.0), loss=loss))
    start = mbd.assemble(model, position={"base 0.angle": 0.8, "pin 0.angle": -0.8}, velocity={"base 0.rate": 1.0})
    run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.6)
    assert np.max(imbalance(run)) < 1e-6
    if loss is not None:
        check_friction(model, run)


def test_the_linear_motion_of_a_sliding_sled_is_that_of_its_run():
    """A spring holds it on a belt that runs below: δẍ = −k/m δx, with the drag of shares that do not change."""
    model, body = one_body(mbd.RigidBody("body", mass=MASS, inertia=0.1), mbd.Planar, "place")
    belt = mbd.Plane(velocity=(1.0, 0.0))
    for k, x in enumerate(PLACES):
        model.constrain(
            mbd.Unilateral(f"runner {k}", mbd.touchdown(body.point(x, -HIGH), belt), friction=0.1 + 0.2 * k)
        )
    model.apply(mbd.Spring("spring", model.ground.point(-4.0, HIGH), body.origin, stiffness=30.0, length=4.0))
    start = mbd.assemble(model, position={"place.y": HIGH}, closed=[f"runner {k}" for k in range(3)])
    linear = mbd.linearize(model, start)
    step = 1e-4
    moved = [
        mbd.simulate(
            model,
            mbd.assemble(
                model, position={"place.x": side * step, "place.y": HIGH}, closed=[f"runner {k}" for k in range(3)]
            ),
            dt=1e-4, until=1e-4,
        )["place.x.acceleration"][0]
        for side in (-1.0, 1.0)
    ]  # fmt: skip
    assert linear.A[1, 0] == pytest.approx((moved[1] - moved[0]) / (2.0 * step), rel=1e-6)


@cache
def truss(rise):
    """A triangle of three bars so flat that its top is this angle [rad] above its chord; all its pins are dry."""
    model = mbd.Model("truss")
    chord, *bars = (mbd.RigidBody(name, mass=0.8, inertia=0.05) for name in ("chord", "left bar", "right bar"))
    model.connect(
        mbd.Revolute("pivot", model.ground.origin, chord.point(0.1, 0.05), loss=mbd.PinFriction(0.3, 0.02)),
        mbd.Revolute("left", chord.point(-0.5, 0.0), bars[0].point(-0.25, 0.0), loss=mbd.Coulomb(0.2)),
        mbd.Revolute("top", bars[0].point(0.25, 0.0), bars[1].point(-0.25, 0.0), loss=mbd.Coulomb(0.5)),
        mbd.Revolute(
            "right", chord.point(np.cos(rise) - 0.5, 0.0), bars[1].point(0.25, 0.0), loss=mbd.PinFriction(0.2, 0.02)
        ),
    )
    return model


@pytest.mark.parametrize("scheme", [*SCHEMES, mbd.RadauIIA()], ids=repr)
def test_flat_trusses_swing_with_forces_that_balance_though_their_own_pins_stick(scheme):
    """Shares follow the limits of pins, these the shares: nearly 1 of each other where bars carry by their angle."""
    for rise, tilt in ((0.015, 0.4), (0.02, -0.7), (0.03, 1.1)):
        start = mbd.assemble(truss(rise), position={"pivot.angle": tilt, "left.angle": rise, "top.angle": -2.0 * rise})
        how = {"dt": 2e-3, "until": 0.05}
        run = mbd.simulate(truss(rise), start, scheme, on_failure="return", **how)
        exact = mbd.simulate(truss(rise), start, mbd.RungeKutta853(), **how)
        ended = "stagnated" in run.message or "Newton stalled" in run.message
        assert run.success or (scheme in SCHEMES and ended)  # the Newmark family may end by name
        assert run["pivot.angle"][-1] == pytest.approx(exact.at(run.time[-1])["pivot.angle"], abs=1e-6)
        assert np.max(imbalance(run)[1:], initial=0.0) < 1e-5
