"""What people get wrong in their first hour: the errors, warnings and functions that answer it."""

import gc
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import mbd
from tests.helpers import one_body


def pendulum(**joint: Any) -> tuple[mbd.Model, mbd.Revolute]:
    """A rod on a pin."""
    model, rod = mbd.Model("pendulum"), mbd.Link("rod", length=1.0, **mbd.rod(1.0, length=1.0).link)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, **joint)
    model.connect(pin)
    return model, pin


def driven(law: Any) -> mbd.Trajectory:
    """The pendulum under a motor."""
    model, pin = pendulum()
    model.apply(mbd.Motor("drive", pin, law))
    return mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 0.1}), mbd.HHT(), dt=1e-2, until=0.5)


@pytest.mark.parametrize(
    ("of_numpy", "of_mbd"),
    [
        (lambda t: np.where(t > 0.2, 1.0, -1.0), lambda t: mbd.where(t > 0.2, 1.0, -1.0)),
        (lambda t: np.clip(9.0 * t, 0.5, 2.0), lambda t: mbd.minimum(mbd.maximum(9.0 * t, 0.5), 2.0)),
        (lambda t: np.hypot(t, 1.0), lambda t: mbd.sqrt(t * t + 1.0)),
        (lambda t: np.mod(t, 0.17), lambda t: t - 0.17 * mbd.floor(t / 0.17)),
        (lambda t: t % 0.17, lambda t: mbd.mod(t, 0.17)),
        (lambda t: np.sin(np.pi * t), lambda t: mbd.sin(mbd.pi * t)),
        (lambda t: mbd.clip(9.0 * t, 0.5, 2.0), lambda t: np.minimum(np.maximum(9.0 * t, 0.5), 2.0)),
    ],
)
def test_functions_of_numpy_are_those_of_mbd(of_numpy: Callable[[Any], Any], of_mbd: Callable[[Any], Any]) -> None:
    np.testing.assert_array_equal(driven(of_numpy)["pin.angle"], driven(of_mbd)["pin.angle"])


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (lambda t: [t], "one number is expected, a sequence of 1 came .* return the number itself"),
        (lambda t: np.interp(t, [0.0, 1.0], [0.0, 1.0]), r"numpy.interp .* write mbd.Samples\(time, values\)"),
        (lambda t: np.clip(t, 0.0, None, out=None), "numpy.clip of traced values is not recorded; write mbd.clip"),
    ],
)
def test_an_error_about_a_law_that_cannot_be_recorded_says_what_to_write(law: Any, said: str) -> None:
    with pytest.raises(mbd.TraceError, match=said):
        driven(law)


@pytest.mark.parametrize(("letter", "axis"), [("x", (1, 0, 0)), ("-y", (0, -1, 0)), ("z", (0, 0, 1))])
def test_an_axis_may_be_a_letter(letter: str, axis: tuple[int, int, int]) -> None:
    model, _ = pendulum()
    body = mbd.PointMass("body", mass=1.0)
    assert mbd.Prismatic("rail", model.ground.origin, body.origin, axis=letter) == mbd.Prismatic(
        "rail", model.ground.origin, body.origin, axis=axis
    )


def test_an_inertia_may_be_a_matrix() -> None:
    matrix = np.array([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]])
    assert mbd.RigidBody("body", mass=1.0, inertia=matrix).inertia == (2.0, 3.0, 4.0, 0.1, 0.2, 0.3)
    assert mbd.RigidBody("body", mass=1.0, inertia=np.diag([1.0, 2.0, 2.5])).inertia == (1.0, 2.0, 2.5)


def test_an_inertia_about_z_is_no_inertia_of_a_body_that_turns_about_x() -> None:
    model, body = mbd.Model("tilting"), mbd.RigidBody("body", mass=1.0, inertia=0.1)
    model.connect(mbd.Revolute("pin", model.ground.origin, body.point(0.0, 1.0), axis="x"))
    [fault] = model.check()
    assert fault == (
        "inertia of 'body' is one number, which is about z only, and 'pin' turns it out of the plane x–y; "
        "give (Ixx, Iyy, Izz)"
    )


