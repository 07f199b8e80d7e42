"""Wild scenes end in a run that keeps what every run must keep, or in an error that names and advises."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.fuzz.batch import run_batch
from tests.helpers import altered
from tests.simulation.judging import complaints, explains, verdict
from tests.simulation.wild import wild_scene

SHAPES, SCENES = 120, 2000
QUICK = [shape + SHAPES * k for shape in range(12) for k in range(1, 6)]
"""Five scenes of each of the twelve kinds."""

WORKER = [sys.executable, "-m", "tests.simulation.judging"]


def with_several_stages(seed):
    """The scene of a seed, two in five with a scheme of several stages."""
    scheme = {2: mbd.RungeKutta853(), 1: mbd.RadauIIA()}.get(seed // SHAPES % 5)
    return replace(wild_scene(seed), **({"integrator": scheme} if scheme else {}))


def told(verdicts):
    """The bad ones, for a message."""
    bad = [v for v in verdicts if v["kind"] == "bad"]
    return "\n".join(f"wild_scene({v['number']}): {v['reasons']} {v['scene']} … {v['message'][:300]}" for v in bad)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("shape", range(12))
def test_wild_scenes_end_well_or_say_why_not(shape):
    verdicts = [verdict(seed, with_several_stages) for seed in QUICK if seed % SHAPES == shape]
    assert not told(verdicts), told(verdicts)
    assert len(verdicts) == 5


@pytest.mark.slow
@pytest.mark.parametrize("shape", range(SHAPES))
def test_two_thousand_wild_scenes_end_well_or_say_why_not(shape):
    seeds = list(range(shape, SCENES, SHAPES))
    verdicts = run_batch(seeds, command=WORKER)
    assert not told(verdicts), told(verdicts)
    assert [v["number"] for v in verdicts] == seeds


def test_a_scene_is_made_again_from_its_seed():
    one, two = wild_scene(25), wild_scene(25)
    assert (one.start, one.dt, one.integrator, one.options) == (two.start, two.dt, two.integrator, two.options)
    assert one.model is two.model
    assert wild_scene(25 + SHAPES).model is one.model
    assert wild_scene(26).model is not one.model


def test_events_that_follow_each_other_without_end_are_bounded(monkeypatch):
    from mbd.simulation.diagnostics import failures

    monkeypatch.setattr(failures, "MAX_EVENTS_PER_STEP", 10)
    model, ball = mbd.Model("ball"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Prismatic("flight", model.ground.origin, ball.origin, axis=(0, 1, 0)))
    model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin), restitution=0.9))
    start = mbd.assemble(model, position={"flight.displacement": 1.0})
    with pytest.raises(mbd.SimulationError, match=r"than 10 events within one dt: 'floor' closed.*use a smaller dt"):
        mbd.simulate(model, start, dt=2.0, until=100.0)


# the judge ----------------------------------------------------------------------------------------------------------
def dropped():
    model, ball = mbd.Model("ball"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), friction=0.3))
    start = mbd.assemble(model, position={"flight.y": 0.01}, velocity={"flight.x": 1.0})
    return mbd.simulate(model, start, dt=1e-3, until=0.1)


@pytest.mark.parametrize(
    ("field", "column", "value", "said"),
    [
        ("q", 0, np.nan, "q is not finite"),
        ("q", 1, -0.1, "'floor' is 0.1 m below its surface"),
        ("lam", 0, 30.0, "'floor' pulls"),
        ("lam", 1, 30.0, "friction of 'floor' is 30"),
    ],
)
def test_the_judge_sees_a_run_that_lies(field, column, value, said):
    assert complaints(dropped()) == []
    run = altered(dropped(), field, np.s_[-20:, column], lambda right: value)
    assert any(said in complaint for complaint in complaints(run)), complaints(run)


def test_the_judge_wants_a_name_and_advice():
    assert explains("t = 1 s: 'left foot' fails; use a smaller dt")
    assert not explains("t = 1 s: it fails; use a smaller dt")
    assert not explains("'left foot' fails")
