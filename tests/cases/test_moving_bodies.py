"""Feet and wheels on other bodies: carts, planks, belts, and planes in turned frames."""

import numpy as np
import pytest

import mbd


# other bodies ---------------------------------------------------------------------------------------------------------
def cart_and_rod(friction=None):
    """A cart of 3 kg that rolls freely, and a rod of 1 kg and 0.8 m that floats over it; the foot is its lower end."""
    model = mbd.Model("cart")
    cart, rod = mbd.PointMass("cart", mass=3.0), mbd.Link("rod", length=0.8, **mbd.rod(mass=1.0, length=0.8).link)
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, cart.origin), mbd.Planar("float", model.ground.origin, rod.center)
    )
    deck = mbd.Plane(offset=0.1, frame=cart.origin)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(rod.end, deck), friction=friction))
    return model


def test_a_foot_that_lands_on_a_cart_takes_it_along_and_keeps_the_momentum():
    model = cart_and_rod()
    start = mbd.assemble(
        model, position={"float.y": 0.7, "float.angle": 0.4}, velocity={"float.x": 1.5, "rail.displacement": -0.2}
    )
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.35)
    (landed,) = run.events
    momentum = 3.0 * run["rail.rate"] + 1.0 * run["float.x.rate"]
    np.testing.assert_allclose(momentum, 1.5 - 0.6, rtol=0, atol=1e-9)
    after = slice(landed.row, None)
    standing = run["rod.end.x"] - run["rail.displacement"]
    np.testing.assert_allclose(standing[after], standing[landed.row], rtol=0, atol=1e-10)
    np.testing.assert_allclose(run["rod.end.y"][after], 0.1, rtol=0, atol=1e-10)
    assert run["rail.rate"][landed.row] - run["rail.rate"][landed.row - 1] == pytest.approx(-landed.impulse[1] / 3.0)
    before, later = (run.energy.total[row] for row in (landed.row - 1, landed.row))
    assert landed.energy_loss == pytest.approx(before - later, abs=1e-9)
    assert abs(run.energy.sums["numerical"]) < 1e-5


def test_a_frictionless_deck_leaves_the_cart_alone():
    model = cart_and_rod(friction=0.0)
    start = mbd.assemble(model, position={"float.y": 0.7, "float.angle": 0.4}, velocity={"rail.displacement": -0.2})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.35)
    assert run.events
    np.testing.assert_allclose(run["rail.rate"], -0.2, rtol=0, atol=1e-12)


def seesaw(welded=False):
    """A plank of 4 kg on a pivot; a point of 1 kg lands on it 0.6 m from the pivot, or is part of it."""
    model = mbd.Model("seesaw")
    plank, point = mbd.RigidBody("plank", mass=4.0, inertia=0.8), mbd.PointMass("point", mass=1.0)
    model.connect(mbd.Revolute("pivot", model.ground.point(0.0, 1.0), plank.origin, stiffness=90.0))
    if welded:
        model.connect(mbd.Weld("glue", plank.point(0.6, 0.05), point.origin))
    else:
        model.connect(mbd.Translation("flight", model.ground.origin, point.origin))
        top = mbd.Plane((0.0, 1.0), 0.05, frame=plank.origin)
        model.constrain(mbd.Unilateral("landing", mbd.touchdown(point.origin, top)))
    return model


def test_a_point_that_lands_on_a_plank_moves_on_as_if_it_were_part_of_it():
    model = seesaw()
    start = mbd.assemble(model, position={"flight.x": 0.6, "flight.y": 1.06}, velocity={"flight.y": -2.0})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-4, until=0.2)
    (landed,) = run.events
    speed = np.hypot(2.0, np.sqrt(2 * 9.81 * 0.01))
    inertia = 0.8 + 0.6**2 + 0.05**2
    assert run["pivot.rate"][landed.row] == pytest.approx(-0.6 * speed / inertia, rel=1e-6)
    one = seesaw(welded=True)
    glued = mbd.assemble(one, velocity={"pivot.angle": run["pivot.rate"][landed.row]})
    other = mbd.simulate(one, glued, mbd.HHT(0.05), dt=2e-4, until=0.2 - landed.time)
    assert run["pivot.angle"][-1] == pytest.approx(other["pivot.angle"][-1], abs=1e-7)
    assert run["flight.x"][-1] == pytest.approx(other["point.origin.x"][-1], abs=1e-7)
    assert run["pivot.angle"][-1] < -0.1