def test_a_body_that_turns_about_z_on_a_lift_needs_one_number() -> None:
    model = mbd.Model("lift")
    cabin, fan = mbd.PointMass("cabin", mass=1.0), mbd.RigidBody("fan", mass=1.0, inertia=0.1)
    model.connect(
        mbd.Prismatic("lift", model.ground.origin, cabin.origin, axis="z"),
        mbd.Revolute("pin", cabin.origin, fan.origin),
    )
    assert model.check() == []


def test_several_turns_and_hinges_of_other_axes_are_not_doubted(recwarn: pytest.WarningsRecorder) -> None:
    model, _ = pendulum()
    mbd.assemble(model, position={"pin.angle": 6.0 * np.pi})
    assert not recwarn.list


# in space -----------------------------------------------------------------------------------------------------------
def ball_joint() -> mbd.Model:
    model = mbd.Model("ball joint")
    model.connect(mbd.Spherical("hip", model.ground.origin, mbd.RigidBody("leg", 1.0, (1.0, 2.0, 2.5)).origin))
    return model


def test_grams_of_a_person_and_percents_of_friction_are_doubted() -> None:
    with pytest.warns(mbd.MbdWarning, match="masses are in kg"):
        mbd.human(mass=70000.0, height=1.75)
    model, disk = one_body(mbd.RigidBody("disk", **mbd.disk(1.0, 0.1, axis="y").body), mbd.Free, "float")
    edge = mbd.disk_touchdown(disk.origin, 0.1, axis=(0, 1, 0))
    model.constrain(mbd.Unilateral("edge", edge, friction=30.0))
    with pytest.warns(mbd.MbdWarning, match="friction of 'edge' is 30"):
        start = mbd.assemble(model, {"float.y": 0.2})
    with pytest.raises(mbd.SimulationError, match="a disk that lies flat touches with all its edge"):
        mbd.simulate(model, start, dt=0.01, until=0.1)


@cache
def person():
    """A leg and a trunk: a state and a run of two rows."""
    leg = mbd.human(mass=70.0, height=1.75).without("left arm", "right arm", "torso")
    model = mbd.Model("legs")
    model.connect(*leg.joints)
    start = mbd.assemble(model, {**leg.standing(), "left hip.orientation": ("zxy", (0.4, 0.1, 0.0))}, backend="python")
    return model, start, mbd.simulate(model, start, dt=0.01, until=0.01, backend="python")


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("hip.flexion", "did you mean 'left hip.flexion' or 'right hip.flexion'"),
        ("left_hip.flexion", "did you mean 'left hip.flexion'"),
        ("left hip.angle", "did you mean 'left hip.flexion'"),
        ("left hip.abduction", "did you mean 'left hip.adduction'"),
        ("left hip.rotation", "did you mean 'left hip.orientation'"),
        ("left hip.angular_velocity.world", "did you mean 'left hip.angular_velocity.ground'"),
        ("trunk.position", "did you mean 'trunk' or 'trunk.x'"),
        ("pelvis.position", "did you mean 'pelvis.origin'"),
        ("pelvis.x", "did you mean 'pelvis.origin.x'"),
        ("left thigh.com", "did you mean 'left thigh.center'"),
        ("fre.position", "the run has 'gravity.…'.*'left thigh.…'"),
    ],
)
def test_wrong_names_in_space_are_answered_with_what_is_meant(wrong, right):
    _, _, run = person()
    with pytest.raises(mbd.UnknownNameError, match=right) as told:
        run[wrong]
    assert len(str(told.value)) < 600


def test_the_force_of_a_row_that_always_holds_is_its_multiplier():
    model, _ = pendulum()
    model.constrain(mbd.Bilateral("rail", mbd.measure(lambda angle: angle, "pin.angle")))
    run = mbd.simulate(model, mbd.assemble(model), dt=0.01, until=0.01, backend="python")
    for wrong, right in (
        ("rail.force", "rail.multiplier"),
        ("rail.gap", "rail.residual"),
        ("pin.force", "reaction_force"),
    ):
        with pytest.raises(mbd.UnknownNameError, match=f"did you mean '[a-z.]*{right}'"):
            run[wrong]


