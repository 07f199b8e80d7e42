"""What contacts cost that are only watched: a double pendulum beside a stop and a floor that it never reaches."""

from __future__ import annotations

from functools import partial

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import kernel_watched

STEPS = 50_000


def double_pendulum(contacts: int) -> tuple[mbd.Model, mbd.State]:
    """Two point masses on rods of 1 m, and the first so many of a stop and a floor."""
    model = mbd.Model("double pendulum")
    upper, lower = (mbd.Link(name, mass=1.0, length=1.0, center=1.0) for name in ("upper", "lower"))
    elbow = mbd.Revolute("elbow", upper.end, lower.start)
    model.connect(mbd.Revolute("shoulder", model.ground.origin, upper.start), elbow)
    stop = mbd.Unilateral("stop", mbd.extension(elbow, offset=-50.0))
    floor = mbd.Unilateral("floor", mbd.touchdown(lower.end, mbd.Plane(offset=-5.0)), friction=0.0)
    model.constrain(*(stop, floor)[:contacts])
    return model, mbd.assemble(model, position={"shoulder.angle": 2.0, "elbow.angle": -0.5})


def measure(repeats: int) -> list[Figure]:
    """Time of 50 000 steps with no, one and two watched contacts, beside none (case j17 asks for at most 1.2)."""
    arms = [double_pendulum(contacts) for contacts in range(3)]

    def swing(contacts: int) -> float:
        model, start = arms[contacts]
        with kernel_watched() as watch:
            mbd.simulate(model, start, mbd.HHT(), dt=1e-4, until=1e-4 * STEPS, store=STEPS)
        return watch.seconds / STEPS * 1e9

    names = ("none", "a stop", "a stop and a floor")
    samples = interleaved({name: partial(swing, k) for k, name in enumerate(names)}, 5 * repeats)
    bare = samples["none"].least
    return [
        Figure(f"double pendulum, step beside {name}", samples[name].least, "ns", None, "step beside none", bare,
               1.2 if name != "none" else None, samples[name].spread)
        for name in names
    ]  # fmt: skip
