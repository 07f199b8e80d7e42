"""A projected start is nearest to what was named, whichever joints are cut and however many turns the names ask for."""

from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from tests.space_scenes import scene

ANGLES = ("crank.angle", "pin.angle", "rocker.angle", "joint.angle")


def four_bar(seed, cut, lengths=None):
    random = np.random.default_rng(seed)
    crank, coupler, rocker, base = lengths or (0.3 + 0.1 * random.random(), *(0.9 + 0.3 * random.random(3)))
    model = mbd.Model("four-bar", cut=cut)
    a, b, c = (
        mbd.Link(name, mass=1.0, length=length, center=0.5 * length)
        for name, length in zip("abc", (crank, coupler, rocker), strict=True)
    )
    model.connect(
        mbd.Revolute("crank", model.ground.origin, a.start),
        mbd.Revolute("pin", a.end, b.start),
        mbd.Revolute("rocker", model.ground.point(base, 0.0, 0.0, name="post"), c.start),
        mbd.Revolute("joint", b.end, c.end),
    )
    return model


def rounded(seed):
    """Angles and rates of a pose to two digits, turned by whole turns as the loop allows."""
    random = np.random.default_rng(seed + 100)
    start = mbd.assemble(four_bar(seed, ["joint"]), {"crank.angle": random.uniform(-3.0, 3.0)}, {"crank.angle": 2.0})
    run = mbd.simulate(four_bar(seed, ["joint"]), start, dt=1e-3, until=1e-3, backend="python")
    turns = 2.0 * np.pi * np.array([*random.integers(-2, 3, 3), 0])
    turns[3] = turns[2] - turns[0] - turns[1]  # the difference of headings, as the angle of a fourth joint is
    exact = np.array([run[name][0] for name in ANGLES]) + turns
    rates = [run[f"{name}.rate"][0] for name in ANGLES]
    return dict(zip(ANGLES, np.round(exact, 2), strict=True)), dict(zip(ANGLES, np.round(rates, 2), strict=True))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("cut", ["auto", ["crank"], ["pin", "joint"]], ids=str)
def test_rounded_angles_and_rates_of_a_loop_are_projected_whichever_joints_are_cut(seed, cut):
    angles, rates = rounded(seed)
    model = four_bar(seed, cut)
    if cut == "auto":
        with pytest.raises(mbd.AssemblyError, match="cannot be reached|contradicts"):
            mbd.assemble(model, angles, rates)
    start = mbd.assemble(model, angles, rates, project=True)
    run = mbd.simulate(model, start, dt=1e-3, until=1e-3, backend="python")
    for name in ANGLES:
        assert abs(run[name][0] - angles[name]) < 0.05, name
        assert abs(run[f"{name}.rate"][0] - rates[name]) < 0.2, name


@pytest.mark.parametrize("cut", ["auto", ["crank"], ["pin"]], ids=str)
def test_a_projected_crank_is_no_further_than_half_a_turn_from_the_angle_that_was_named(cut):
    """The values lie far from any pose of the loop, so that closing turns bodies by more than a turn."""
    for seed in range(2):
        named = dict(zip(ANGLES[:3], np.random.default_rng(seed).uniform(-9.0, 9.0, 3), strict=True))
        model = four_bar(seed, cut)
        start = mbd.assemble(model, named, project=True)
        run = mbd.simulate(model, start, dt=1e-3, until=1e-3, backend="python")
        for name, value in named.items():
            assert abs(run[name][0] - value) <= np.pi + 1e-9, name


def test_angles_named_a_turn_away_from_a_pose_are_projected_to_that_pose_next_to_them():
    """An angle of 8.87 rad that was asked for is moved to 10.84 rad, not to 4.56 rad, the same pose."""
    lengths = np.random.default_rng(0).uniform(0.3, 1.5, 4).tolist()
    named = {"crank.angle": -5.0, "joint.angle": 8.87}
    start = mbd.assemble(four_bar(0, ["rocker"], lengths), named, project=True)
    for name, value in named.items():
        assert abs(start[name] - value) <= np.pi + 1e-9, name


@pytest.mark.parametrize("joint", ["cylindrical", "screw", "universal"])
def test_a_projection_is_linear_in_small_changes_and_leaves_a_base_that_carries_the_loop(joint):
    """Rows that are off turn with such a base: that is no action on them, however far they are off."""
    made = scene("loop", joint, 0)
    configuration = mechanism_of(made.model).equations.configuration
    change = np.random.default_rng(0).normal(size=configuration.n_v)
    found = []
    for size in (1e-4, 1e-5, 1e-6):
        ends = [
            mbd.project(made.model, replace(made.start, q=configuration.compose(made.start.q, step), memory=None)).q
            for step in (-size * change, size * change)
        ]
        found.append(configuration.difference(*ends) / (2.0 * size))
    np.testing.assert_allclose(found[1:], found[:1] * 2, rtol=0, atol=1e-5)
    if joint != "universal":
        np.testing.assert_allclose(found[0][:3], change[:3], rtol=0, atol=1e-5)