def test_a_state_knows_what_follows_from_places_and_velocities():
    _, start, run = person()
    for name in "left hip.flexion", "left foot.toe", "right knee.angle.rate", "trunk", "left hip.euler.zxy":
        np.testing.assert_array_equal(start[name], run[name][0])
    with pytest.raises(mbd.UnknownNameError, match="'left hip.reaction_force' follows from forces.*ask the run"):
        start["left hip.reaction_force"]
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'left hip.flexion' or 'right hip.flexion'"):
        start["hip.flexion"]
    made = replace(start)  # by hand, so that it knows no model
    with pytest.raises(mbd.UnknownNameError, match="no coordinate or rate named 'left hip.flexion'"):
        made["left hip.flexion"]


def test_a_state_of_cut_joints_has_their_angles():
    model = mbd.Model("pendulum", cut="all")
    model.connect(mbd.Revolute("hip", model.ground.origin, mbd.Link("leg", 1.0, 1.0, 0.5, 0.1).start))
    start = mbd.assemble(model, {"hip.angle": 0.3}, {"hip.rate": 2.0}, backend="python")
    assert (start["hip.angle"], start["hip.rate"]) == (pytest.approx(0.3), pytest.approx(2.0))


# what the first notebooks have ---------------------------------------------------------------------------------------
def damped(law: Any) -> mbd.Model:
    model, pin = pendulum()
    model.apply(mbd.Motor("drag", pin, law, arguments=("pin.rate",)))
    return model


@pytest.mark.parametrize(
    "law",
    [
        lambda v: -np.sign(v), lambda v: -0.3 * v - 2.0 * mbd.sign(v), lambda v: mbd.where(v > 0, -1.0, 1.0),
        lambda v: -mbd.sign(v) * (1.0 + v * v),
    ],
)  # fmt: skip
def test_friction_by_the_sign_of_a_velocity_is_doubted_when_it_is_built(law):
    with pytest.warns(mbd.MbdWarning, match=r"force of 'drag' jumps with the sign of a velocity.*mbd.Coulomb"):
        mbd.assemble(damped(law), backend="python")


@pytest.mark.parametrize(
    "law",
    [
        lambda v: -0.3 * v, lambda v: -mbd.tanh(v / 0.01), lambda v: -abs(v) * v, lambda v: -mbd.sign(v) * v**2,
        lambda v: mbd.where(v > 0, -2.0 * v, -v),
    ],
)  # fmt: skip
def test_losses_that_do_not_jump_are_not_doubted(law, recwarn):
    mbd.assemble(damped(law), backend="python")
    assert not recwarn.list


def kept_alone() -> mbd.State:
    """A start whose model is not kept."""
    model, _ = pendulum()
    return mbd.assemble(model, {"pin.angle": 0.1}, backend="python")


def test_a_state_whose_model_is_gone_says_so():
    start = kept_alone()
    gc.collect()
    with pytest.raises(
        mbd.UnknownNameError, match="no coordinate or rate named 'rod.end'.*the model was not kept; let"
    ):
        start["rod.end"]
    model, _ = pendulum()
    with pytest.raises(mbd.UnknownNameError, match="it was made by hand, copied or read from a file"):
        replace(mbd.assemble(model, backend="python"))["rod.end"]


def test_a_cell_that_was_run_twice_is_answered_with_the_cure():
    model, _ = pendulum()
    rod = mbd.Link("rod", length=1.0, **mbd.rod(1.0, length=1.0).link)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    cure = r"where the cell of a notebook was run twice, let it begin with model = mbd.Model"
    assert [bool(re.search(cure, fault)) for fault in model.check()] == [True, True]


def test_an_event_that_ends_a_run_is_no_success(tmp_path):
    model, _ = pendulum()
    model.constrain(mbd.Event("fall", mbd.measure(lambda a: a, "pin.angle"), terminal=True))
    run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": 0.1}, backend="python"), dt=0.01, until=2.0,
                       backend="python")  # fmt: skip
    assert "success" not in str(run) and re.search(r"outcome +ended by 'fall' at t = ", str(run))
    lines = run.to_csv(tmp_path / "run", ["pin.angle"]).read_text().splitlines()
    assert lines[0].split(",")[1] == "pin.angle" and len(lines) == 1 + len(run.time)


