"""Force plates: the forces of contacts as a plate measures them give the same moments, and runs feel them."""

import numpy as np
import pytest

import mbd


def hopper():
    model = mbd.Model("hopper")
    trunk = mbd.RigidBody("trunk", mass=10.0, inertia=(0.3, 0.3, 0.4))
    leg = mbd.Link("leg", mass=2.0, length=0.8, center=0.4, inertia=0.1)
    model.connect(
        mbd.Planar("base", model.ground.origin, trunk.origin),
        hip := mbd.Revolute("hip", trunk.origin, leg.start, loss=mbd.Viscous(0.2)),
    )
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(leg.end), friction=0.8))
    model.apply(mbd.Motor("servo", hip, torque=lambda t: 6.0 * mbd.sin(9.0 * t), arguments=("t",)))
    return model, leg


def measured(model):
    """A stance of the hopper: its motion with exact rates, and what a plate under it measures."""
    start = mbd.assemble(model, position={"base.y": 0.796, "hip.angle": 0.1}, closed=["foot"])
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-9, until=0.12)
    time = np.linspace(0.0, 0.1, 51)
    seen = run.at(time)
    motion = {"time": time}
    for name in ("base.x", "base.y", "base.angle", "hip.angle"):
        motion |= {name: seen[name], f"{name}.rate": seen[f"{name}.rate"]}
        motion[f"{name}.acceleration"] = seen[f"{name}.acceleration"]
    force = np.column_stack([seen["foot.friction"], seen["foot.force"], 0.0 * time])
    plate = mbd.PlateRecord.at("plate 1", time, force, seen["leg.end"] * [1.0, 0.0, 1.0], height=0.0)
    return seen, motion, mbd.Recording(time, plates=(plate,))


def test_a_plate_gives_the_moments_that_the_contact_gives():
    model, leg = hopper()
    seen, motion, recording = measured(model)
    passive = model.without("servo")
    plate = mbd.ForcePlate("plate", leg.end, recording)
    found = mbd.inverse_dynamics(passive, motion, plates=[plate])
    assert found["hip.moment"] == pytest.approx(seen["servo.torque"], abs=1e-6)
    assert np.abs(found["base.residual_force"]).max() < 1e-5
    assert np.abs(found["base.residual_moment"]).max() < 1e-5
    assert found["hip.net_moment"] == pytest.approx(found["hip.moment"] - 0.2 * motion["hip.angle.rate"], abs=1e-9)
    assert found["hip.reaction_force"] == pytest.approx(seen["hip.reaction_force"], abs=1e-5)
    without = mbd.inverse_dynamics(passive, motion)
    assert without["base.residual_force"][:, 1] == pytest.approx(recording["plate 1.force"][:, 1], abs=1e-5)


def test_a_plate_of_the_model_is_the_same_as_one_given():
    model, leg = hopper()
    _, motion, recording = measured(model)
    passive = model.without("servo", "foot")
    plate = mbd.ForcePlate("plate", leg.end, recording)
    given = mbd.inverse_dynamics(passive, motion, plates=[plate])
    passive.apply(plate)
    own = mbd.inverse_dynamics(passive, motion)
    assert own["hip.moment"] == pytest.approx(given["hip.moment"], abs=1e-9)
    assert own["plate.force"] == pytest.approx(given["plate.force"], abs=1e-9)


def test_a_run_feels_what_the_plate_measured():
    """m ÿ = A sin ωt, I φ̈ = (mg + A sin ωt) d of a body that is pushed beside its center."""
    mass, inertia, A, w, d, g = 10.0, 0.4, 30.0, 7.0, 0.02, 9.81
    model = mbd.Model("block")
    body = mbd.RigidBody("block", mass=mass, inertia=inertia)
    model.connect(mbd.Planar("base", model.ground.origin, body.origin))
    time = np.arange(0.0, 0.5005, 0.0005)
    push = mass * g + A * np.sin(w * time)
    center = np.column_stack([np.full_like(time, d), 0.0 * time, 0.0 * time])
    plate = mbd.PlateRecord.at("plate 1", time, np.column_stack([0.0 * time, push, 0.0 * time]), center, height=0.0)
    model.apply(mbd.ForcePlate("plate", body.point(0.1, -0.2), plate))
    run = mbd.simulate(model, mbd.assemble(model), tol=1e-8, until=0.5)
    t = run.time
    assert run["base.y"] == pytest.approx(A / mass * (t / w - np.sin(w * t) / w**2), abs=1e-6)
    turn = d / inertia * (0.5 * mass * g * t**2 + A * (t / w - np.sin(w * t) / w**2))
    assert run["base.angle"] == pytest.approx(turn, abs=1e-6)


def test_a_plate_is_silent_outside_its_spans_and_below_its_threshold():
    time = np.linspace(0.0, 1.0, 101)
    push = np.where((time > 0.2) & (time < 0.8), 100.0, 5.0)
    plate = mbd.PlateRecord.at("plate 1", time, np.column_stack([0 * time, push, 0 * time]), np.zeros((101, 3)))
    body = mbd.RigidBody("block", mass=1.0, inertia=0.1)
    whole = mbd.ForcePlate("plate", body.origin, plate)
    assert set(np.unique(whole.wrench[:, 1])) == {0.0, 100.0}
    part = mbd.ForcePlate("plate", body.origin, plate, during=[(0.295, 0.405), (0.595, 0.705)])
    acts = part.wrench[:, 1] > 0.0
    assert acts.sum() == 22 and not acts[50]


