"""Bodies that fall on legs with dry joints, stops and feet: no force that passes zero decides by its round-off.

In scene 40 a foot leaves as its force passes zero; its gap rises by less than a step of order 2 errs by. In scene 47
the friction of a joint of 0.2 N m is known no better than the round-off of 70 N at the foot.
"""

import numpy as np
import pytest

import mbd

LOSSES = (
    lambda size: None,
    mbd.Coulomb,
    lambda size: mbd.Viscous(0.3 * size) + mbd.Coulomb(size),
    mbd.Viscous,
)


def falling_walker(seed):
    """A trunk with one or two legs of two links each, above the ground; its model and a start."""
    rng = np.random.default_rng(10_000 + seed)
    model = mbd.Model("walker", gravity=(0.0, -9.81, 0.0))
    trunk = mbd.RigidBody("trunk", mass=rng.uniform(2.0, 10.0), inertia=rng.uniform(0.05, 0.5))
    model.connect(mbd.Planar("place", model.ground.origin, trunk.origin))
    position = {"place.x": 0.0, "place.y": rng.uniform(0.75, 1.0), "place.angle": rng.uniform(-0.3, 0.3)}
    velocity = {"place.x.rate": rng.uniform(-1.0, 1.0), "place.y.rate": 0.0, "place.angle.rate": rng.uniform(-1.0, 1.0)}
    for i in range(rng.integers(1, 3)):
        frame = trunk.origin
        for s in range(2):
            link = mbd.Link(
                f"b{i}{s}", mass=rng.uniform(0.5, 3.0), length=0.4, center=0.4 * rng.uniform(0.3, 0.7),
                inertia=rng.uniform(0.01, 0.1),
            )  # fmt: skip
            kind, size = rng.integers(0, 4), rng.uniform(0.05, 1.0)
            spring = {}
            if rng.random() < 0.6:
                spring = {"stiffness": rng.uniform(5.0, 60.0), "rest": rng.uniform(-0.5, 0.5)}
            loss = LOSSES[kind](size)
            joint = mbd.Revolute(f"j{i}{s}", frame, link.start, **({} if loss is None else {"loss": loss}), **spring)
            model.connect(joint)
            frame = link.end
            position[f"j{i}{s}.angle"] = rng.uniform(-0.8, 0.8) - (1.57 if s == 0 else 0.0)
            velocity[f"j{i}{s}.angle.rate"] = rng.uniform(-2.0, 2.0)
            if s == 1:
                position[f"j{i}{s}.angle"] = -abs(rng.uniform(0.0, 0.8))
                if rng.random() < 0.8:
                    bounce = float(rng.choice([0.0, 0.0, 0.4]))
                    model.constrain(mbd.Unilateral(f"stop{i}", mbd.flexion(joint), restitution=bounce))
        friction = [float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.1, 1.2)), 0.0][rng.integers(0, 3)]
        if rng.random() < 0.7:
            bounce = float(rng.choice([0.0, 0.0, 0.4]))
            model.constrain(mbd.Unilateral(f"foot{i}", mbd.touchdown(frame), friction=friction, restitution=bounce))
        else:
            model.constrain(mbd.Penalty(f"foot{i}", mbd.height(frame), stiffness=rng.uniform(5e3, 5e4), damping=50.0))
    return model, mbd.assemble(model, position=position, velocity=velocity)


@pytest.mark.parametrize("seed", [24, 40, 47])
def test_all_schemes_see_the_same_events(seed):
    model, start = falling_walker(seed)
    ways = (
        (mbd.RungeKutta853(), {"tol": 1e-8}), (mbd.HHT(), {"dt": 1e-3}), (mbd.RadauIIA(), {"tol": 1e-7}),
        (mbd.GeneralizedAlpha(0.8), {"tol": 1e-5}),
    )  # fmt: skip
    runs = [mbd.simulate(model, start, scheme, until=0.8, **steps) for scheme, steps in ways]
    first = [(event.name, event.kind) for event in runs[0].events]
    assert len(first) > 3
    for run in runs[1:]:
        assert [(event.name, event.kind) for event in run.events] == first
        assert [event.time for event in run.events] == pytest.approx([event.time for event in runs[0].events], abs=2e-3)
        for name in start.names:
            assert run[name][-1] == pytest.approx(runs[0][name][-1], abs=2e-2)