def rod_within_a_cone() -> mbd.Model:
    """A rod on a ball joint within a cone."""
    model, rod = mbd.Model("ball"), mbd.RigidBody("rod", mass=2.0, inertia=(0.1, 0.02, 0.1))
    hip = mbd.Spherical("hip", model.ground.origin, rod.point(0.0, 0.3))
    model.connect(hip)
    model.constrain(mbd.Unilateral("cone", mbd.cone(hip, 0.4)))
    return model


def test_a_ball_joint_is_asked_for_an_angle():
    model = rod_within_a_cone()
    with pytest.raises(mbd.UnknownNameError, match="'hip' turns freely and has 'hip.orientation', an axis"):
        mbd.assemble(model, position={"hip.angle": 0.3})
    start = mbd.assemble(model, position={"hip.orientation": ((0, 0, 1), 0.2)})
    run = mbd.simulate(model, start, dt=1e-3, until=0.01)
    with pytest.raises(mbd.UnknownNameError, match=r"did you mean 'hip.euler.zxy.1'"):
        run["hip.angle"]
    assert run["hip.euler.zxy.1"][0] == pytest.approx(0.2)
    assert "0 rad (cone.normal)" in run.summary()


def forearm(**muscle: Any) -> tuple[mbd.Model, mbd.Muscle]:
    """An arm that hangs from its elbow, and a muscle of 600 N on it."""
    model, arm = one_body(mbd.Link("forearm", mass=1.5, length=0.35, center=0.16, inertia=0.016), mbd.Revolute, "elbow")
    points = (model.ground.point(0.02, 0.30), arm.point(0.03, -0.04))
    biceps = mbd.Muscle("biceps", points, max_force=600.0, excitation=0.3, **muscle)
    model.apply(biceps)
    return model, biceps


def test_a_muscle_that_begins_slack_is_told() -> None:
    """Left to itself it begins at its optimal length, with a tendon shorter than slack, whose curve then pushes."""
    model, biceps = forearm(fiber_length=0.14, tendon_length=0.2)
    start = mbd.assemble(model, position={"elbow.angle": 0.3})
    run = mbd.simulate(model, start, dt=1e-3, until=0.05)
    [note] = run.stats["notes"]
    assert run["biceps.force"][0] == pytest.approx(-101.0, abs=1.0)
    assert "'biceps' begins out of equilibrium and pushes with 101 N" in note
    fibers = biceps.fiber_at(start["biceps.length"], activation=0.3)
    start = mbd.assemble(model, position={"elbow.angle": 0.3, "biceps.fiber_length": fibers})
    assert not mbd.simulate(model, start, dt=1e-3, until=0.05).stats["notes"]


@pytest.mark.parametrize("tendon", ["elastic", "rigid"])
def test_a_muscle_in_centimetres_puts_its_run_in_doubt(tendon: str) -> None:
    model, _ = forearm(fiber_length=14.0, tendon_length=20.0, tendon=tendon)
    start = mbd.assemble(model, position={"elbow.angle": 0.3})
    with pytest.warns(mbd.MbdWarning, match=r"path is 0.33 m long and its tendon alone 20 m; lengths are in metres"):
        mbd.simulate(model, start, dt=1e-3, until=0.01)


@pytest.mark.parametrize(("tendon", "curves"), [("elastic", "de groote"), ("rigid", "de groote"), ("rigid", "millard")])
def test_a_muscle_whose_path_becomes_shorter_than_its_tendon_puts_its_run_in_doubt(tendon: str, curves: str) -> None:
    """Where a slack tendon pushes, or fibers of a rigid one have a length below zero."""
    model, _ = forearm(fiber_length=0.06, tendon_length=0.27, tendon=tendon, curves=curves)
    start = mbd.assemble(model, {"elbow.angle": 0.3}, {"elbow.rate": 20.0})
    with pytest.warns(mbd.MbdWarning, match=r"'biceps' pushes at t = 0\.\d+ s: its path is 0\.\d+ m long and its"):
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.25)
    assert run["biceps.length"][0] > 0.27 > run["biceps.length"].min()


