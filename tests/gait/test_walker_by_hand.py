"""Limit cycles in space against a walker with disk feet that was derived and stepped without the library."""

import numpy as np
import pytest

import mbd
from tests.gait.walker_by_hand import AHEAD, Walker, mirrored

NAMES = ["place.x", "place.y", "place.z", "roll.angle", "left hip.angle", "right hip.angle"]
FREE = [3, 4, 9, 10, 11]
"""What can be chosen with both feet on the slope."""


def numbers(seed):
    near = [1.0 + 0.12 * float(x) for x in np.random.default_rng(seed).uniform(-1.0, 1.0, 9)]
    return {
        "g": 9.81, "slope": 0.033 * near[0], "radius": 0.28 * near[1], "width": 0.18 * near[2],
        "trunk_mass": 42.0 * near[3], "pelvis_mass": 0.3, "pelvis_inertia": 0.12 * near[4], "leg_mass": 11.5 * near[5],
        "leg_inertia": (0.47 * near[6], 0.05, 0.48 * near[7]), "center": 0.345 * near[8],
    }  # fmt: skip


def model_of(values):
    model = mbd.Model("walker", gravity=mbd.on_slope(values["slope"], values["g"]))
    trunk = mbd.PointMass("trunk", values["trunk_mass"])
    pelvis = mbd.RigidBody("pelvis", values["pelvis_mass"], (values["pelvis_inertia"],) * 3)
    model.connect(mbd.Translation("place", model.ground.origin, trunk.origin, axes="xyz"))
    model.connect(mbd.Revolute("roll", trunk.origin, pelvis.origin, axis=(1, 0, 0)))
    made = (values["leg_mass"], values["leg_inertia"], (0.0, -values["center"], 0.0))
    legs = {side: mbd.RigidBody(f"{side} leg", *made) for side in ("left", "right")}
    feet = {side: leg.point(0.0, values["radius"] - 1.0, 0.0, name="arch") for side, leg in legs.items()}
    for side, other, outward in ("left", "right", -0.5), ("right", "left", 0.5):
        socket = pelvis.point(0.0, 0.0, outward * values["width"], name=f"{side} socket")
        model.connect(mbd.Revolute(f"{side} hip", socket, legs[side].origin))
        ahead = mbd.measure(lambda this, that: this[0] - that[0] - AHEAD, feet[side], feet[other])
        edge, release = mbd.disk_touchdown(feet[side], values["radius"], axis="z"), mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{side} foot", edge, friction=0, release=release, only_while=ahead))
        grip = {"only_while": f"{side} foot", "axis": (0, 0, 1)}
        model.constrain(mbd.Rolling(f"{side} grip", feet[side], values["radius"], **grip))
    return model


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_limit_cycle_in_space_is_that_of_the_walker_derived_by_hand(seed):
    values = numbers(seed)
    model, walker = model_of(values), Walker(values)
    guess = mbd.assemble(
        model,
        closed="left foot",
        position={"left hip.angle": 0.326, "right hip.angle": -0.317, "roll.angle": -0.0099},
        velocity={"left hip.angle": -1.127, "right hip.angle": -0.560, "roll.angle": -0.2544},
    )
    gait = mbd.limit_cycle(model, guess, section="right foot", mirror=("left", "right"))
    begin = np.array([gait.state[name] for name in NAMES] + [gait.state[f"{name}.rate"] for name in NAMES])
    foot = 0 if "left foot" in gait.state.mode.closed else 1
    period, end = walker.step(begin, foot)
    assert period == pytest.approx(gait.period, abs=1e-10)
    np.testing.assert_allclose(mirrored(end)[FREE], begin[FREE], atol=1e-9)

    def returned(change):
        moved = begin.copy()
        moved[FREE] += change
        return mirrored(walker.step(walker.standing(moved, foot), foot)[1])[FREE]

    changes = 2e-5 * np.eye(len(FREE))
    own = np.linalg.eigvals(np.column_stack([(returned(d) - returned(-d)) / 4e-5 for d in changes]))
    for multiplier in gait.multipliers:
        assert np.min(np.abs(own - multiplier)) < 1e-6 * max(1.0, abs(multiplier))
