"""Impulses of events: each contact that takes part in an impact is reported once; together they change the momentum."""

from __future__ import annotations

import random
from functools import cache

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import point, run

LAWS = ("newton", "poisson", "sequential")
SEEDS = range(18)


def tumbler(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A plate with corners that touch the floor, sticking, sliding or bouncing, and a rod hinged to it; no walls."""
    rng = random.Random(seed)
    model = mbd.Model(f"tumbler {seed}")
    plate = mbd.RigidBody("plate", mass=2.0, inertia=0.2)
    rod = mbd.Link("rod", 0.7, 0.4, 0.2, 0.02)
    model.connect(mbd.Planar("place", model.ground.origin, plate.origin))
    model.connect(mbd.Revolute("hinge", plate.point(0.05, 0.1), rod.start, loss=rng.choice([None, mbd.Coulomb(0.05)])))
    friction = rng.choice([0.0, 0.5, None, None])
    restitution = rng.choice([0.0, 0.0, 0.0, 0.3])
    for k in range(rng.choice([2, 3, 4])):
        corner = plate.point(rng.uniform(-0.4, 0.4), -0.15 - 0.02 * k * rng.random())
        model.constrain(
            mbd.Unilateral(f"corner {k}", mbd.touchdown(corner), restitution=restitution, friction=friction)
        )
    start = mbd.assemble(
        model,
        position={"place.y": 0.45, "place.angle": rng.uniform(-0.5, 0.5), "hinge.angle": rng.uniform(-1, 1)},
        velocity={"place.x": rng.uniform(-1, 1), "place.angle": rng.uniform(-3, 3), "place.y": rng.uniform(-1, 0)},
    )
    return model, start


def momentum(trajectory) -> np.ndarray:
    """m v of the plate and the rod (R, 2) [kg m/s]."""
    speeds = [np.column_stack([trajectory[f"{body}.center.v{axis}"] for axis in "xy"]) for body in ("plate", "rod")]
    return 2.0 * speeds[0] + 0.7 * speeds[1]


@cache
def tumbled(seed: int) -> mbd.Trajectory:
    model, start = tumbler(seed)
    return mbd.simulate(model, start, dt=2e-3, until=1.0, impact=LAWS[seed % 3], on_failure="return")


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", SEEDS)
def test_the_impulses_of_events_add_up_to_the_change_of_momentum(seed):
    trajectory = tumbled(seed)
    moved = momentum(trajectory)
    rows = sorted({event.row for event in trajectory.events if event.kind == "closed"})
    assert rows
    for row in rows:
        told = [event.impulses for event in trajectory.events if event.row == row]
        pushes = [impulse for impulses in told for name, impulse in impulses.items() if name.startswith("corner")]
        normal = sum(impulse[0] for impulse in pushes)
        tangential = sum(impulse[1] for impulse in pushes if len(impulse) > 1)
        assert all(impulse[0] >= -1e-12 for impulse in pushes)
        jump = moved[row] - moved[row - 1]
        np.testing.assert_allclose([tangential, normal], jump, rtol=0, atol=1e-11)


def test_some_of_these_impacts_strike_contacts_that_were_closed_already():
    told = [event for seed in SEEDS for event in tumbled(seed).events if len(event.impulses) > 1]
    assert len(told) >= 4


def test_a_corner_that_rests_takes_a_part_of_the_blow_on_the_other():
    """A box that tips about its sticking left corner: m v_y of the box is what both corners give."""
    trajectory = mbd.simulate(*_tipping(), dt=1e-3, until=("right", 2.0))
    strike = trajectory.events[-1]
    assert strike.name == "right" and set(strike.impulses) == {"left", "right"}
    np.testing.assert_array_equal(strike.impulses["right"], strike.impulse)
    jump = trajectory["place.y.rate"][strike.row] - trajectory["place.y.rate"][strike.row - 1]
    assert strike.impulses["left"][0] + strike.impulse[0] == pytest.approx(2.0 * jump, rel=1e-12)
    assert "impulse of 'left'" in repr(strike)


def _tipping() -> tuple[mbd.Model, mbd.State]:
    """The box on its left corner, held through every impact by its rule."""
    model = mbd.Model("box")
    body = mbd.RigidBody("box", mass=2.0, inertia=0.2)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    model.constrain(
        mbd.Unilateral("right", mbd.touchdown(body.point(0.25, -0.15))),
        mbd.Unilateral("left", mbd.touchdown(body.point(-0.25, -0.15)), release=mbd.When("never")),
        mbd.Unilateral("never", mbd.touchdown(body.point(0.0, 5.0))),
    )
    height = 0.25 * np.sin(0.3) + 0.15 * np.cos(0.3)
    return model, mbd.assemble(model, closed=["left"], position={"place.angle": 0.3, "place.y": height})


def test_an_opening_has_zero_impulses_of_its_contact():
    model, body = point()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), friction=0.0))
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, lambda t: 20.0 * t, 0.0)))
    (event,) = run(model, closed=["floor"], dt=0.01).events
    assert event.kind == "opened"
    np.testing.assert_array_equal(event.impulse, np.zeros(len(event.impulses["floor"])))
    assert len(event.impulse) == 1 and "impulse" not in repr(event)


def test_impulses_are_kept_in_files(tmp_path):
    trajectory = mbd.simulate(*_tipping(), dt=1e-3, until=("right", 2.0))
    loaded = mbd.load(trajectory.save(tmp_path / "run"))
    assert any(event.impulses for event in trajectory.events)
    for one, other in zip(trajectory.events, loaded.events, strict=True):
        assert list(one.impulses) == list(other.impulses)
        for name in one.impulses:
            np.testing.assert_array_equal(one.impulses[name], other.impulses[name])