# units and orders that other programs have --------------------------------------------------------------------------
def runner(stiffness: float) -> mbd.Model:
    """A point mass of 80 kg on a spring leg."""
    model, body = one_body(mbd.PointMass("body", mass=80.0), mbd.Translation, "place", title="runner")
    model.constrain(
        mbd.SpringLeg("leg", body.origin, stiffness, 1.0, np.radians(68.0)),
        mbd.Event("apex", mbd.measure("place.y.rate"), direction=-1),
    )
    return model


def test_a_leg_in_kilonewtons_per_metre_is_doubted(recwarn: pytest.WarningsRecorder) -> None:
    assert runner(20e3).check() == [] and not recwarn.list
    with pytest.warns(mbd.MbdWarning, match=r"'leg' of 20 N/m .* at most, the model weighs 785 N; .* 20 kN/m is 20000"):
        runner(20.0).check()


def test_a_drive_in_degrees_is_doubted(recwarn: pytest.WarningsRecorder) -> None:
    time = np.linspace(0.0, 1.0, 21)
    degrees, turning = 50.0 * np.sin(2.0 * np.pi * time), 30.0 * time
    for values, doubted in ((degrees, True), (np.radians(degrees), False), (turning, False)):
        model, pin = pendulum()
        model.constrain(mbd.Bilateral("drive", pin, mbd.Samples(time, values)))
        model.check()
        told = [str(each.message) for each in recwarn.list]
        assert [
            bool(re.search("'drive' swings an angle to and fro by 100 rad.*numpy.radians", text)) for text in told
        ] == ([True] if doubted else [])
        recwarn.clear()


def test_a_scalar_at_the_end_of_a_quaternion_is_doubted(recwarn: pytest.WarningsRecorder) -> None:
    for first in ((1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.8), ((0, 0, 1), np.pi)):
        mbd.assemble(ball_joint(), {"hip.orientation": first})
    assert not recwarn.list
    with pytest.warns(mbd.MbdWarning, match=r"turns by 180°.*scalar first.*give \(1, 0, 0, 0\)"):
        mbd.assemble(ball_joint(), {"hip.orientation": (0.0, 0.0, 0.0, 1.0)})
    with pytest.warns(mbd.MbdWarning, match=r"turns by 180°.*give \(0.995, 0, 0.09983, 0\)"):
        mbd.assemble(ball_joint(), {"hip.orientation": np.array([0.0, np.sin(0.1), 0.0, np.cos(0.1)])})


@pytest.mark.parametrize("energy", [1.785, 100.0])  # in kJ, and below m g l sin α = 727 J, without which no leg fits
def test_an_energy_without_a_gait_is_named_with_those_that_there_are(energy: float) -> None:
    model = runner(20e3)
    start = mbd.assemble(model, {"place.y": 1.0}, {"place.x": 5.0, "place.y": 0.0})
    said = rf"energy={energy:g} J: the start has T \+ V = 1785 J just after 'apex', and [78]\d\d\.?\d* J is the nearest"
    with pytest.raises(mbd.GaitError, match=said):
        mbd.limit_cycle(model, start, section="apex", energy=energy)


@pytest.mark.parametrize(
    ("loss", "said"),
    [
        (mbd.Viscous(0.1), "'knee loss.coefficient'"),
        (mbd.Coulomb(0.1), "'knee loss.torque'"),
        (mbd.Viscous(0.1) + mbd.Coulomb(0.1), "'knee loss.viscous.coefficient' or 'knee loss.coulomb.torque'"),
    ],
)
def test_the_number_of_a_loss_is_found(loss: Any, said: str) -> None:
    model, rod = mbd.Model("leg"), mbd.Link("rod", length=1.0, **mbd.rod(1.0, length=1.0).link)
    model.connect(mbd.Revolute("knee", model.ground.origin, rod.start, loss=loss))
    for wrong in ("knee.loss", "knee.damping"):
        with pytest.raises(mbd.UnknownNameError, match=f"did you mean {said}"):
            mbd.assemble(model, parameters={wrong: 0.3})


