"""Rows, contacts and guards of a model as the stepping sees them."""

import numpy as np
import pytest

import mbd
from mbd.equations import derive
from mbd.equations.programs import accelerations, guards
from tests.equations.mechanisms import furnished, leg, random_tree, walker
from tests.equations.numbers import at, derivative, inputs
from tests.helpers import one_body


def test_contacts_list_their_rows_normal_first():
    equations = derive(walker())
    parts = {c.name: [(equations.rows[k].owner, equations.rows[k].part) for k in c.rows] for c in equations.contacts}
    assert parts["left foot"] == [("left foot", "normal"), ("left foot", "forward")]
    assert parts["right knee lock"] == [("right knee lock", "normal")]
    assert all(equations.rows[k].contact == number for number, c in enumerate(equations.contacts) for k in c.rows)
    foot, lock = equations.contacts[0], equations.contacts[1]
    assert foot.when == (("right foot", False),)
    assert lock.when == (("right foot", True),)
    assert foot.opens_on == lock.opens_on == "when"
    assert lock.unit == "rad"
    assert equations.bilateral == ()


def test_anchors_hold_the_place_of_touchdown():
    """A tangent row is zero at the place captured, and is the way slid from there otherwise."""
    equations = derive(walker())
    point = inputs(equations, 1)
    foot = equations.contacts[2]
    place = at(foot.captured, point)
    held = point | {("anchor", k): value for k, value in zip(foot.anchors, place, strict=True)}
    tangent = equations.rows[foot.rows[1]]
    assert at([tangent.value], held)[0] == pytest.approx(0.0, abs=1e-15)
    held["anchor", foot.anchors[0]] -= 0.2
    assert at([tangent.value], held)[0] == pytest.approx(0.2)
    numbers = [k for contact in equations.contacts for k in contact.anchors]
    assert numbers == list(range(len(numbers)))


def test_gap_and_rates_belong_together():
    for model in (leg(), furnished(random_tree(8, 3, spatial=True), 3)):
        equations = derive(model)
        point = inputs(equations, 2)
        motion = {("x", k): point["v", k] for k in range(equations.n_v)} | {("t", 0): 1.0}
        motion |= {("v", k): point["a", k] for k in range(equations.n_v)}
        pairs = [(c.gap, c.gap_rate) for c in equations.contacts] + [(g.value, g.rate) for g in equations.guards]
        for value, rate in pairs:
            assert at([rate], point)[0] == pytest.approx(derivative([value], point, motion)[0], abs=1e-7)


def test_guards_program_lists_contacts_then_events():
    equations = derive(leg())
    point = inputs(equations, 3)
    values = at(guards(equations), point)
    count = len(equations.contacts)
    assert len(values) == 4 * count + 2 * len(equations.guards)
    gaps, rates, forces, conditions = values[: 4 * count].reshape(4, count)
    stop = [c.name for c in equations.contacts].index("stop")
    assert forces[stop] == pytest.approx(-300.0 * gaps[stop] - 2.0 * rates[stop])
    assert not np.delete(forces, stop).any()
    assert conditions[0] == point["q", 2]  # only_while the hip is swung forward
    assert (conditions[1:] == 1.0).all()


def test_a_penalty_pushes_along_its_gap():
    equations = derive(leg())
    point = inputs(equations, 4)
    stop = next(c for c in equations.contacts if c.kind == "penalty")
    slope = np.array([derivative([stop.gap], point, {("x", k): 1.0})[0] for k in range(equations.n_v)])
    np.testing.assert_allclose(at(stop.generalized, point), -at([stop.force], point)[0] * slope, atol=1e-7)


def test_contact_force_is_a_push():
    """A foot that carries the mechanism reports a positive force; the ground's friction acts on the body."""
    equations = derive(walker())
    point = inputs(equations, 5) | {("lam", 0): -3.0, ("lam", 1): 0.4}
    names = ["left foot.force", "left foot.friction", "left foot.friction.forward", "left foot.gap"]
    force, friction, forward, gap = at([equations.output(name) for name in names], point)
    assert (force, friction, forward) == (3.0, -0.4, -0.4)
    assert gap == at([equations.output("left shank.end.y")], point)[0]


