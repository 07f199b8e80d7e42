"""What single joints do, and what they refuse."""

import math
import pickle
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.bodies import Ground
from mbd.errors import ModelError
from mbd.joints.reflected import signs_in_a_mirror
from tests.helpers import FreeScope

GROUND = Ground().origin
ROD = mbd.Link("rod", 1.0, 0.5, 0.2)


def test_a_positive_angle_swings_a_hanging_link_forward():
    scope = FreeScope()
    R, _ = mbd.Revolute("hip", GROUND, ROD.start).transform([0.3], scope)
    end = [sum(R[i][k] * (0.0, -0.5, 0.0)[k] for k in range(3)) for i in range(3)]
    assert end[0] == pytest.approx(0.5 * math.sin(0.3))
    assert end[1] == pytest.approx(-0.5 * math.cos(0.3))


@given(turns=st.floats(-40.0, 40.0))
def test_a_screw_counts_full_turns(turns):
    joint = mbd.Screw("screw", GROUND, ROD.start, pitch=0.01)
    scope = FreeScope()
    angle = scope.tape.input("q", 0)
    scope.numbers[angle] = turns
    R, p = joint.transform([angle], scope)
    assert scope.value(*p)[2] == pytest.approx(0.01 * turns / (2 * math.pi), abs=1e-12)
    assert scope.value(*joint.recover(R, p, scope)) == pytest.approx([turns], abs=1e-9)
    assert scope.value(*(value for _, value in joint.rows(R, p, scope))) == pytest.approx([0.0] * 5, abs=1e-9)


def test_a_screw_out_of_step_has_a_residual():
    joint = mbd.Screw("screw", GROUND, ROD.start, pitch=0.01)
    scope = FreeScope()
    R, _ = mbd.Revolute("turn", GROUND, ROD.start).transform([0.4], scope)
    rows = dict(joint.rows(R, (0.0, 0.0, 0.0), scope))
    assert scope.value(rows["turn about"]) == pytest.approx([0.4])


def test_spring_of_a_joint_stores_energy_about_its_rest():
    joint = mbd.Revolute("knee", GROUND, ROD.start, stiffness=8.0, rest=0.5)
    scope = FreeScope()
    assert scope.value(joint.elastic_energy([1.5], scope)) == pytest.approx([4.0])


def test_a_joint_without_stiffness_or_loss_costs_nothing():
    scope = FreeScope()
    q = scope.tape.input("q", 0)
    joint = mbd.Revolute("knee", GROUND, ROD.start)
    assert scope.tape.lift(joint.elastic_energy([q], scope)).is_zero
    assert joint.resistance([q], scope) == [0.0]


def test_a_loss_by_label_acts_on_that_coordinate_only():
    joint = mbd.Planar("float", GROUND, ROD.start, loss={"angle": mbd.Viscous(2.0)})
    scope = FreeScope()
    rates = [scope.tape.input("v", k) for k in range(3)]
    scope.numbers |= dict(zip(rates, (1.0, 2.0, 3.0), strict=True))
    assert scope.value(*joint.resistance(rates, scope)) == pytest.approx([0.0, 0.0, 6.0])
    assert joint.parameters() == {"float loss.angle.coefficient": 2.0}


def test_one_loss_acts_on_every_coordinate_of_one_unit():
    joint = mbd.Translation("slide", GROUND, ROD.start, loss=mbd.Viscous(2.0))
    scope = FreeScope()
    assert scope.value(*joint.resistance([1.0, 3.0], scope)) == pytest.approx([2.0, 6.0])
    assert joint.parameters() == {"slide loss.coefficient": 2.0}


@pytest.mark.parametrize("kind", [mbd.Planar, mbd.Cylindrical, mbd.Weld])
def test_one_loss_on_metres_and_radians_is_refused(kind):
    with pytest.raises((ModelError, TypeError)):
        kind("float", GROUND, ROD.start, loss=mbd.Viscous(2.0))


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: mbd.Revolute("knee", ROD, ROD.start), "parent must be a frame"),
        (lambda: mbd.Revolute("", GROUND, ROD.start), "needs a name"),
        (lambda: mbd.Revolute("left.knee", GROUND, ROD.start), "no dot"),
        (lambda: mbd.Revolute("knee", GROUND, ROD.start, axis=(0, 0, 0)), "must not be zero"),
        (lambda: mbd.Revolute("knee", GROUND, ROD.start, axis=(0, 0, math.nan)), "must be finite"),
        (lambda: mbd.Revolute("knee", GROUND, ROD.start, loss=0.1), "such as mbd.Viscous"),
        (lambda: mbd.Revolute("knee", GROUND, ROD.start, stiffness="stiff"), "must be a number"),
        (lambda: mbd.Planar("float", GROUND, ROD.start, loss={"angel": mbd.Viscous(1.0)}), "'angle'"),
        (lambda: mbd.Translation("slide", GROUND, ROD.start, axes="xw"), "'xyz'"),
        (lambda: mbd.Translation("slide", GROUND, ROD.start, axes="xx"), "each once"),
        (lambda: mbd.Universal("cross", GROUND, ROD.start, second_axis=(0, 0, 1)), "across each other"),
        (lambda: mbd.Screw("screw", GROUND, ROD.start, pitch=0.0), "mbd.Revolute"),
    ],
)
def test_wrong_joints_are_refused_in_words(make, told):
    with pytest.raises(ModelError, match=told):
        make()