URDF = """<robot name="leg"><link name="base"/><link name="shank"/><joint name="knee" type="revolute">
<parent link="base"/><child link="shank"/><axis xyz="0 1 0"/><limit lower="{}" upper="{}"/></joint></robot>"""


def test_limits_of_a_robot_in_degrees_are_doubted(tmp_path, recwarn: pytest.WarningsRecorder) -> None:
    file = tmp_path / "leg.urdf"
    for limits in ((0.0, 2.27), (-6.2832, 6.2832), (-1e16, 1e16)):
        file.write_text(URDF.format(*limits))
        mbd.read_model(file)
    assert not recwarn.list
    file.write_text(URDF.format(0, 130))
    with pytest.warns(mbd.MbdWarning, match=r"leg.urdf: a limit of 'knee' is 130 rad, 20.7 turns; .* 130° is 2.269"):
        mbd.read_model(file)


# tables -------------------------------------------------------------------------------------------------------------
PERSON = mbd.human(mass=70.0, height=1.75, passive=True)


def at_rest(model: mbd.Model) -> mbd.State:
    return mbd.assemble(model, position={"pin.angle": 0.1}, backend="python")


def run_of(model: mbd.Model) -> mbd.Trajectory:
    return mbd.simulate(model, at_rest(model), dt=1e-2, until=0.1, backend="python")


def sweep(model: mbd.Model, *more: Any) -> Any:
    return mbd.sweep(model, {"rod.mass": [1.0]}, at_rest(model), *more, dt=1e-3, until=0.1)


def stopped(model: mbd.Model, pin: mbd.Revolute) -> mbd.State:
    model.constrain(mbd.Unilateral("stop", mbd.flexion(pin)))
    return mbd.assemble(model, {"pin.angle": 0.3}, backend="python")


