"""Derivatives of friction in planes in space: sliding, coming to rest, letting go, impacts."""

from functools import cache

import numpy as np
import pytest

import mbd
from tests.comparisons import at_least, compared
from tests.helpers import one_body
from tests.sensitivity.turns import judged
from tests.simulation.test_cones import on_incline, thrown

CLOSE = {"tolerance": 1e-12}
HHT, INDEX3 = mbd.HHT(0.05, **CLOSE), mbd.HHT(0.05, formulation="index3", **CLOSE)
RUNGE_KUTTA, RADAU = mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE)


def assert_as_differences(kinds, model, start, scheme, *given, **settings):
    """To 1e-8 of the largest, or to what two quotients differ by where that is more; with these kinds of events."""
    run = {name: value for name, value in settings.items() if name in ("dt", "until")}
    assert [event.kind for event in mbd.simulate(model, start, scheme, **run).events] == kinds
    found = judged(model, start, scheme, *given, **settings)
    assert found is not None
    assert np.all(found[0] <= np.maximum(1e-8, 2.0 * found[1])), found


@pytest.mark.parametrize("scheme", [RUNGE_KUTTA, RADAU, HHT, INDEX3], ids=repr)
def test_a_block_slides_along_a_curve_and_comes_to_rest(scheme):
    model = on_incline()
    start = mbd.assemble(model, velocity={"slide.x": 1.0, "slide.z": 2.0}, closed="foot")
    settings = {"ways": 1, "parameters": ["gravity.x"], "dt": 5e-3, "until": 2.0}
    assert_as_differences(["stuck"], model, start, scheme, **settings)


@pytest.mark.parametrize("scheme", [RADAU, HHT], ids=repr)
def test_a_block_in_a_plane_holds_where_it_comes_to_rest(scheme):
    model, mass = one_body(mbd.PointMass("block", mass=2.0), mbd.Translation, "slide", gravity=(2.0, -9.81, 0.0))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin), friction=0.4))
    start = mbd.assemble(model, velocity={"slide.x": 1.0}, closed="foot")
    assert_as_differences(["stuck"], model, start, scheme, ways=1, parameters=["gravity.x"], dt=5e-3, until=0.8)


@pytest.mark.parametrize("friction", [0.1, 0.7])
def test_a_mass_that_strikes_slides_on_or_sticks(friction):
    model = thrown(friction, 0.6)
    start = mbd.assemble(model, {"slide.y": 0.01}, {"slide.x": 1.2, "slide.y": -1.0, "slide.z": 0.5})
    assert_as_differences(["closed"], model, start, RUNGE_KUTTA, ways=2, dt=5e-3, until=0.1)
    for law in ("poisson", "sequential"):
        assert_as_differences(["closed"], model, start, RUNGE_KUTTA, ways=1, dt=5e-3, until=0.1, impact=law)


@cache
def box(friction):
    """A floating box above the ground."""
    model, body = one_body(mbd.RigidBody("box", 1.0, (0.02, 0.03, 0.04)), mbd.Free, "free")
    for k, place in enumerate([(0.1, 0.1, 0.2), (-0.1, -0.1, 0.2), (0.1, -0.15, -0.2)]):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(body.point(*place)), friction=friction))
    position = {"free.y": 0.4, "free.orientation": ("xyz", (0.3, 0.2, 0.1))}
    return model, mbd.assemble(model, position, {"free.angular_velocity": (1.0, 2.0, 3.0), "free.x": 0.2})


@pytest.mark.parametrize("scheme", [RUNGE_KUTTA, RADAU, HHT, INDEX3], ids=repr)
def test_a_box_strikes_with_a_corner_and_slides_on_it(scheme):
    assert_as_differences(["closed"], *box(0.3), scheme, ways=1, parameters=["gravity.y"], dt=2.5e-3, until=0.25)