def test_joints_are_values():
    joint = mbd.Revolute("knee", GROUND, ROD.start, axis=(0, 0, 2), loss=mbd.Viscous(0.1))
    assert joint.axis == (0.0, 0.0, 1.0)
    assert pickle.loads(pickle.dumps(joint)) == joint
    assert replace(joint, loss=None).loss is None
    assert len({joint, replace(joint)}) == 1
    assert {mbd.Planar("float", GROUND, ROD.start, loss={"x": mbd.Viscous(1.0)})}


def test_a_joint_tells_what_is_impossible_about_it():
    joint = mbd.Revolute("knee", ROD.end, ROD.start, loss=mbd.Viscous(-1.0))
    text = " ".join(joint.faults())
    assert "feed energy in" in text
    assert "connects 'rod' to itself" in text


@pytest.mark.parametrize(
    ("kind", "instead"),
    [(mbd.Revolute, "TorsionSpring"), (mbd.Prismatic, "TorsionSpring"), (mbd.Spherical, "Potential")],
)
def test_a_spring_of_negative_stiffness_is_refused_when_its_joint_is_made(kind, instead):
    with pytest.raises(ModelError) as refused:
        kind("knee", GROUND, ROD.start, loss=mbd.Viscous(-1.0), stiffness=-2.0)
    drive_in, stiffness = refused.value.faults
    assert "'knee loss'" in drive_in
    assert "feed energy in" in drive_in
    assert "joint 'knee': stiffness -2 is negative" in stiffness
    assert f"mbd.{instead}" in stiffness


def test_signs_in_a_mirror_are_those_of_angular_velocities_and_places():
    """Across the plane that gravity lies in; of a model without sides, or one that no mirror leaves as it is, none."""
    trunk, legs = mbd.RigidBody("trunk", 1.0, (1.0, 1.0, 1.0)), {}
    joints = [mbd.Free("float", GROUND, trunk.origin)]
    for side in ("left", "right"):
        legs[side] = mbd.RigidBody(f"{side} leg", 1.0, (1.0, 1.0, 1.0))
        joints.append(mbd.Universal(f"{side} hip", trunk.origin, legs[side].origin, axis=(0, 0, 1)))
    signs = signs_in_a_mirror(joints, (0.3, -9.81, 0.0))
    assert [signs[f"float.{axis}"] for axis in "xyz"] == [1.0, 1.0, -1.0]
    assert [signs[f"float.orientation.{part}"] for part in "wxyz"] == [1.0, -1.0, -1.0, 1.0]
    assert (signs["left hip.first"], signs["right hip.second.rate"]) == (1.0, -1.0)
    assert signs_in_a_mirror(joints, (0.3, 0.0, -9.81))["left hip.first"] == -1.0
    assert signs_in_a_mirror(joints[:1], (0.0, -9.81, 0.0)) == {} == signs_in_a_mirror(joints, (1.0, 1.0, 1.0))


class Carried(mbd.Prismatic):
    """A slider whose frame is carried along: its velocity would lack that of the frame."""

    def transform(self, q, scope):
        R, (x, y, z) = super().transform(q, scope)
        return R, (x + 0.1 * scope.time**2, y, z)


@pytest.mark.parametrize("child_first", [False, True])
def test_a_joint_of_ones_own_that_moves_by_itself_is_refused(child_first):
    model = mbd.Model("cart", gravity=(0.0, 0.0, 0.0))
    cart = mbd.PointMass("cart", 1.0)
    frames = [model.ground.origin, cart.origin]
    model.connect(Carried("rail", *(frames[::-1] if child_first else frames)))
    with pytest.raises(
        ModelError, match=r"'rail' \(Carried\): its transform or subspace follows the time; .*Bilateral"
    ):
        mbd.assemble(model)
