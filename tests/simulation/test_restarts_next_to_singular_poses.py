"""Redundant rows next to a singular configuration: what errors of positions leave of them contradicts nothing."""

import numpy as np
import pytest

import mbd
from tests.simulation.singular_linkages import platform

SCHEMES = {
    "HHT, index 3": mbd.HHT(0.05, formulation="index3"),
    "generalized alpha, index 3": mbd.GeneralizedAlpha(0.5, formulation="index3"),
    "HHT": mbd.HHT(0.05),
    "RadauIIA": mbd.RadauIIA(),
}
UNTIL = 0.45


def scene(rng):
    """Parallel cranks under a platform, with an event at a random distance of 3e-4 to 1e-2 rad from the flat pose."""
    legs = (0.0, *sorted(rng.uniform(0.3, 2.0, int(rng.integers(2, 4))).tolist()))
    found = platform(legs, length=float(rng.uniform(0.4, 1.7)), turn=float(rng.uniform(6.0, 9.0)))
    model, start = found.start
    away = float(10.0 ** rng.uniform(-3.5, -2.0) * rng.choice([-1.0, 1.0]))
    model.constrain(mbd.Event("close", mbd.measure(lambda q: q - 0.5 * np.pi - away, "base 0.angle")))
    place = {name: float(start.q[k]) for k, name in enumerate(start.names)}
    speed = {"base 0.angle": float(start.v[list(start.names).index("base 0.angle")])}
    return found, model, mbd.assemble(model, position=place, velocity=speed)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_restart_next_to_the_flat_pose_of_redundant_cranks_goes_on_along_its_branch(scheme):
    rng = np.random.default_rng(3)
    gone = 0
    for _ in range(5):
        found, model, start = scene(rng)
        dt = float(10.0 ** rng.uniform(-3.0, -2.3))
        whole = mbd.simulate(model, start, SCHEMES[scheme], dt=dt, until=UNTIL)
        at = whole.events[0].time
        first = mbd.simulate(model, start, SCHEMES[scheme], dt=dt, until=at, on_failure="return")
        if not first.success:
            assert "singular configuration" in first.message
            continue
        second = mbd.simulate(model, first.final, SCHEMES[scheme], dt=0.9 * dt, until=UNTIL)
        gone += 1
        assert found.off(second) < 1e-6
        way = abs(whole["base 0.angle"][-1] - whole["base 0.angle"][0])
        assert abs(second["base 0.angle"][-1] - whole["base 0.angle"][-1]) < 1e-3 * way
    assert gone >= 2


def test_drives_that_contradict_each_other_there_are_a_conflict_all_the_same():
    found = platform((0.0, 1.3, 0.6), turn=6.0)
    model, start = found.start
    place = {name: float(start.q[k]) for k, name in enumerate(start.names)}
    joints = {joint.name: joint for joint in model.joints}
    model.constrain(
        mbd.Bilateral("drive", joints["base 0"], value=lambda t: 0.3 + 6.0 * t + 3.0 * t * t),
        mbd.Bilateral("other drive", joints["base 1"], value=lambda t: 0.3 + 6.0 * t + 3.1 * t * t),
    )
    with pytest.raises(mbd.MbdError, match="drive"):
        mbd.simulate(model, mbd.assemble(model, position=place), mbd.HHT(), dt=1e-3, until=0.3)
