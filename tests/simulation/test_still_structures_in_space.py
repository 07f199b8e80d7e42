"""What cannot move in space, every joint cut, at rates of round-off: rows that depend on others contradict nothing."""

import math
import random

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()]
AXES = [(0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]


def braced(seed: int, cut: str) -> tuple[mbd.Model, mbd.State]:
    """Two bars in a plane of space, from the ground to a foot that sticks; their rates are round-off."""
    rng = random.Random(seed)
    axis = np.array(AXES[seed % 3])
    down = np.roll(axis, 1) * rng.choice([1.0, -1.0])  # in the plane of the bars
    along = np.cross(axis, -down)
    model = mbd.Model("braced", gravity=tuple(rng.choice([9.81, 0.0]) * down), **({"cut": cut} if cut else {}))
    lengths = rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0)
    angles = rng.choice([math.pi / 2, rng.uniform(-1.5, 1.5)]), rng.uniform(0.5, 2.5)
    bars = [
        mbd.RigidBody(
            name, rng.uniform(0.1, 5.0), (0.1, 0.2, 0.15), center=tuple(rng.uniform(0.2, 1.0) * length * down)
        )
        for name, length in zip(("first", "second"), lengths, strict=True)
    ]
    model.connect(
        mbd.Revolute("hip", model.ground.origin, bars[0].origin, axis=tuple(axis)),
        mbd.Revolute("pin", bars[0].point(*(lengths[0] * down)), bars[1].origin, axis=tuple(axis)),
    )
    place = sum(
        length * (math.cos(angle) * down + math.sin(angle) * along)
        for length, angle in zip(lengths, (angles[0], sum(angles)), strict=True)
    )
    floor = mbd.touchdown(bars[1].point(*(lengths[1] * down)), mbd.Plane(tuple(-down), offset=float(-down @ place)))
    model.constrain(mbd.Unilateral("foot", floor))
    rates = {"hip.angle": rng.uniform(-1e-13, 1e-13), "pin.angle": rng.uniform(-1e-13, 1e-13)}
    return model, mbd.assemble(model, dict(zip(rates, angles, strict=True)), rates, closed="foot")


@pytest.mark.filterwarnings("ignore::mbd.MbdWarning")  # gravity upwards
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_rates_of_round_off_are_no_contradiction(scheme):
    """It stands, and bears what it bears where the joints make the tree."""
    compared = 0
    for seed in range(12):
        cut, tree = (
            mbd.simulate(*braced(seed, cut), scheme, dt=1e-2, until=0.1, on_failure="return") for cut in ("all", "")
        )
        if tree.events:  # the foot leaves
            continue
        assert cut.success, (seed, cut.message)
        assert not cut.events, seed
        np.testing.assert_allclose(cut["foot.force"][-1], tree["foot.force"][-1], atol=1e-7)
        compared += 1
    assert compared >= 6
