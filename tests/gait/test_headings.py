"""Gaits on level ground in space: no heading is another one, and a gait may turn a little with each stride."""

import math
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.gait.heading import Heading, heading_of
from mbd.gait.unmoved import reset_names

g = 9.81
SPOKES, HALF = 8, math.pi / 8


@cache
def driven_wheel(chain: str = "", keel: float = 0.0) -> mbd.Model:
    """A rimless wheel with a moment about its axle, and one about the vertical: by a floating body, by three hinges, or
    by three sliders, of which one is askew, and a ball joint.

    What rights it has the energy `keel` sin² of its lean [J].
    """
    model = mbd.Model("driven wheel", gravity=(0.0, -g, 0.0), tunable=["steer.torque.y"])
    wheel = mbd.RigidBody("wheel", 1.0, (0.25, 0.25, 0.35))
    carrier, fork, axle = (mbd.RigidBody(name, 0.0, (0.0, 0.0, 0.0)) for name in ("carrier", "fork", "axle"))
    if chain == "hinges":
        model.connect(mbd.Translation("hub", model.ground.origin, carrier.origin, axes="xyz"))
        model.connect(mbd.Revolute("yaw", carrier.origin, fork.origin, axis=(0, 1, 0)))
        model.connect(mbd.Revolute("lean", fork.origin, axle.origin, axis=(1, 0, 0)))
        model.connect(mbd.Revolute("roll", axle.origin, wheel.origin))
    elif chain == "sliders":
        model.connect(mbd.Prismatic("along", model.ground.origin, carrier.origin))
        model.connect(mbd.Prismatic("up", carrier.point(0.3, 0.2, 0.1), fork.origin, axis=(0, 1, 0)))
        model.connect(mbd.Prismatic("aside", fork.origin, axle.origin, axis=(0.3, 0, 1)))
        model.connect(mbd.Spherical("ball", axle.point(0.1, 0.0, 0.2), wheel.origin))
    else:
        model.connect(mbd.Free("hub", model.ground.origin, wheel.origin))
    for k in range(SPOKES):
        tip = wheel.point(math.sin(2 * k * HALF), -math.cos(2 * k * HALF), 0.0, name=f"tip {k}")
        release = mbd.When(f"spoke {(k + 1) % SPOKES}")
        model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(tip), release=release))
    model.apply(mbd.Applied("drive", wheel.origin, torque=(0.0, 0.0, -2.5), axes=wheel.origin))
    if keel:
        wheel.point(0.0, 0.0, 1.0, name="side")
        lean = ("wheel.side.y", "hub.y")
        model.apply(mbd.Potential("keel", lambda side, hub: keel * (side - hub) ** 2, lean))
    model.apply(mbd.Applied("steer", wheel.origin, torque=(0.0, 0.0, 0.0)))
    return model


@cache
def rolling(heading: float = 0.0, **options: object) -> mbd.LimitCycle:
    """The wheel's roll along a heading [rad]."""
    turned = Rotation.from_rotvec([0.0, heading, 0.0]) * Rotation.from_rotvec([0.0, 0.0, HALF])
    start = mbd.assemble(
        driven_wheel(), closed="spoke 0", position={"hub.y": math.cos(HALF), "hub.orientation": turned},
        velocity={"hub.angular_velocity.z": -2.4},
    )  # fmt: skip
    return mbd.limit_cycle(driven_wheel(), start, section="spoke 0", **options)


def test_no_heading_is_another_one() -> None:
    ahead, aside = rolling(), rolling(0.8)
    assert aside.period == pytest.approx(ahead.period, rel=1e-9)
    assert aside.distance == pytest.approx(ahead.distance, rel=1e-9)
    assert np.abs(aside.multipliers) == pytest.approx(np.abs(ahead.multipliers), rel=1e-6)
    assert ahead.trivial["heading"] == 1.0 and len(ahead.multipliers) == 4
    assert ahead.turn == pytest.approx(0.0, abs=1e-9)
    along = math.atan2(-aside.way[1], aside.way[0])
    assert along == pytest.approx(0.8, abs=1e-9)


def test_a_heading_that_counts_is_a_multiplier_of_one() -> None:
    free, held = rolling(), rolling(modulo=("hub.x", "hub.z"))
    assert "heading" not in held.trivial
    assert np.min(np.abs(held.multipliers - 1.0)) < 1e-6
    for value in free.multipliers:
        assert np.min(np.abs(held.multipliers - value)) < 2e-6 * max(1.0, abs(value))


def test_a_turning_gait_repeats_itself_but_for_its_heading() -> None:
    gait = rolling().at({"steer.torque.y": 0.01})
    other = rolling().at({"steer.torque.y": -0.01})
    assert gait.turn == pytest.approx(0.12318511, rel=1e-5) and other.turn == pytest.approx(-gait.turn, rel=1e-8)
    assert other.distance == pytest.approx(gait.distance, rel=1e-9)
    final = gait.walk(1).final
    assert np.max(np.abs(gait.chart.of(final))) < 1e-10
    turned = Rotation.from_quat(final["hub.orientation"], scalar_first=True)
    before = Rotation.from_quat(gait.state["hub.orientation"], scalar_first=True)
    assert (turned * before.inv()).as_rotvec() == pytest.approx([0.0, gait.turn, 0.0], abs=1e-9)
    assert np.abs(gait.multipliers) == pytest.approx(np.abs(other.multipliers), rel=1e-6)