def test_a_rod_reports_its_tension_and_a_prescribed_joint_its_drive():
    model = mbd.Model("crane")
    boom = mbd.Link("boom", mass=10.0, length=2.0, center=1.0, inertia=3.0)
    winch = mbd.Link("winch", mass=1.0, length=0.1, center=0.0, inertia=0.1)
    turn = mbd.Revolute("turn", model.ground.point(3.0, 0.0), winch.start)
    model.connect(mbd.Revolute("foot", model.ground.origin, boom.start), turn)
    model.constrain(
        mbd.Bilateral("cable", mbd.distance(model.ground.point(0.0, 3.0), boom.end), value=2.5),
        mbd.Bilateral("schedule", turn, value=lambda t: 0.5 * t * t),
    )
    equations = derive(model)
    point = inputs(equations, 6) | {("lam", 0): 7.0, ("lam", 1): -2.0}
    names = ["cable.tension", "cable.force", "cable.multiplier", "schedule.torque", "schedule.multiplier"]
    assert list(at([equations.output(name) for name in names], point)) == [7.0, 7.0, 7.0, 2.0, -2.0]
    t, rate = point["t", 0], equations.rows[1].rate
    assert at([rate], point)[0] == pytest.approx(point["v", 1] - t)
    schedule = at(accelerations(equations), point)
    assert np.isfinite(schedule).all()


def pin_and(*constraints) -> mbd.Model:
    model, rod = one_body(mbd.Link("rod", mass=1.0, length=0.7, center=0.3), mbd.Revolute, "pin")
    model.constrain(*(constraint(model, rod) for constraint in constraints))
    return model


@pytest.mark.parametrize(
    ("constraint", "sentence"),
    [
        (lambda model, rod: mbd.Bilateral("held", mbd.height(rod.start), value=0.2), "'held' is -0.2 m whatever"),
        (lambda model, rod: mbd.Bilateral("held", mbd.height(rod.start)), "'held' is 0 whatever the motion"),
        (lambda model, rod: mbd.Unilateral("foot", mbd.touchdown(rod.start)), "'foot', row 'normal' is 0 whatever"),
        (lambda model, rod: mbd.Penalty("pad", mbd.height(rod.start), stiffness=9.0), "gap of 'pad' is the same"),
        (
            lambda model, rod: mbd.Bilateral("held", mbd.measure("pin.rate")),
            "'held' depends on velocities",
        ),
        (
            lambda model, rod: mbd.Bilateral("held", mbd.measure(lambda t: t - 1.0, "t")),
            "'held' prescribes in time what no motion changes",
        ),
    ],
)
def test_constraints_that_cannot_act_are_faults(constraint, sentence):
    with pytest.raises(mbd.ModelError, match=sentence):
        derive(pin_and(constraint))


def test_all_faulty_rows_are_told_at_once():
    model = pin_and(
        lambda model, rod: mbd.Bilateral("one", mbd.height(rod.start), value=0.2),
        lambda model, rod: mbd.Bilateral("two", mbd.measure("pin.rate")),
    )
    with pytest.raises(mbd.ModelError) as caught:
        derive(model)
    assert len(caught.value.faults) == 2


def test_rows_that_fold_in_the_plane_are_left_out():
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=0.7, center=0.3), mbd.Revolute, "pin", cut=["pin"])
    assert [row.part for row in derive(model).rows] == ["x", "y"]


def test_parts_of_a_cut_that_never_meet_are_a_fault():
    """In space, a hinge cut across two offsets that differ along its axis cannot close."""
    model = mbd.Model("apart", cut=["second"])
    rod = mbd.RigidBody("rod", 1.0, (0.1, 0.1, 0.1))
    out = mbd.RigidBody("out", 1.0, (0.1, 0.1, 0.1))
    model.connect(
        mbd.Revolute("first", model.ground.origin, rod.origin),
        mbd.Revolute("second", rod.point(1.0, 0.0, 0.3), out.point(0.0, 1.0, 0.1)),
        mbd.Revolute("third", model.ground.point(1.5, 0.0), out.origin),
    )
    model.connect(mbd.Universal("free", rod.point(0.2, 0.2), mbd.RigidBody("tool", 1.0, (0.1, 0.1, 0.1)).origin))
    with pytest.raises(mbd.ModelError, match=r"'second', row 'z' is -0\.2 m whatever the motion"):
        derive(model)
