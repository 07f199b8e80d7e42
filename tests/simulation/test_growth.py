"""What a run ends with changes by no more than the motion itself magnifies a change of its start."""

import numpy as np
import pytest

import mbd
from mbd.testing import random_loop, random_scene, random_tree
from tests.kernel.test_decisions import last_bits

EPS = float(np.finfo(float).eps)
SCHEMES = (mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05, formulation="index3"), mbd.RadauIIA(), mbd.RungeKutta853())
PUSH = 1e-7
"""Change of one number of the start by which the growth of changes is measured [-]."""
UNITS = 4.0
"""Round-off of a step, of all numbers, in units of the last place [-]."""
UNHELD = 64.0
"""The same of positions in index 3; over dt they are velocities, which no row holds [-]."""


def drawn(seed):
    """A model, positions and velocities by name, and the contacts that start open."""
    rng = np.random.default_rng(seed)
    if seed % 3 == 0:
        model, place, opened = random_tree(seed, int(rng.integers(1, 4)), bool(rng.integers(2)), most=5), {}, []
    elif seed % 3 == 1:
        (model, place), opened = random_loop(seed, int(rng.integers(3, 5))), []
    else:
        model, place = random_scene(seed, 2), {}
        opened = [contact.name for contact in model.contacts]
    names = mbd.assemble(model, place, open=opened).names
    if seed % 3 != 1:
        place = {name: float(rng.uniform(-0.5, 0.5)) for name in names}
    speed = {name: float(rng.normal()) for name in (names if seed % 3 != 1 else names[:1])}
    return model, place, speed, opened


def ends(model, start, scheme, dt, until):
    """Positions and velocities at the end, and the names of events."""
    run = mbd.simulate(model, start, scheme, dt=dt, until=until)
    return np.concatenate([run.final.q, run.final.v]), [(event.kind, event.name) for event in run.events]


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", range(36))
def test_the_last_bits_of_a_start_change_a_run_by_no_more_than_the_motion_magnifies_them(seed):
    model, place, speed, opened = drawn(seed)
    scheme = SCHEMES[seed // 3 % len(SCHEMES)]
    steps, until = 60 + seed, 0.6
    how = (scheme, until / steps, until)
    start = mbd.assemble(model, place, speed, open=opened)
    expected, events = ends(model, start, *how)
    growth = 1.0
    for name in speed:
        for values in (place, speed):
            if values is place and seed % 3 == 1:
                continue  # a loop closes at its angles only
            pushed = {**values, name: values[name] + PUSH}
            other = mbd.assemble(
                model, pushed if values is place else place, speed if values is place else pushed, open=opened
            )
            growth = max(growth, float(np.max(np.abs(ends(model, other, *how)[0] - expected))) / PUSH)
    units = UNITS * steps + (UNHELD * steps / until if getattr(scheme, "formulation", "") == "index3" else 0.0)
    allowed = units * EPS * growth * max(1.0, float(np.max(np.abs(expected))))
    for nudge in range(3):
        found, same = ends(model, last_bits(start, nudge), *how)
        assert same == events
        assert float(np.max(np.abs(found - expected))) <= allowed