WRONG, UNKNOWN, NO_FILE = mbd.ModelError, mbd.UnknownNameError, mbd.TrajectoryError
ANSWERS: list[tuple[Callable[..., Any], Any, str]] = [
    # words
    (lambda m, p: pendulum(axis="w"), WRONG,
     r"axis of 'pin' must be a direction such as \(0, 0, 1\), or 'x', .* got 'w'"),
    (lambda m, p: mbd.RigidBody("body", 1.0, [[1.0, 0.2, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]), WRONG,
     "inertia of 'body'.*the matrix is not symmetric"),
    (lambda m, p: mbd.RigidBody("body", 1.0, [[1.0, 0.0], [0.0, 1.0]]), WRONG,
     "inertia of 'body'.*a matrix of 3 rows of 3 numbers is expected, got rows of 2 and 2"),
    *((make, WRONG, "must not be negative, got -") for make in (
        lambda m, p: mbd.box(1.0, (1, -1, 1)), lambda m, p: mbd.sphere(1.0, -0.1), lambda m, p: mbd.sphere(-1.0, 0.1),
        lambda m, p: mbd.cylinder(1.0, 0.1, -0.2), lambda m, p: mbd.disk(1.0, -0.1), lambda m, p: mbd.rod(1.0, -1.0),
    )),
    (lambda m, p: PERSON.standing(knees=20.0), WRONG, "between 0 and π rad"),
    (lambda m, p: PERSON.standing(knees=-0.3), WRONG, "between 0 and π rad"),
    (lambda m, p: pendulum(loss=0.3), WRONG, r"got 0\.3; viscous damping is mbd\.Viscous\(0\.3\)"),
    (lambda m, p: pendulum(loss=mbd.Viscous), WRONG, r"give the class its numbers: mbd\.Viscous\(…\)"),
    (lambda m, p: pendulum(loss=[mbd.Viscous(0.1), mbd.Quadratic(0.2)]), WRONG, r"are a sum, one \+ other"),
    *((lambda m, p, mass=mass: mbd.Link("rod", mass=mass, length=1.0, center=0.5), WRONG,
       r"mass of 'rod' must be a number, got .*; give the number itself, 1$")
      for mass in ("1.0", [1.0], np.array([1.0]))),
    (lambda m, p: mbd.Revolute("pin", m.ground.origin, p.child.body), WRONG,
     r"its child must be a frame .*; its frames are \.origin, \.start, \.end"),
    (lambda m, p: mbd.Revolute("a", m.ground.origin, None, damping=0.3), TypeError, "did you mean 'loss'"),
    (lambda m, p: mbd.Rolling("grip", m.ground.origin, 0.1, ground=lambda x: x), (TypeError, WRONG),
     "mbd.sphere_touchdown"),
    (lambda m, p: mbd.Model("x", gravity=9.81), WRONG, r"vector \[m/s²\], such as \(0.0, -9.81, 0.0\)"),
    (lambda m, p: mbd.cone(p, 50), WRONG, "50° is 0.873 rad"),
    # models
    (lambda m, p: m.connect(PERSON), WRONG, r"connect\(\*person\.joints\) and apply\(\*person\.moments\)"),
    (lambda m, p: m.connect(PERSON.joints), WRONG, r"put a \* before the list: \(\*joints\)"),
    (lambda m, p: m.connect(PERSON.bodies["pelvis"]), WRONG, "bodies come with the joints"),
    (lambda m, p: m.apply(PERSON), WRONG, r"apply\(\*person\.moments\) where it is passive"),
    (lambda m, p: mbd.assemble(PERSON), WRONG, r"model\.connect\(\*person\.joints\)"),
    (lambda m, p: m.copy(), AttributeError, r"model.without\(\) is a copy"),
    (lambda m, p: m.add_joint(1), AttributeError, "model.connect"),
    # starts and runs
    (stopped, mbd.AssemblyError, "'stop' starts 0.3 rad beyond its stop; turn the joint the other way"),
    (lambda m, p: mbd.assemble(ball_joint(), velocity={"hip.angular_velocity": 3.0}), UNKNOWN, "is three numbers"),
    (lambda m, p: mbd.assemble(ball_joint(), velocity={"hip.angular_velocity.world": (1, 2, 3)}), UNKNOWN,
     "'hip.angular_velocity.ground' of the ground"),
    (lambda m, p: mbd.simulate(m, at_rest(m)), TypeError,
     r"needs .until., the end time .*simulate\(model, .*until, …\)"),
    (lambda m, p: mbd.simulate(m, until=1.0), TypeError, r"needs 'start', a state such as mbd.assemble"),
    (lambda m, p: mbd.simulate(m, at_rest(m), step=1e-3, until=1.0), TypeError,
     "no argument 'step'; did you mean 'dt'"),
    (lambda m, p: mbd.simulate(m, at_rest(m), dt=1e-3, t_end=1.0), TypeError,
     "no argument 't_end'; did you mean 'until'"),
    (lambda m, p: mbd.simulate(m, at_rest(m), dt=1e-3, until=1.0, method="RK45"), TypeError,
     "did you mean 'integrator'"),
    (lambda m, p: mbd.simulate(at_rest(m), m, dt=0.01, until=0.1), WRONG, "the model comes first, then the start"),
    (lambda m, p: mbd.simulate(m, at_rest(m), mbd.HHT, dt=0.01, until=0.1), WRONG, r"call it: mbd\.HHT\(\)"),
    (lambda m, p: mbd.simulate(m, at_rest(m), dt=0.01, until="0.1"), UNKNOWN, r"a time is a number, until=0\.1"),
    (lambda m, p: sweep(m, [], mbd.HHT()), TypeError, "sweep takes 4 arguments without a keyword, 5 came"),
    (lambda m, p: sweep(m, mbd.HHT()), WRONG, "results must be a list .* not HHT.*; give a scheme as integrator=…"),
    # results
    (lambda m, p: run_of(m)["pin"], UNKNOWN, r"no result named 'pin'; it has 'pin.acceleration', 'pin.angle'"),
    (lambda m, p: run_of(m)["rod.end.X"], UNKNOWN, r"did you mean 'rod.end.x'\? The run has 'rod.end.vx'"),
    (lambda m, p: run_of(m)["Rod.end.x"], UNKNOWN, r"did you mean 'rod.end.x'\?"),
    (lambda m, p: run_of(m).pin, AttributeError, r"such as run\['pin.angle'\]"),
    (lambda m, p: run_of(m).q, AttributeError, r"such as run\['pin\.angle'\]"),
    (lambda m, p: run_of(m).save("run.csv"), NO_FILE, r"ends in \.mbd\.npz .*; for that: run\.to_csv\(path\)"),
    (lambda m, p: run_of(m).to_csv("run.xlsx"), NO_FILE, r"ends in \.csv .*to_excel"),
]  # fmt: skip


@pytest.mark.parametrize(("act", "kind", "said"), ANSWERS, ids=[said for *_, said in ANSWERS])
def test_a_mistake_is_answered_by_what_was_meant(act, kind, said) -> None:
    with pytest.raises(kind, match=said):
        act(*pendulum())


def long_shank() -> mbd.State:
    model, shank = mbd.Model("leg"), mbd.Link("shank", length=420.0, **mbd.rod(3.0, length=420.0).link)
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    return mbd.assemble(model)


def controlled(model: mbd.Model, pin: mbd.Revolute, law: Any) -> mbd.State:
    model.apply(mbd.Motor("drive", pin, 0.0), law)
    return mbd.assemble(model)


def with_word(add: Callable[..., Any]) -> Callable[..., Any]:
    """Assemble the pendulum with one word more."""
    return lambda model, pin: (add(model, pin), mbd.assemble(model, {"pin.angle": -0.1}))


def upwards(model: mbd.Model, pin: mbd.Revolute) -> None:
    model.gravity = (0.0, 9.81, 0.0)
    model.check()


FALLEN = {"drive.torque": lambda q: -q}
DOUBTS: list[tuple[Callable[..., Any], str]] = [
    (lambda m, p: mbd.assemble(m, position={"pin.angle": 90}),
     r"'pin.angle' is 90 rad, 14.3 turns; .* math.radians\(90\) = 1.571"),
    (lambda m, p: long_shank(), "'shank' is 420 m long; lengths are in metres, and 420 mm is 0.42"),
    (with_word(lambda m, p: m.connect(mbd.Revolute("again", p.parent, p.child))),
     "'pin' and 'again' hold the same points together"),
    (lambda m, p: controlled(m, p, mbd.Controller("PD", lambda *_: {}, period=100, writes=("drive.torque",))),
     "'PD' samples once in 100 s; .* 100 Hz is period=0.01"),
    (lambda m, p: controlled(m, p, mbd.SampledLaw("PD", 100, FALLEN, arguments=("pin.angle",))),
     "'PD' samples once in 100 s; .* 100 Hz is period=0.01"),
    (lambda m, p: controlled(m, p, mbd.SampledLaw("law", 0.01, FALLEN, ["pin.angle"], delay=3.0)),
     r"'law' puts its outputs out 3 s after .* 3 ms is 0.003"),
    (upwards, r"pulls upwards; .* gravity=\(0.0, -9.81, 0.0\)"),
    (lambda m, p: mbd.on_slope(3.0), r"3 rad is beyond the vertical; .* math.radians\(3\) = 0.05236"),
    (with_word(lambda m, p: m.apply(mbd.TorsionSpring("spring", p, 1.0, rest=90.0))), "rest of 'spring' is 90 rad"),
    (lambda m, p: (m.constrain(mbd.Bilateral("hold", p, -60.0)), mbd.assemble(m)), "value of 'hold' is -60 rad"),
    (with_word(lambda m, p: m.constrain(mbd.Unilateral("stop", mbd.flexion(p, -90)))), "offset of 'stop' is -90 rad"),
    (with_word(lambda m, p: m.apply(
        mbd.Spring("tendon", m.ground.point(1.0, 0.0), p.child.body.end, 1.0, length=900.0))),
     "'tendon' is 900 m long unstretched; lengths are in metres, and 900 mm is 0.9"),
    (lambda m, p: mbd.assemble(pendulum(stiffness=1.0, rest=45.0)[0]),
     r"rest of 'pin' is 45 rad, 7\.2 turns; .* math\.radians\(45\) = 0\.7854"),
]  # fmt: skip


@pytest.mark.parametrize(("act", "said"), DOUBTS, ids=[said for _, said in DOUBTS])
def test_what_was_hardly_meant_is_doubted(act, said) -> None:
    with pytest.warns(mbd.MbdWarning, match=said):
        act(*pendulum())
