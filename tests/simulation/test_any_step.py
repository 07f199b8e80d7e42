"""Whatever the step: no row leaves its constraints, no closed contact pulls, nothing passive gives energy."""

import random

import numpy as np
import pytest

import mbd
from mbd.testing.mechanisms import random_scene
from tests.mechanisms_between_rows import loop, tree
from tests.simulation.judging import complaints

SCHEMES = (
    mbd.HHT(0.05), mbd.Newmark(), mbd.GeneralizedAlpha(0.5), mbd.HHT(0.1, formulation="index3"), mbd.RadauIIA(),
    mbd.RungeKutta853(),
)  # fmt: skip
PASSIVE = ("joint loss", "damper", "friction", "penalty", "impact")


def scene(seed):
    """Bodies over the ground with feet, bumpers, stops and dry friction, thrown."""
    model = random_scene(seed, 2)
    rng = random.Random(seed)
    rates = [f"{joint.name}.{label.name}" for joint in model.joints for label in joint.labels]
    return model, mbd.assemble(model, velocity={name: rng.uniform(-3.0, 3.0) for name in rates})


def cut(made, seed):
    """The same with every joint cut: rows for each."""
    model, start = made(seed)
    values = dict(zip(start.names, start.q, strict=True)), dict(zip(start.names, start.v, strict=True))
    model.cut = "all"
    return model, mbd.assemble(model, *values, project=True)


KINDS = {"tree": tree, "loop": loop, "scene": scene, "cut loop": lambda seed: cut(loop, seed)}


def told(seed, kind):
    """What a run of a mechanism, scheme and step that belong to a seed does not keep."""
    rng = random.Random(f"{kind} {seed}")
    model, start = KINDS[kind](seed)
    scheme = rng.choice(SCHEMES)
    contact = rng.choice(["events", "nonsmooth"]) if kind == "scene" else "events"
    dt = 10.0 ** rng.uniform(-4.0, 0.0)
    steps = rng.randint(5, 60)
    run = mbd.simulate(model, start, scheme, dt=dt, until=min(steps * dt, 4.0), contact=contact, on_failure="return")
    found = complaints(run)
    for part in run.energy.parts:
        gain = float(np.max(part.energy - part.energy[0])) if not part.withheld else 0.0
        if part.kind in PASSIVE and gain > 1e-9 * (1.0 + float(np.max(run.energy.kinetic))):
            found.append(f"{part.name} gives {gain:.3g} J")
    return [f"{scheme!r} dt={dt!r} steps={steps} {contact}: {text}" for text in found]


@pytest.mark.covering
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 60))])
def test_no_step_leaves_the_laws_of_mechanics(kind, seed):
    assert told(seed, kind) == []