def steps():
    """Two feet that stand one after the other on two plates."""
    model = mbd.Model("steps")
    feet = [mbd.RigidBody(f"{side} foot", mass=1.0, inertia=(0.01, 0.01, 0.01)) for side in ("left", "right")]
    model.connect(*(mbd.Free(foot.name.split()[0], model.ground.origin, foot.origin) for foot in feet))
    time = np.linspace(0.0, 1.0, 101)
    motion = {"time": time}
    for side, x, z in (("left", 0.1, -0.1), ("right", 0.7, 0.1)):
        motion |= {f"{side}.x": x + 0 * time, f"{side}.y": 0.05 + 0 * time, f"{side}.z": z + 0 * time}
        motion[f"{side}.orientation"] = np.tile([1.0, 0.0, 0.0, 0.0], (101, 1))

    def plate(name, x, z, first, last):
        push = np.where((time >= first) & (time <= last), 500.0, 0.0)
        force, center = np.column_stack([0 * time, push, 0 * time]), np.tile([x, 0.0, z], (101, 1))
        return mbd.PlateRecord.at(name, time, force, center)

    return model, feet, motion, time, plate


def test_plates_find_their_feet():
    model, feet, motion, time, plate = steps()
    recording = mbd.Recording(
        time, plates=(plate("plate 1", 0.72, 0.08, 0.5, 0.9), plate("plate 2", 0.12, -0.12, 0.1, 0.5))
    )
    moved = mbd.inverse_dynamics(model, motion).run
    found = mbd.assign_plates(moved, recording, [foot.origin for foot in feet])
    assert [(each.name, each.foot.body.name) for each in found] == [
        ("plate 1 right foot", "right foot"), ("plate 2 left foot", "left foot"),
    ]  # fmt: skip
    loaded = mbd.inverse_dynamics(model, motion, plates=found)
    assert loaded["right.residual_force"][70, 1] == pytest.approx(9.81 - 500.0)
    assert loaded["left.residual_force"][70, 1] == pytest.approx(9.81)


def test_a_plate_that_no_foot_stands_on_is_doubted():
    model, feet, motion, time, plate = steps()
    recording = mbd.Recording(time, plates=(plate("plate 1", 3.0, 0.0, 0.1, 0.5),))
    moved = mbd.inverse_dynamics(model, motion).run
    with pytest.warns(mbd.MbdWarning, match="plate 1 from 0.1 to 0.5 s: no foot is nearer"):
        assert mbd.assign_plates(moved, recording, [foot.origin for foot in feet]) == ()


def test_plates_that_are_never_loaded_and_gaps_of_plates_are_told(recwarn):
    """Forces in kilonewtons load no plate; a plate without values is not one without a load."""
    model, feet, motion, time, plate = steps()
    right, left = plate("plate 1", 0.72, 0.08, 0.5, 0.9), plate("plate 2", 0.12, -0.12, 0.1, 0.5)
    moved = mbd.inverse_dynamics(model, motion).run
    # one of several plates that nobody walked on is no fault
    idle = mbd.PlateRecord("plate 3", time, 0.0 * left.force, 0.0 * left.moment)
    assert len(mbd.assign_plates(moved, mbd.Recording(time, plates=(right, left, idle)), feet)) == 2
    assert not recwarn.list
    small = [mbd.PlateRecord(each.name, time, each.force / 1e3, each.moment / 1e3) for each in (right, left)]
    with pytest.warns(mbd.MbdWarning, match=r"no plate is loaded; forces are in newtons|plate . is never loaded"):
        assert mbd.assign_plates(moved, mbd.Recording(time, plates=tuple(small)), feet) == ()
    force = right.force.copy()
    force[-12:] = np.nan
    broken = mbd.PlateRecord("plate 1", time, force, right.moment)
    with pytest.warns(mbd.MbdWarning, match="plate 1 has no values in 12 of 101 samples, the first at 0.89 s"):
        mbd.assign_plates(moved, mbd.Recording(time, plates=(broken, left)), feet)
    assert len(repr(right)) < 100 and "101 samples from 0 to 1 s" in repr(right)


@pytest.mark.parametrize("way", [0.2, 0.0])
def test_two_feet_on_one_plate_are_doubted(way):
    """The center of pressure goes from one to the other, or rests midway between them."""
    model, feet, motion, time, plate = steps()
    there = plate("plate 1", 0.4, 0.0, 0.1, 0.9)
    moved = mbd.inverse_dynamics(model, motion).run
    middle = np.mean([moved[f"{foot.name}.origin"].mean(axis=0) for foot in feet], axis=0)
    along = np.linspace(-1.0, 1.0, 101)
    moving = np.column_stack([middle[0] + way * along, 0 * time, middle[2] + 0.5 * way * along])
    there = mbd.PlateRecord.at("plate 1", time, there.force, moving)
    with pytest.warns(mbd.MbdWarning, match="two feet on one plate"):
        mbd.assign_plates(moved, mbd.Recording(time, plates=(there,)), [foot.origin for foot in feet])


def test_what_does_not_fit_is_named():
    model, leg = hopper()
    _, motion, recording = measured(model)
    with pytest.raises(mbd.ModelError, match="the recording has 'plate 1', counted from 1"):
        mbd.ForcePlate("plate", leg.end, recording, plate=2)
    with pytest.raises(mbd.ModelError, match="needs a recording"):
        mbd.ForcePlate("plate", leg.end, 3)
    with pytest.raises(mbd.ModelError, match="two forces called 'plate'"):
        mbd.inverse_dynamics(model, motion, plates=[mbd.ForcePlate("plate", leg.end, recording)] * 2)
    with pytest.raises(mbd.ModelError, match="plates must be several"):
        mbd.inverse_dynamics(model, motion, plates=[3])
    late = {**motion, "time": motion["time"] + 0.5}
    with pytest.raises(mbd.ModelError, match="measured from 0 to 0.1 s"):
        mbd.inverse_dynamics(model, late, plates=[mbd.ForcePlate("plate", leg.end, recording)])
