"""Rows that depend on others: what a run says of them, beside the hard cases j2, j11 and j11b."""

import numpy as np
import pytest

import mbd
from mbd.hardcases.redundant_rows import parallel_cranks
from tests.cases.linkages import four_bars

G = 9.81


def test_redundant_pins_share_their_force_with_least_norm_and_a_note():
    run = mbd.simulate(*parallel_cranks(), mbd.GeneralizedAlpha(0.9), dt=1e-3, until=1.0)
    (note,) = run.stats["notes"]
    assert "redundant" in note and "pin 2" in note and "least norm" in note


def test_a_law_that_reads_a_force_which_redundant_rows_share_is_told():
    """The motion then follows how they share it; a law that reads a force which is determined leaves it unique."""
    for reads, told in (("pin 2.reaction_force.y", "the motion under 'drive', which reads it"), ("base 0.rate", "")):
        model, start = parallel_cranks()
        model.apply(mbd.Motor("drive", model.joints[0], lambda value: 0.01 * value, arguments=[reads]))
        run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=2e-2, until=0.2, backend="python")
        (note,) = run.stats["notes"]
        assert told in note and ("motion is unique" in note) == (not told)


def test_a_box_with_sticking_corners_lands_flat_and_rests_on_all_of_them():
    """Their tangent rows depend on each other: the motion is unique, the split of friction is not, and it is said."""
    model = mbd.Model("box")
    box = mbd.RigidBody("box", mass=2.0, inertia=0.19333)
    model.connect(mbd.Planar("flight", model.ground.origin, box.origin))
    for name, x in ("left", -0.5), ("middle", 0.0), ("right", 0.5):
        model.constrain(mbd.Unilateral(name, mbd.touchdown(box.point(x, -0.2, name=name))))
    start = mbd.assemble(model, position={"flight.y": 0.3}, velocity={"flight.x": 0.5, "flight.y": -1.5})
    run = mbd.simulate(model, start, dt=1e-3, until=1.0)
    assert [event.kind for event in run.events] == ["closed"] * 3
    assert [run[f"{name}.force"][-1] for name in ("left", "middle", "right")] == pytest.approx(
        [2.0 * G / 3] * 3, abs=1e-9
    )
    assert np.max(np.abs(run["flight.angle"])) < 1e-12
    np.testing.assert_allclose(run.record.v[-1], 0.0, atol=1e-9)
    assert run["flight.x"][-1] == pytest.approx(0.5 * run.events[0].time, abs=1e-9)
    assert run.energy["numerical"][-1] == pytest.approx(0.0, abs=1e-9)
    assert any("not" in note and "unique" in note for note in run.stats["notes"])


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_at_a_flat_start_nobody_says_that_the_motion_is_unique(scheme):
    """Both cranks of a parallelogram lie flat: it may go on as a parallelogram or as an antiparallelogram."""
    model = four_bars(1)
    flat = dict.fromkeys(("base 0.angle", "base 1.angle"), np.pi / 2)
    start = mbd.assemble(model, position=flat, velocity=dict.fromkeys(flat, 2.0))
    run = mbd.simulate(model, start, scheme, dt=1e-2, until=0.3, on_failure="return")
    assert max(run.violation.length, run.violation.angle) < 1e-7
    notes = " ".join(run.stats["notes"])
    assert run.success or ("the motion is unique" not in notes and "singular configuration" in notes)


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize("steps", [{"dt": 2e-3}, {"tol": 1e-4}], ids=str)
def test_feet_at_one_place_of_a_driven_table_carry_the_weight_and_give_the_thrust(scheme, steps):
    """Where something is driven, forces of the Newmark family are solved for again at the end of a step."""
    model, table, block = mbd.Model("table"), mbd.PointMass("table", 3.0), mbd.PointMass("block", 1.25)
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin)
    model.connect(rail, mbd.Translation("block", model.ground.origin, block.origin))
    model.constrain(mbd.Bilateral("drive", rail, value=lambda t: 0.5 * t * t))
    ground = mbd.Plane(frame=table.origin)
    for k in range(3):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(block.origin, ground), friction=0.3))
    run = mbd.simulate(model, mbd.assemble(model), scheme, until=0.05, **steps)
    for part, whole in ("force", 1.25 * 9.81), ("friction", 1.25):
        assert sum(run[f"foot {k}.{part}"][1:] for k in range(3)) == pytest.approx(whole, rel=1e-6)


def frame_beside_a_ball(seed: int, size: float, restitution: float) -> mbd.Model:
    """A pendulum that carries a loop which cannot move and has more rows than it needs, and a ball that bounces."""
    rng, model = np.random.default_rng(seed), mbd.Model("frame beside a ball", gravity=(0.0, -G * size, 0.0))
    inertia = tuple(size**2 * np.array([0.1, 0.2, 0.15]))
    base, a, b = (
        mbd.RigidBody(name, 1.0, inertia, center=tuple(0.2 * size * rng.normal(size=3))) for name in ("base", "a", "b")
    )
    p, q = size * rng.normal(size=(2, 3))
    axes = [tuple(axis) for axis in rng.normal(size=(4, 3))]
    model.connect(
        mbd.Revolute("pivot", model.ground.origin, base.origin, axis=axes[0]),
        mbd.Revolute("one", base.origin, a.origin, axis=axes[1]),
        mbd.Cylindrical("two", a.point(*p), b.origin, axis=axes[2]),
        mbd.Revolute("three", base.point(*(p + q)), b.point(*q), axis=axes[3]),
    )
    ball = mbd.PointMass("ball", 8.0)
    fall = mbd.Prismatic("fall", model.ground.origin, ball.origin, axis="y")
    model.connect(fall)
    model.constrain(mbd.Unilateral("floor", mbd.extension(fall, 0.0), restitution=restitution))
    return model


@pytest.mark.parametrize("impact", ["newton", "poisson", "sequential"])
@pytest.mark.parametrize(("seed", "size"), [(0, 1.0), (1, 1e-3), (2, 1e3)])
def test_a_frame_that_cannot_move_does_not_keep_a_ball_beside_it_from_bouncing(seed: int, size: float, impact: str):
    """The rates of its joints are round-off, in which rows that depend on others do not agree."""
    model = frame_beside_a_ball(seed, size, 0.5)
    start = mbd.assemble(model, {"fall.displacement": 0.02 * size}, {"pivot.angle": 0.01}, project=True)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=0.1, impact=impact)
    strike = np.sqrt(2.0 * 0.02 / G)
    assert [event.time for event in run.events] == pytest.approx([strike], rel=1e-9)
    assert run["fall.rate"][-1] == pytest.approx(size * G * (0.5 * strike - (0.1 - strike)), rel=1e-9)
    assert np.ptp(run["one.angle"]) < 1e-12