@pytest.mark.parametrize("chain", ["hinges", pytest.param("sliders", marks=pytest.mark.slow)])
def test_chains_of_joints_and_a_quaternion_head_alike(chain: str) -> None:
    model, known = driven_wheel(chain), rolling()
    assert known.map.heading is not None
    position = {"hub.y": math.cos(HALF), "yaw.angle": 0.4, "roll.angle": HALF}
    velocity = {"roll.angle": -2.4}
    if chain == "sliders":
        position = {
            "up.displacement": math.cos(HALF) - 0.2,
            "along.displacement": 0.7,
            "ball.orientation": ((0, 0, 1), HALF),
        }
        velocity = {"ball.angular_velocity.z": -2.4}
    start = mbd.assemble(model, position, velocity, closed="spoke 0")
    found = mbd.limit_cycle(model, start, section="spoke 0")  # a roll that counts its turns stands as it did
    assert found.period == pytest.approx(known.period, rel=1e-9)
    assert found.trivial["heading"] == 1.0
    key = lambda value: (-abs(value), value.imag)  # noqa: E731
    its, mine = (np.array(sorted(gait.multipliers, key=key)) for gait in (found, known))
    assert its == pytest.approx(mine, rel=1e-8, abs=1e-9)
    if chain == "hinges":
        assert found.map.fixed == (0, 2)
        assert abs(found.walk(1).final["roll.angle"] - found.state["roll.angle"]) > 6.0


def heading_of_model(model: mbd.Model) -> Heading | None:
    mechanism, values = mechanism_of(model, "auto", {}), dict(model.parameters)
    return heading_of(model, mechanism, mechanism.parameters({}, values), values, reset_names(mechanism.equations))


def two_bodies(post: float | None) -> mbd.Model:
    """Two bodies on a spring; one floats, the other does so or turns about a post."""
    model = mbd.Model("two bodies", gravity=(0.0, -g, 0.0))
    one, other = (
        mbd.RigidBody("one", 1.0, (0.1, 0.2, 0.25)),
        mbd.RigidBody("other", 2.0, (0.1, 0.2, 0.25), (0.1, 0.2, 0.3)),
    )
    if post is None:
        model.connect(mbd.Free("float", model.ground.point(0.1, 0.2, 0.5), one.origin))
    else:
        model.connect(mbd.Spherical("float", model.ground.point(0.4 + post, 2.0, 0.1), one.origin))
    model.connect(mbd.Revolute("post", model.ground.point(0.4, 0.0, 0.1), other.origin, axis=(0, 1, 0)))
    model.apply(mbd.Spring("spring", one.origin, other.point(0.3, 0.1, 0.0), 10.0, 0.5))
    return model


def test_all_that_stands_on_the_ground_turns_about_one_axis() -> None:
    heading = heading_of_model(two_bodies(None))
    assert heading is not None
    q, v = np.array([0.3, 0.1, -0.2, 1.0, 0.0, 0.0, 0.0, 0.5]), np.arange(1.0, 8.0)
    turned, rates = heading.turned(q, v, 0.5 * math.pi)  # about the post, at (0.4, 0.1)
    assert turned[[0, 2]] + [0.1, 0.5] == pytest.approx([0.4 + (0.3 - 0.1), 0.1 - (0.4 - 0.4)])
    assert turned[7] == pytest.approx(0.5 + 0.5 * math.pi)
    assert rates == pytest.approx([3.0, 2.0, -1.0, *v[3:]])
    assert heading_of_model(two_bodies(0.0)) is not None
    assert heading_of_model(two_bodies(0.1)) is None  # no vertical goes through both


def test_a_slope_or_a_wind_makes_headings_differ() -> None:
    tilted = {"gravity.x": 0.5}
    start = mbd.assemble(driven_wheel(), closed="spoke 0", position={"hub.y": 1.0}, parameters=tilted)
    found = mbd.limit_cycle(
        driven_wheel(), start, section="spoke 1", parameters=tilted, longest=0.1, on_failure="return"
    )
    assert found.map.heading is None


@pytest.mark.slow
def test_starts_of_quaternions_come_to_the_gait_along_any_heading() -> None:
    model = driven_wheel(keel=10.0)
    start = mbd.assemble(
        model, closed="spoke 0", position={"hub.y": math.cos(HALF), "hub.orientation": ((0, 0, 1), HALF)},
        velocity={"hub.angular_velocity.z": -2.15},
    )  # fmt: skip
    gait = mbd.limit_cycle(model, start, section="spoke 0")
    assert gait.stability == "stable" and gait.largest_multiplier == pytest.approx(0.917358, abs=1e-5)
    axes = {"hub.angular_velocity.x": [-0.1, 0.0, 0.1], "hub.angular_velocity.z": [-2.15, -1.93, -0.1]}
    found = mbd.basin(model, gait, axes)
    assert found.outcome[:, :2].tolist() == [["walks", "walks"]] * 3
    assert "walks" not in found.outcome[:, 2]
    with pytest.raises(mbd.ModelError, match=r"'hub.orientation.x' is a part of a quaternion"):
        mbd.basin(model, gait, {"hub.orientation.x": [0.0, 0.1]})