def test_a_box_strikes_with_a_corner_and_stands_on_it():
    assert_as_differences(["closed", "stuck"], *box(2.0), RADAU, ways=1, dt=2.5e-3, until=0.24)


@pytest.mark.parametrize(("scheme", "dt"), [(RADAU, 2e-3), (HHT, 4e-3)], ids=repr)
def test_springs_pull_a_block_off_a_belt(scheme, dt):
    """It sticks until the springs pull as much as friction bears, and slides the way they pull."""
    model = mbd.Model("belt", gravity=(0.0, -9.81, 0.0))
    block = mbd.PointMass("block", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, block.origin, axes="xyz"))
    belt = mbd.Plane(velocity=(0.5, 0.0, 0.2))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, belt), friction=0.4))
    model.apply(mbd.Potential("springs", lambda x, z: 30.0 * x * x + 12.5 * z * z, ("slide.x", "slide.z")))
    start = mbd.assemble(model, velocity={"slide.x": 0.5, "slide.z": 0.2}, closed="foot")
    settings = {"ways": 1, "speeds": False, "parameters": ["gravity.y"], "dt": dt, "until": 0.32}
    assert_as_differences(["slipped"], model, start, scheme, **settings)


@pytest.mark.parametrize("scheme", [RADAU, HHT], ids=repr)
def test_an_edge_whose_slip_turns_fast_shortens_steps_which_follow_the_start(scheme):
    """A disk that falls on its edge as it tumbles: steps are half as long as its slip takes to turn."""
    model = mbd.Model("disk", gravity=(0.3, -9.81, 0.1))
    disk = mbd.RigidBody("disk", 1.0, (0.004, 0.005, 0.006), center=(0.005, 0.01, 0.0))
    model.connect(mbd.Free("free", model.ground.origin, disk.origin))
    model.constrain(mbd.Unilateral("edge", mbd.disk_touchdown(disk.origin, 0.1, "z"), friction=0.2))
    position = {"free.y": 0.15, "free.orientation": ("xyz", (0.3, 0.1, 0.2))}
    start = mbd.assemble(model, position, {"free.x": 1.0, "free.angular_velocity": (1.0, 5.0, -8.0)})
    steps = np.diff(mbd.simulate(model, start, scheme, dt=2.5e-3, until=0.15).time)
    assert np.sum((steps > 0.0) & (steps < 1e-3)) > 4
    assert_as_differences(["closed"], model, start, scheme, ways=1, dt=2.5e-3, until=0.15)
    found = judged(model, start, scheme, ways=1, dt=2.5e-3, until=0.15)
    assert found[0] < 1e-8  # with steps held, 1e-6 and 1e-3


@pytest.mark.parametrize("seed", [28, 78])
@at_least(1)
def test_a_direction_that_is_held_until_rest_turns_with_what_the_run_is_differentiated_by(seed):
    """Boxes that come to rest on a corner: their derivatives were off by up to 1e-4 behind it."""
    random_box(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 80, 20))
@at_least(10)
def test_random_boxes_with_corners_that_strike_slide_and_stand(first):
    """By all schemes; where friction begins to slide, corrections of positions are in the metric of a later iterate."""
    for seed in range(first, first + 20):
        random_box(seed)