def test_a_wheel_that_rolls_on_a_cart_pulls_it_back():
    """A disk on a cart that is pulled with F: a = F/(M + m/3)."""
    model = mbd.Model("wheel on a cart")
    cart, wheel = mbd.PointMass("cart", mass=3.0), mbd.RigidBody("wheel", mass=1.2, inertia=0.5 * 1.2 * 0.2**2)
    rail = mbd.Prismatic("rail", model.ground.origin, cart.origin)
    model.connect(rail, mbd.Planar("float", model.ground.origin, wheel.origin))
    deck, axle = mbd.Plane(frame=cart.origin), mbd.Plane(offset=0.2, frame=cart.origin)
    model.constrain(
        mbd.Bilateral("on deck", mbd.touchdown(wheel.origin, axle)), mbd.Rolling("tyre", wheel.origin, 0.2, deck)
    )
    model.apply(mbd.Applied("pull", cart.origin, force=(7.0, 0.0)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.HHT(0.05), dt=1e-2, until=1.0)
    a = 7.0 / (3.0 + 1.2 / 3.0)
    np.testing.assert_allclose(run["rail.acceleration"], a, rtol=1e-10)
    np.testing.assert_allclose(run["tyre.force"], 1.2 * a / 3.0, rtol=1e-10)
    np.testing.assert_allclose(run["float.angle.acceleration"] * 0.2, 2.0 / 3.0 * a, rtol=1e-10)


# belts and frames -----------------------------------------------------------------------------------------------------
def hopper(ground, driven=None):
    """A leg of two links with a spring in its knee, that lands on a ground, or on a belt that is driven as a body."""
    model = mbd.Model("hopper")
    belt = mbd.PointMass("belt", mass=1.0)
    if driven is not None:
        rail = mbd.Prismatic("rail", model.ground.origin, belt.origin)
        model.connect(rail)
        model.constrain(mbd.Bilateral("drive", rail, value=lambda t: driven * t))
        ground = mbd.Plane(frame=belt.origin)
    thigh, shank = (mbd.Link(name, length=0.4, **mbd.rod(mass=1.0, length=0.4).link) for name in ("thigh", "shank"))
    model.connect(
        mbd.Planar("float", model.ground.origin, thigh.start),
        mbd.Revolute("knee", thigh.end, shank.start, stiffness=60.0, loss=mbd.Viscous(0.4)),
    )
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(shank.end, ground)))
    return model


def landing(model, forward, **more):
    start = mbd.assemble(
        model, position={"float.y": 0.85, "float.angle": 0.2, "knee.angle": -0.3}, velocity={"float.x": forward} | more
    )
    return mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.4)


def test_on_a_belt_everything_happens_as_on_the_ground_seen_from_it():
    ground, belt = landing(hopper(None), 1.0), landing(hopper(mbd.Plane(velocity=(-0.7, 0.0))), 0.3)
    body = landing(hopper(None, driven=-0.7), 0.3)
    assert ground.events and all(run.events[0].name == "foot" for run in (ground, belt, body))
    for run in (belt, body):
        assert [event.kind for event in run.events] == [event.kind for event in ground.events]
        assert [e.time for e in run.events] == pytest.approx([e.time for e in ground.events], abs=1e-9)
        for name in ("float.y", "float.angle", "knee.angle", "foot.force"):
            np.testing.assert_allclose(run.at(0.39)[name], ground.at(0.39)[name], rtol=0, atol=1e-6)
        assert run["float.x"][-1] + 0.7 * 0.4 == pytest.approx(ground["float.x"][-1], abs=1e-7)
        assert run.energy.sums["numerical"] == pytest.approx(ground.energy.sums["numerical"], abs=1e-4)
        assert run.energy["impact"][-1] == pytest.approx(ground.energy["impact"][-1], abs=1e-6)
    assert belt.energy.sums["foot"] == pytest.approx(body.energy.sums["drive"], abs=1e-6)
    assert belt.energy.sums["drives at impacts"] == pytest.approx(body.energy.sums["drives at impacts"], abs=1e-6)
    assert belt.energy.sums["drives at impacts"] == pytest.approx(-0.7 * belt.events[0].impulse[1], abs=1e-6)


def test_a_plane_in_a_turned_frame_of_the_ground_is_the_same_plane():
    angle = 0.15
    normal = (-np.sin(angle), np.cos(angle), 0.0)
    place = mbd.Model("any").ground.point(0.2, 0.05)
    runs = [
        landing(hopper(ground), 1.0)
        for ground in (
            mbd.Plane(normal, np.dot(normal, (0.2, 0.05, 0.0))),
            mbd.Plane(frame=place.turned(angle)),
            lambda x: 0.05 + (x - 0.2) * np.tan(angle),
        )
    ]
    for run in runs[1:]:
        assert [event.time for event in run.events] == pytest.approx([event.time for event in runs[0].events], abs=1e-9)
        np.testing.assert_allclose(run.final.q, runs[0].final.q, rtol=0, atol=1e-8)
        np.testing.assert_allclose(run.final.v, runs[0].final.v, rtol=0, atol=1e-7)
