"""A heavy body apart decides nothing of a light one: whether it pushes, sticks, parts or is solved for."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd

ENDS = {
    "slide": ("at.x", "at.x.rate"), "lift": ("at.y", "at.y.rate"), "bounce": ("at.x", "at.y", "at.x.rate"),
    "swing": ("pin.angle", "pin.angle.rate"), "plane": ("at.x", "at.z", "at.x.rate", "at.z.rate"),
    "table": ("at.x", "at.z", "at.x.rate", "at.z.rate"),
}  # fmt: skip
SCHEMES = [mbd.RadauIIA(), mbd.HHT(0.05), mbd.RungeKutta4()]


def light(model, kind, a):
    """A mechanism of 1 kg on the ground, or on a stop, whose contact changes; what closes and what is named of it."""
    if kind == "swing":
        rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
        pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Coulomb(0.4 * a))
        model.connect(pin)
        model.constrain(mbd.Unilateral("stop", mbd.extension(pin, -0.3), restitution=0.5))
        return [], {"pin.angle": 1.0 + 0.2 * a}, {}
    in_space = kind in ("plane", "table")
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Translation("at", model.ground.origin, body.origin, axes="xyz" if in_space else "xy"))
    friction = {"slide": 0.5, "lift": 0.5, "bounce": 0.3, "plane": 0.3, "table": 0.5}[kind]
    where = mbd.touchdown(body.origin)
    model.constrain(mbd.Unilateral("foot", where, friction=friction, restitution=0.5 if kind == "bounce" else 0.0))
    weight = 9.81
    if kind == "lift":
        model.apply(mbd.Applied("force", body.origin, force=(0.0, lambda t: weight * t / (0.4 * a))))
    if kind in ("slide", "table"):
        sideways = (lambda t: 0.3 * weight * t / a) if kind == "table" else 0.0
        pull = (lambda t: weight * t / a, 0.0, sideways)
        model.apply(mbd.Applied("force", body.origin, force=pull))
    velocity = {"at.x": 1.0} if kind in ("bounce", "plane") else {}
    if kind == "plane":
        velocity |= {"at.z": a}
    if kind == "bounce":
        return [], {"at.x": 0.0, "at.y": 0.1 * a}, velocity
    return ["foot"], {"at.x": 0.0} | ({"at.z": 0.0} if in_space else {}), velocity


def end(kind, a, scheme, contact, mass=None):
    model = mbd.Model("beside")
    closed, position, velocity = light(model, kind, a)
    if mass is not None:
        heavy = mbd.PointMass("heavy", mass=mass)
        in_space = kind in ("plane", "table")
        model.connect(mbd.Translation("there", model.ground.origin, heavy.origin, axes="xyz" if in_space else "xy"))
        model.constrain(mbd.Unilateral("sill", mbd.touchdown(heavy.origin), friction=0.9))
        closed, position = [*closed, "sill"], position | {"there.x": 0.0} | ({"there.z": 0.0} if in_space else {})
    start = mbd.assemble(model, closed=closed, position=position, velocity=velocity)
    run = mbd.simulate(model, start, scheme, dt=1e-2, until=0.8, contact=contact)
    events = [event.time for event in run.events if event.name != "sill"]
    return [float(run[name][-1]) for name in ENDS[kind]], events


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from(list(ENDS)), st.floats(0.5, 1.5), st.sampled_from(SCHEMES),
    st.sampled_from(["events", "nonsmooth"]), st.floats(4.0, 12.0),
)  # fmt: skip
def test_contacts_are_the_same_beside_a_heavy_body(kind, a, scheme, contact, size):
    alone, events = end(kind, a, scheme, contact)
    beside, told = end(kind, a, scheme, contact, 10.0**size)
    assert len(told) == len(events)
    np.testing.assert_allclose(told, events, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(beside, alone, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", list(ENDS))
def test_each_kind_is_the_same_beside_one_of_a_million_tons(kind, scheme, contact):
    alone, events = end(kind, 0.9, scheme, contact)
    beside, told = end(kind, 0.9, scheme, contact, 1e9)
    assert len(told) == len(events) or kind == "bounce"
    np.testing.assert_allclose(beside, alone, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_bodies_that_rest_apart_stop_no_impact(restitution, law, contact):
    """Impulses of what nothing strikes are round-off, and so is their work: no impact creates energy by it."""

    def fallen(count):
        model, at = mbd.Model("side by side"), range(count)
        for k in at:
            body = mbd.PointMass(f"body {k}", mass=1.0 + 0.1 * k)
            model.connect(mbd.Translation(f"at {k}", model.ground.origin, body.origin))
            model.constrain(
                mbd.Unilateral(f"foot {k}", mbd.touchdown(body.origin), friction=0.3, restitution=restitution)
            )
        position = {f"at {k}.y": 0.01 + 0.003 * (count - 1 - k) for k in at}  # the one that all have comes last
        velocity = {f"at {k}.x": 1.0 + 0.01 * (count - 1 - k) for k in at}
        start = mbd.assemble(model, position=position, velocity=velocity)
        run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.15, contact=contact, impact=law)
        return run[f"at {count - 1}.x"][-1], len(run.events)

    alone, events = fallen(1)
    beside, more = fallen(6)
    assert beside == pytest.approx(alone, rel=1e-4) and more >= 6 * min(events, 1)


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_feet_of_what_stands_apart_stay_closed_in_an_impact(restitution, contact):
    """Their impulses are round-off, the sign of which opens no foot and lets none slide."""
    draw = np.random.default_rng(0).uniform
    model = mbd.Model("tables beside a ball")
    ball = mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("at", model.ground.origin, ball.origin))
    model.constrain(mbd.Unilateral("hit", mbd.touchdown(ball.origin), friction=0.3, restitution=restitution))
    position, closed = {"at.y": 0.1}, []
    for k in range(4):
        center = draw(0.3, 0.7), draw(0.1, 0.5)
        table = mbd.RigidBody(f"table {k}", mass=draw(0.5, 5.0), inertia=draw(0.1, 1.0), center=center)
        model.connect(mbd.Planar(f"stands {k}", model.ground.origin, table.origin))
        for x in (0.0, 1.0):
            closed.append(f"foot {k} at {x:g}")
            model.constrain(mbd.Unilateral(closed[-1], mbd.touchdown(table.point(x, 0.0)), friction=draw(0.2, 0.8)))
        rod = mbd.Link(f"rod {k}", length=0.5, **mbd.rod(mass=draw(0.01, 0.05), length=0.5).link)
        model.connect(mbd.Revolute(f"hinge {k}", table.point(0.5, 0.6), rod.start))
        position |= {f"hinge {k}.angle": draw(-1.0, 1.0), f"stands {k}.x": 3.0 * k}
    start = mbd.assemble(model, closed=closed, position=position)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=5e-3, until=0.4, contact=contact)
    assert {event.name for event in run.events} == {"hit"}
