"""How contacts share a load with joints hangs on the mechanism, not on which of its joints are cut."""

import random

import pytest

import mbd


def on_a_ball_joint(seed: int, cut: str) -> tuple[mbd.Model, mbd.State]:
    """A body on a ball joint and a foot that sticks: what they bear along the line through both is open."""
    draw = random.Random(seed).uniform
    model = mbd.Model("footed", gravity=(draw(-3.0, 3.0), -9.81, draw(-3.0, 3.0)), cut=cut)
    body = mbd.RigidBody("body", mass=draw(0.5, 3.0), inertia=(0.2, 0.3, 0.25), center=(0.3, 0.1, draw(-0.2, 0.2)))
    foot = body.point(draw(0.5, 0.8), 0.0, draw(-0.3, 0.3))
    height = draw(0.1, 0.5)
    model.connect(mbd.Spherical("ball", model.ground.point(0.0, height, 0.0), body.point(0.0, height, 0.0)))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(foot)))
    return model, mbd.assemble(model, closed=["foot"])


def between_hinges(seed: int, cut: str) -> tuple[mbd.Model, mbd.State]:
    """Two hinged bodies in the plane with a foot each: three points that hold share what presses them together."""
    draw = random.Random(seed).uniform
    model = mbd.Model("hinged", gravity=(draw(-3.0, 3.0), -9.81, 0.0), cut=cut)
    first, second = (mbd.RigidBody(name, draw(0.5, 3.0), draw(0.05, 0.2), center=(0.3, 0.1)) for name in ("a", "b"))
    height, reach = draw(0.1, 0.5), draw(0.5, 0.8)
    model.connect(
        mbd.Revolute("hinge", model.ground.point(0.0, height), first.point(0.0, height)),
        mbd.Revolute("knee", first.point(reach, height), second.point(0.0, height)),
    )
    model.constrain(
        mbd.Unilateral("one", mbd.touchdown(first.point(draw(0.2, 0.5), 0.0))),
        mbd.Unilateral("other", mbd.touchdown(second.point(draw(0.2, 0.5), 0.0))),
    )
    return model, mbd.assemble(model, closed=["one", "other"])


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("made", [on_a_ball_joint, between_hinges])
def test_feet_press_and_open_the_same_whichever_joints_are_cut(made, scheme):
    pressed = 0
    for seed in range(12):
        runs = []
        for cut in ("auto", "all"):
            model, start = made(seed, cut)
            runs.append(mbd.simulate(model, start, scheme, dt=1e-3, until=0.005))
        one, other = runs
        assert [event.name for event in one.events] == [event.name for event in other.events], seed
        for foot in model.contacts:
            a, b = (run[f"{foot.name}.force"][0] for run in runs)
            assert b == pytest.approx(a, rel=1e-6, abs=1e-6), seed
            pressed += int(a > 0.0)
    assert pressed > 5