def random_box(seed):
    chance = np.random.default_rng(seed)
    model = mbd.Model("box", gravity=(chance.uniform(-2, 2), -9.81, chance.uniform(-2, 2)))
    inertia, center = 0.02 * chance.uniform(1.0, 1.9, 3), chance.uniform(-0.05, 0.05, 3)
    body = mbd.RigidBody("box", 1.0, tuple(inertia), center=tuple(center))
    model.connect(mbd.Free("free", model.ground.origin, body.origin))
    corners = [(0.1, -0.1, 0.2), (-0.1, -0.1, 0.2), (0.1, -0.1, -0.2), (-0.1, -0.1, -0.2)]
    for k, place in enumerate(corners[: chance.integers(1, 5)]):
        friction = [None, chance.uniform(0.1, 1.0), 0.0][chance.integers(0, 3)]
        foot, bounce = mbd.touchdown(body.point(*place)), chance.choice([0.0, 0.4])
        model.constrain(mbd.Unilateral(f"foot {k}", foot, restitution=bounce, friction=friction))
    q = 0.3 * chance.normal(size=4) + (1.0, 0.0, 0.0, 0.0)
    velocity = {f"free.angular_velocity.{axis}": chance.uniform(-4, 4) for axis in "xyz"}
    velocity |= {f"free.{axis}": chance.uniform(-2, 2) for axis in "xyz"}
    start = mbd.assemble(model, {"free.y": 0.35, "free.orientation": q / np.linalg.norm(q)}, velocity)
    scheme = (RUNGE_KUTTA, RADAU, HHT, INDEX3)[seed % 4]
    try:
        settings = {"parameters": ["gravity.y"], "step": 1e-5, "dt": 2.5e-3, "until": 0.4}
        found = judged(model, start, scheme, ways=1, seed=seed, **settings)
        kinds = {event.kind for event in mbd.simulate(model, start, scheme, dt=2.5e-3, until=0.4).events}
    except (mbd.SimulationError, mbd.CapabilityError):
        return
    if found is None:  # differences of these runs tell no derivative
        return
    compared()
    most = 1e-7 if "slipped" in kinds else 1e-8
    assert np.all(found[0] <= np.maximum(most, 2.0 * found[1])), (seed, found)


def test_a_foot_of_a_sled_that_turns_comes_to_rest_before_the_others():
    model = mbd.Model("sled")
    body = mbd.RigidBody("sled", 1.0, (0.02, 0.03, 0.025), center=(0.01, 0.05, -0.005))
    model.connect(mbd.Free("free", model.ground.origin, body.origin))
    for k, (x, z) in enumerate([(0.1, 0.1), (-0.1, 0.1), (0.0, -0.12)]):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(body.point(x, 0.0, z)), friction=0.3))
    velocity = {"free.x": 0.5, "free.z": 0.2, "free.angular_velocity.y": 0.9}
    start = mbd.assemble(model, {"free.y": 0.0}, velocity, closed=["foot 0", "foot 1", "foot 2"])
    assert_as_differences(["stuck"], model, start, HHT, ways=1, parameters=["gravity.y"], dt=2.5e-3, until=0.21)


@pytest.mark.parametrize("dt", [0.005, 0.008])
def test_a_ball_that_begins_to_roll_keeps_five_sevenths_of_a_change_of_its_velocity(dt):
    """v = v₀ − 2 u₀/7 with u = v − R ω × n, whatever held direction the step before it grips has taken."""
    random, radius = np.random.default_rng(29), 0.03
    model, ball = one_body(mbd.RigidBody("ball", **mbd.sphere(0.2, radius).body), mbd.Free, "roll")
    model.constrain(mbd.Unilateral("cloth", mbd.sphere_touchdown(ball.origin, radius), friction=0.25))
    for _ in range(2):
        spin = tuple(float(each) for each in random.uniform(-40.0, 40.0, 3))
        velocity = {"roll.x": float(random.uniform(1.0, 2.0)), "roll.angular_velocity": spin}
        start = mbd.assemble(model, position={"roll.y": radius}, velocity=velocity, closed="cloth")
        found = mbd.sensitivities(
            model, start, mbd.RungeKutta853(), dt, until=1.2, wrt=["roll.x.rate", "roll.angular_velocity.z"],
            of=["roll.x.rate"],
        )  # fmt: skip
        assert any(event.kind == "stuck" for event in found.run.events)
        assert abs(found["roll.x.rate", "roll.x.rate"] - 5.0 / 7.0) < 1e-6
        assert abs(found["roll.x.rate", "roll.angular_velocity.z"] + 2.0 / 7.0 * radius) < 1e-6
