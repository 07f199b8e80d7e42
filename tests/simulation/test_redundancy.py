"""Rows that depend on others: the motion is unique, the multipliers of least norm, and the run says so."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from tests.cases.linkages import four_bars

G = 9.81
SCHEMES = [mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3"), mbd.Newmark()]


def parallel_cranks(count=3):
    """Equal cranks that carry one coupler: every crank beyond the second is redundant."""
    model = mbd.Model("parallel cranks")
    coupler = mbd.RigidBody("coupler", mass=2.0, inertia=0.1)
    cranks = [mbd.Link(f"crank {k}", mass=1.0, length=1.0, center=0.5, inertia=1 / 12) for k in range(count)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"pin {k}", crank.end, coupler.point(k - 1.0, 0.0, name=f"pin {k}")))
    start = mbd.assemble(model, position={"base 0.angle": 0.8, "pin 0.angle": -0.8}, velocity={"base 0.rate": 1.0})
    return model, start


def crank_angle(t):
    """θ(t) of three cranks of inertia 1/3 each and a coupler of 2 kg that only translates, from Lagrange's equation."""

    def rate(_, y):
        return y[1], -(3 * 0.5 + 2.0) * G * np.sin(y[0]) / (3 / 3 + 2.0)

    return solve_ivp(rate, (0.0, t), (0.8, 1.0), method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_parallel_cranks_move_as_one_although_their_rows_depend_on_each_other(scheme):
    model, start = parallel_cranks()
    exact = crank_angle(1.0)
    errors = [
        abs(mbd.simulate(model, start, scheme, dt=dt, until=1.0)["base 0.angle"][-1] - exact)
        for dt in (4e-3, 2e-3, 1e-3)
    ]
    assert 3.6 < errors[0] / errors[1] < 4.4
    assert 3.6 < errors[1] / errors[2] < 4.4


def test_redundant_pins_share_their_force_with_least_norm_and_a_note():
    model, start = parallel_cranks()
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=1e-3, until=1.0)
    total = sum(run[f"pin {k}.reaction_force"][0] for k in range(3))
    # the coupler translates on a circle: m a − m g, with θ'' of the one-coordinate equation
    angle, rate = 0.8, 1.0
    turn = -(3.5 * G * np.sin(angle)) / 3.0
    force = 2.0 * np.array(
        [turn * np.cos(angle) - rate**2 * np.sin(angle), turn * np.sin(angle) + rate**2 * np.cos(angle) + G]
    )
    assert total[:2] == pytest.approx(force, abs=1e-9)
    assert np.max(np.abs(run.record.lam)) < 100.0
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


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2)])
def test_a_table_on_four_legs_rests_on_equal_forces_in_any_order(order, scheme):
    model = mbd.Model("table")
    stem, top = mbd.PointMass("stem", mass=0.0), mbd.RigidBody("top", mass=10.0, inertia=(1.0, 1.0, 1.0))
    model.connect(
        mbd.Prismatic("lift", model.ground.origin, stem.origin, axis=(0, 1, 0)),
        mbd.Universal("tilt", stem.origin, top.origin),
    )
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    for k in order:
        x, z = corners[k]
        model.constrain(mbd.Unilateral(f"leg {k}", mbd.height(top.point(x, 0.0, z, name=f"foot {k}"))))
    run = mbd.simulate(model, mbd.assemble(model, closed=[f"leg {k}" for k in range(4)]), scheme, dt=1e-2, until=10.0)
    assert not run.events
    for k in range(4):
        assert run[f"leg {k}.force"] == pytest.approx(np.full(len(run.time), 24.525), abs=1e-9)
    assert np.max(np.abs(run["lift.displacement"])) < 1e-12


def test_a_box_with_sticking_corners_lands_flat_and_rests_on_all_of_them():
    model = mbd.Model("box")
    box = mbd.RigidBody("box", mass=2.0, inertia=0.19333)
    model.connect(mbd.Planar("flight", model.ground.origin, box.origin))
    for name, x in ("left", -0.5), ("middle", 0.0), ("right", 0.5):
        model.constrain(mbd.Unilateral(name, mbd.touchdown(box.point(x, -0.2, name=name))))
    start = mbd.assemble(model, position={"flight.y": 0.3}, velocity={"flight.y": -1.5})
    run = mbd.simulate(model, start, dt=1e-3, until=1.0)
    assert [event.kind for event in run.events] == ["closed"] * 3
    assert [run[f"{name}.force"][-1] for name in ("left", "middle", "right")] == pytest.approx(
        [2.0 * G / 3] * 3, abs=1e-9
    )
    assert np.max(np.abs(run["flight.angle"])) < 1e-12
    assert run.energy["numerical"][-1] == pytest.approx(0.0, abs=1e-9)


def test_redundant_rows_that_conflict_are_an_error_at_assembly():
    model = mbd.Model("rod")
    bob = mbd.PointMass("bob", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, bob.origin))
    for name, length in ("short", 1.0), ("long", 1.1):
        model.constrain(mbd.Bilateral(name, mbd.distance(model.ground.origin, bob.origin), length))
    with pytest.raises(mbd.AssemblyError, match="constraint 'short', constraint 'long' cannot hold together"):
        mbd.assemble(model, position={"place.x": 0.6})


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
