"""Inverse dynamics: moments that closed forms, an independent Newton–Euler, drives and forward runs agree with."""

import math
import time
import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import mbd
from mbd.laboratory.splines import derivatives
from tests.helpers import one_body
from tests.laboratory.newton_euler import inertia_of, inverse, rotation


def person(**how):
    body = mbd.human(75.0, 1.8, **how)
    model = mbd.Model("person")
    model.connect(*body.joints)
    return body, model


def random_motion(joints, rng, count):
    """All coordinates with their rates and accelerations, at frames that have nothing to do with each other."""
    motion, states = {"time": np.arange(float(count))}, [({}, {}, {}) for _ in range(count)]
    for joint in joints:
        n_v = len(joint.freedoms)
        q = rng.normal(size=(count, len(joint.labels)))
        v, a = rng.normal(size=(count, n_v)), rng.normal(size=(count, n_v))
        if not joint.is_vector:
            q[:, joint.adding :] /= np.linalg.norm(q[:, joint.adding :], axis=1)[:, None]
        for k in range(count):
            for state, values in zip(states[k], (q[k], v[k], a[k]), strict=True):
                state[joint.name] = values
        names = zip(joint.coordinate_names, q.T, strict=True)
        motion |= dict(names)
        for name, speed, change in zip(joint.velocity_names, v.T, a.T, strict=True):
            motion[name] = speed
            motion[f"{name.removesuffix('.rate')}.acceleration"] = change
    return motion, states


def test_a_double_pendulum_needs_the_moments_of_its_closed_form():
    """Equations of relative angles, e.g. Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, section 6.4."""
    m1, m2, l1, c1, c2, i1, i2, g = 1.3, 0.7, 0.5, 0.2, 0.3, 0.02, 0.05, 9.81
    model = mbd.Model("arm", gravity=(0.0, -g, 0.0))
    upper = mbd.Link("upper", mass=m1, length=l1, center=c1, inertia=i1)
    lower = mbd.Link("lower", mass=m2, length=0.6, center=c2, inertia=i2)
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
    )
    rng = np.random.default_rng(1)
    q, v, a = rng.normal(size=(3, 2, 50))
    names = ("shoulder.angle", "elbow.angle")
    motion = {"time": np.arange(50.0)} | dict(zip(names, q, strict=True))
    motion |= {f"{name}.rate": x for name, x in zip(names, v, strict=True)}
    motion |= {f"{name}.acceleration": x for name, x in zip(names, a, strict=True)}
    found = mbd.inverse_dynamics(model, motion)
    k = m2 * l1 * c2
    M11 = i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2) + 2 * k * np.cos(q[1])
    M12 = i2 + m2 * c2**2 + k * np.cos(q[1])
    h = -k * np.sin(q[1])
    low = m2 * c2 * g * np.sin(q[0] + q[1])
    shoulder = (
        M11 * a[0] + M12 * a[1] + h * (2 * v[0] * v[1] + v[1] ** 2) + (m1 * c1 + m2 * l1) * g * np.sin(q[0]) + low
    )
    elbow = M12 * a[0] + (i2 + m2 * c2**2) * a[1] - h * v[0] ** 2 + low
    assert found["shoulder.moment"] == pytest.approx(shoulder, abs=1e-10)
    assert found["elbow.moment"] == pytest.approx(elbow, abs=1e-10)
    assert found["elbow.power"] == pytest.approx(elbow * v[1], abs=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_a_person_needs_the_moments_of_an_independent_newton_euler(seed):
    body, model = person()
    rng = np.random.default_rng(seed)
    motion, states = random_motion(body.joints, rng, 4)
    found = mbd.inverse_dynamics(model, motion)
    masses = {each.name: inertia_of(each) for each in body.bodies.values()}
    for k, state in enumerate(states):
        expected = inverse(body.joints, masses, np.array([0.0, -9.81, 0.0]), *state)
        for joint in body.joints[1:]:
            names = [name for name in found._own if name.startswith(f"{joint.name}.") and ".moment" in name]
            own = np.array([found._own[name][k] for name in names])[: len(joint.freedoms)]
            assert own == pytest.approx(expected[joint.name], abs=1e-10 * max(1.0, np.abs(expected[joint.name]).max()))
        base = expected["trunk"]
        size = np.abs(base).max()
        assert found["trunk.residual_force"][k] == pytest.approx(base[:3], abs=1e-10 * size)
        R = rotation(state[0]["trunk"][3:])
        assert found["trunk.residual_moment"][k] == pytest.approx(R @ base[3:], abs=1e-10 * size)


def test_a_free_motion_needs_no_moment_and_has_no_residual():
    body, model = person()
    rng = np.random.default_rng(3)
    rest = mbd.assemble(model, position=body.standing(0.3))
    velocity = {name: rng.normal() for name in rest.velocity_names}
    start = mbd.assemble(model, position=body.standing(0.3), velocity=velocity)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-8, until=0.2)
    found = mbd.inverse_dynamics(model, run)
    assert max(np.abs(found._own[name]).max() for name in found._own) < 1e-9


def walker():
    """A leg that stands on a foot, hinged to a trunk that floats in the plane, with a passive knee stop."""
    model = mbd.Model("hopper")
    trunk = mbd.RigidBody("trunk", mass=10.0, inertia=(0.3, 0.3, 0.4))
    leg = mbd.Link("leg", mass=2.0, length=0.8, center=0.4, inertia=0.1)
    model.connect(
        mbd.Planar("base", model.ground.origin, trunk.origin),
        hip := mbd.Revolute("hip", trunk.origin, leg.start, loss=mbd.Viscous(0.2)),
    )
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(leg.end), friction=0.8))
    return model, hip


def test_the_contact_forces_of_a_run_leave_the_torque_of_its_motor():
    model, hip = walker()
    model.apply(mbd.Motor("servo", hip, torque=lambda t: 6.0 * mbd.sin(9.0 * t), arguments=("t",)))
    start = mbd.assemble(model, position={"base.y": 0.9, "hip.angle": 0.1, "base.angle": 0.0}, velocity={"base.x": 0.2})
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-8, until=0.6)
    assert any(event.kind == "closed" for event in run.events)
    found = mbd.inverse_dynamics(model.without("servo"), run)
    assert found["hip.moment"] == pytest.approx(run["servo.torque"], abs=1e-8)
    assert np.abs(found["base.residual_force"]).max() < 1e-7
    assert np.abs(found["base.residual_moment"]).max() < 1e-7
    net = run["servo.torque"] - 0.2 * run["hip.rate"]
    assert found["hip.net_moment"] == pytest.approx(net, abs=1e-8)
    whole = mbd.inverse_dynamics(model, run)
    assert np.abs(whole["hip.moment"]).max() < 1e-8
    assert whole["hip.net_moment"] == pytest.approx(net, abs=1e-8)


def test_friction_that_sticks_and_slides_acts_as_in_the_run():
    model = mbd.Model("rod")
    rod = mbd.Link("rod", mass=2.0, length=1.0, center=0.5, inertia=0.3)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Coulomb(2.0))
    model.connect(pin)
    model.apply(mbd.Motor("drive", pin, torque=lambda t: 6.0 * mbd.sin(3.0 * t)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta853(), tol=1e-8, until=2.0)
    assert {event.kind for event in run.events} == {"slipped"}
    passive = model.without("drive")
    assert mbd.inverse_dynamics(passive, run)["pin.moment"] == pytest.approx(run["drive.torque"], abs=1e-9)
    time_ = np.linspace(0.0, 2.0, 300)
    seen = run.at(time_)
    recorded = {"time": time_} | {f"pin.{part}": seen[f"pin.{part}"] for part in ("angle", "rate", "acceleration")}
    found = mbd.inverse_dynamics(passive, recorded)["pin.moment"]
    slides = np.abs(seen["pin.rate"]) > 1e-6
    assert found[slides] == pytest.approx(seen["drive.torque"][slides], abs=1e-9)


def test_a_box_that_slides_in_space_has_no_residual():
    model = mbd.Model("box")
    box = mbd.RigidBody("box", mass=2.0, inertia=(0.1, 0.1, 0.1))
    arm = mbd.Link("arm", mass=1.0, length=0.5, center=0.2, inertia=(0.02, 0.001, 0.02))
    pin = mbd.Revolute("pin", box.origin, arm.start)
    model.connect(mbd.Free("base", model.ground.origin, box.origin), pin)
    feet = [box.point(x, -0.3, z) for x, z in ((-0.2, -0.2), (0.2, -0.2), (0.0, 0.2))]
    names = [f"foot {k}" for k in range(3)]
    model.constrain(*(mbd.Unilateral(n, mbd.touchdown(f), friction=0.5) for n, f in zip(names, feet, strict=True)))
    model.apply(mbd.Motor("drive", pin, torque=lambda t: 4.0 * mbd.sin(8.0 * t)))
    start = mbd.assemble(model, position={"base.y": 0.3}, velocity={"base.x": 0.5}, closed=names)
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-7, until=0.3)
    found = mbd.inverse_dynamics(model.without("drive"), run)
    assert found["pin.moment"] == pytest.approx(run["drive.torque"], abs=1e-8)
    assert np.abs(found["base.residual_force"]).max() < 1e-6
    assert np.abs(found["base.residual_moment"]).max() < 1e-6


def test_states_of_forces_are_those_of_the_run():
    model, _ = one_body(mbd.Link("rod", mass=2.0, length=1.0, center=0.5, inertia=0.3), mbd.Revolute, "pin")
    pin = model.joints[0]
    model.apply(mbd.DCMotor("motor", pin, resistance=1.0, inductance=0.01, constant=0.1, voltage=1.0))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 0.8}), mbd.RadauIIA(), tol=1e-8, until=0.3)
    found = mbd.inverse_dynamics(model, run)
    assert np.abs(found["pin.moment"]).max() < 1e-9
    assert found["pin.net_moment"] == pytest.approx(run["motor.torque"], abs=1e-9)
    with pytest.raises(mbd.CapabilityError, match=r"does not know 'motor\.current'"):
        mbd.inverse_dynamics(model, {"time": [0.0], "pin.angle": [0.0]})


def test_a_lagrangian_gives_generalized_forces():
    import sympy

    theta = mbd.Coordinate("theta")
    model = mbd.Lagrangian("pendulum", [theta], kinetic=theta.v**2, potential=-3.0 * sympy.cos(theta.q))
    time_ = np.linspace(0.0, 1.0, 101)
    found = mbd.inverse_dynamics(model, {"time": time_, "theta": np.sin(time_)})
    expected = -2.0 * np.sin(time_) + 3.0 * np.sin(np.sin(time_))
    assert found["theta.moment"][5:-5] == pytest.approx(expected[5:-5], abs=1e-4)


def four_bar(drive=None):
    model = mbd.Model("four-bar")
    crank = mbd.Link("crank", mass=1.0, length=0.1, center=0.03, inertia=0.005)
    coupler = mbd.Link("coupler", mass=0.8, length=0.35, center=0.2, inertia=0.01)
    rocker = mbd.Link("rocker", mass=0.7, length=0.3, center=0.1, inertia=0.008)
    pin = mbd.Revolute("drive", model.ground.origin, crank.start)
    model.connect(
        pin,
        mbd.Revolute("crank pin", crank.end, coupler.start),
        mbd.Revolute("coupler pin", coupler.end, rocker.end),
        mbd.Revolute("rocker pin", model.ground.point(0.4, 0.0, 0.0), rocker.start, loss=mbd.Viscous(0.3)),
    )
    if drive is not None:
        model.constrain(mbd.Bilateral("crank drive", pin, value=drive))
    return model


def test_the_drive_of_a_loop_gives_the_moment_and_the_reactions_of_inverse_dynamics():
    driven = four_bar(lambda t: 3.0 * t + 0.4 * mbd.sin(5.0 * t))
    run = mbd.simulate(driven, mbd.assemble(driven), mbd.RadauIIA(), tol=1e-10, until=0.5)
    found = mbd.inverse_dynamics(four_bar(), run, joints=["drive"])
    size = np.abs(run["crank drive.torque"]).max()
    assert found["drive.moment"] == pytest.approx(run["crank drive.torque"], abs=1e-8 * size)
    for pin in ("drive", "crank pin", "coupler pin", "rocker pin"):
        assert found[f"{pin}.reaction_force"] == pytest.approx(run[f"{pin}.reaction_force"], abs=1e-7 * size)


def test_the_angle_of_the_crank_alone_determines_a_loop():
    time_ = np.linspace(0.0, 0.5, 101)
    angle = CubicSpline(time_, 3.0 * time_ + 0.4 * np.sin(5.0 * time_))
    found = mbd.inverse_dynamics(four_bar(), {"time": time_, "drive.angle": angle}, joints=["drive"])
    driven = four_bar(angle)
    run = mbd.simulate(driven, mbd.assemble(driven), mbd.RadauIIA(), tol=1e-9, until=0.5)
    size = np.abs(run["crank drive.torque"]).max()
    inside = time_[1:-1]
    assert found["drive.moment"][1:-1] == pytest.approx(run.at(inside)["crank drive.torque"], abs=1e-6 * size)
    assert any("follow from the closed loops" in note for note in found.notes)


@pytest.mark.parametrize("sweeps", [6, 0])
def test_a_loop_follows_its_branch_at_all_frames_at_once(monkeypatch, sweeps):
    """What one frame after another gives, over two turns of the crank, however often all are tried at once."""
    import mbd.laboratory.closed_loops as loops

    monkeypatch.setattr(loops, "MAX_SWEEPS", sweeps)
    time_ = np.linspace(0.0, 4.0, 161)
    motion = {"time": time_, "drive.angle": math.pi * time_ + 0.3 * np.sin(4.0 * time_)}
    sequential, at_once = [], []
    original = loops.close_loops

    def both(mechanism, time, known, missing, assembled, parameters):
        start, anchors = assembled()
        names = [c.name for c in mechanism.equations.coordinates]
        own = [names.index(name) for name in missing]
        start = start.copy()

        def begun():
            return start, anchors

        at_once.append(original(mechanism, time, known, missing, begun, parameters))
        q = []
        for k in range(len(time)):
            one = tuple(part[k : k + 1] for part in known)
            q.append(original(mechanism, time[k : k + 1], one, missing, begun, parameters).q[0])
            start[own] = q[-1][own] if k < 1 else 2.0 * q[-1][own] - q[-2][own]
        sequential.append(np.array(q))
        return at_once[-1]

    monkeypatch.setattr("mbd.laboratory.motion.close_loops", both)
    mbd.inverse_dynamics(four_bar(), motion, joints=["drive"])
    assert at_once[0].q == pytest.approx(sequential[0], abs=1e-10)
    assert np.abs(np.diff(at_once[0].q, axis=0)).max() < 0.3


@pytest.mark.parametrize("step", [150, 180, 210])
def test_frames_far_apart_are_on_the_branch_of_frames_close_together(step):
    """A crank that turns by up to 1.5 rad from frame to frame; the slider could also be on the other side of it."""
    model = mbd.Model("slider-crank")
    crank = mbd.Link("crank", mass=0.8, length=0.11, center=0.05, inertia=0.002)
    rod = mbd.Link("rod", mass=1.1, length=0.37, center=0.2, inertia=0.012)
    slider = mbd.PointMass("slider", mass=0.9)
    model.connect(
        mbd.Revolute("drive", model.ground.origin, crank.start),
        mbd.Revolute("pin", crank.end, rod.start),
        mbd.Prismatic("rail", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", rod.end, slider.origin),
    )
    time_ = np.linspace(0.0, 6.0, 2001)
    angle = 0.3 + 2.2 * time_ + 0.3 * np.sin(1.3 * time_)
    motion = {"time": time_, "drive.angle": angle, "drive.rate": 2.2 + 0.39 * np.cos(1.3 * time_),
              "drive.acceleration": -0.507 * np.sin(1.3 * time_)}  # fmt: skip
    dense = mbd.inverse_dynamics(model, motion, joints=["drive"])
    assert np.abs(np.diff(dense["rail.displacement"])).max() < 2e-3
    found = mbd.inverse_dynamics(model, {name: values[::step] for name, values in motion.items()}, joints=["drive"])
    for name in ("drive.moment", "rail.displacement", "pin.angle"):
        assert found[name] == pytest.approx(dense[name][::step], abs=1e-9), name


def test_motions_that_are_functions_of_coordinates_have_their_values_and_rates():
    """A slider that follows sin of an angle, and one that follows the square of the slider."""
    model = mbd.Model("follower")
    wheel = mbd.Link("wheel", mass=2.0, length=0.3, center=0.1, inertia=0.02)
    blocks = [mbd.PointMass(f"block {k}", mass=1.0 + k) for k in range(2)]
    model.connect(mbd.Revolute("pin", model.ground.origin, wheel.start))
    for k, block in enumerate(blocks):
        model.connect(mbd.Prismatic(f"rail {k}", model.ground.point(1.0, k), block.origin, axis=(1.0, 0.0, 0.0)))
    model.constrain(
        mbd.Bilateral("cam", mbd.measure(lambda x, q: x - mbd.sin(q), "rail 0.displacement", "pin.angle", unit="m")),
        mbd.Bilateral(
            "next", mbd.measure(lambda y, x: y - x**2, "rail 1.displacement", "rail 0.displacement", unit="m")
        ),
    )
    t = np.linspace(0.0, 1.0, 41)
    q, v, a = 0.3 + 2.0 * t + t**2, 2.0 + 2.0 * t, np.full(41, 2.0)
    given = {"time": t, "pin.angle": q, "pin.angle.rate": v, "pin.angle.acceleration": a}
    found = mbd.inverse_dynamics(model, given, joints=["pin"])
    x, u, b = np.sin(q), v * np.cos(q), a * np.cos(q) - v**2 * np.sin(q)
    assert found["rail 0.displacement"] == pytest.approx(x, abs=1e-14)
    assert found["rail 1.displacement"] == pytest.approx(x**2, abs=1e-14)
    assert found["rail 1.acceleration"] == pytest.approx(2.0 * (u**2 + x * b), abs=1e-12)
    inertia = 0.02 + 2.0 * 0.1**2
    power = inertia * v * a + u * b + 2.0 * (2.0 * x * u) * 2.0 * (u**2 + x * b)
    weight = found["pin.moment"] - power / v  # only gravity is left
    alone = mbd.inverse_dynamics(model, {"time": t, "pin.angle": q, "pin.angle.rate": 0.0 * t,
                                         "pin.angle.acceleration": 0.0 * t}, joints=["pin"])  # fmt: skip
    assert weight == pytest.approx(alone["pin.moment"], abs=1e-11)


def test_moments_of_a_loop_with_too_many_drives_are_of_least_norm():
    """Any change that does the same work along the one freedom of the loop is larger."""
    driven = four_bar(lambda t: 3.0 * t)
    run = mbd.simulate(driven, mbd.assemble(driven), mbd.RadauIIA(), tol=1e-8, until=0.3)
    model = four_bar()
    alone = mbd.inverse_dynamics(model, run, joints=["drive"])
    several = mbd.inverse_dynamics(model, run)
    joints = ["drive", "crank pin", "rocker pin", "coupler pin"]
    moments = np.column_stack([several[f"{j}.moment"] for j in joints if f"{j}.moment" in several])
    rates = np.column_stack([run[f"{j}.rate"] for j in joints if f"{j}.moment" in several])
    power = alone["drive.moment"] * run["drive.rate"]
    assert np.einsum("ij,ij->i", moments, rates) == pytest.approx(power, abs=1e-8 * np.abs(power).max())
    along = np.einsum("ij,ij->i", moments, rates) / np.einsum("ij,ij->i", rates, rates)
    assert moments == pytest.approx(along[:, None] * rates, abs=1e-8 * np.abs(moments).max())
    assert any("least norm" in note for note in several.notes)


def test_a_forward_run_driven_by_the_moments_returns_to_the_motion():
    """Fourth order in the distance of the samples, which a run at steps of its own shows."""

    def arm(*moments):
        model = mbd.Model("arm")
        upper = mbd.Link("upper", mass=1.3, length=0.5, center=0.2, inertia=0.02)
        lower = mbd.Link("lower", mass=0.7, length=0.6, center=0.3, inertia=0.05)
        joints = (
            mbd.Revolute("shoulder", model.ground.origin, upper.start, loss=mbd.Viscous(0.1)),
            mbd.Revolute("elbow", upper.end, lower.start, loss=mbd.Viscous(0.1)),
        )
        model.connect(*joints)
        pairs = zip(joints, moments, strict=False)
        model.apply(*(mbd.Motor(f"{joint.name} motor", joint, torque=moment) for joint, moment in pairs))
        return model

    errors = []
    for count in (41, 81):
        t = np.linspace(0.0, 0.8, count)
        motion = {"time": t}
        for name, size, w in (("shoulder.angle", 0.4, 5.0), ("elbow.angle", 0.6, 7.0)):
            motion |= {name: size * np.sin(w * t), f"{name}.rate": size * w * np.cos(w * t)}
            motion[f"{name}.acceleration"] = -size * w * w * np.sin(w * t)
        found = mbd.inverse_dynamics(arm(), motion)
        driven = arm(*(mbd.Samples(t, found[f"{name}.moment"], "spline") for name in ("shoulder", "elbow")))
        begin = {name: motion[name][0] for name in ("shoulder.angle", "elbow.angle")}
        speed = {f"{name}.rate": motion[f"{name}.rate"][0] for name in begin}
        run = mbd.simulate(driven, mbd.assemble(driven, position=begin, velocity=speed), tol=1e-10, until=0.8)
        errors.append(max(np.abs(run.at(t[1:-1])[name] - motion[name][1:-1]).max() for name in begin))
    assert errors[1] < 2e-6 and math.log2(errors[0] / errors[1]) > 3.5


def test_velocities_are_those_of_the_spline_through_the_values():
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=0.5), mbd.Revolute, "pin", title="pendulum")
    t = np.linspace(0.0, 1.0, 31) ** 1.1
    signal = mbd.Samples(t, np.sin(4.0 * t), "spline")
    by_values = mbd.inverse_dynamics(model, {"time": t, "pin.angle": np.sin(4.0 * t)})
    by_curve = mbd.inverse_dynamics(model, {"time": t, "pin": signal})
    inside = slice(0, -1)  # the curve is constant behind its end
    assert by_values["pin.moment"][inside] == pytest.approx(by_curve["pin.moment"][inside], abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 9, 40])
def test_derivatives_are_those_of_the_not_a_knot_spline(count):
    """Of more columns than are taken at once, at uneven times, against scipy's; times stretched by 1e-3 to 1e3."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        stretch = 10.0 ** rng.uniform(-3.0, 3.0)
        time = stretch * np.cumsum(rng.uniform(0.2, 2.0, size=count))
        values = rng.normal(size=(count, 19))
        if count == 1:
            assert not np.any(derivatives(time, values))
            continue
        for order, found in enumerate(derivatives(time, values), 1):
            expected = CubicSpline(time, values)(time, order)
            assert found == pytest.approx(expected, rel=1e-10, abs=1e-11 * np.abs(expected).max(initial=1e-9))


def test_a_turning_top_keeps_the_rates_of_its_orientation():
    """Euler's equations of a top whose orientation is given at fine distances."""
    model = mbd.Model("top", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", mass=1.0, inertia=(0.1, 0.2, 0.3))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    t = np.linspace(0.0, 1.0, 801)
    axis = np.array([0.6, 0.0, 0.8])
    angle, rate, change = np.sin(3.0 * t), 3.0 * np.cos(3.0 * t), -9.0 * np.sin(3.0 * t)
    q = np.column_stack([np.cos(angle / 2), np.sin(angle / 2)[:, None] * axis])
    found = mbd.inverse_dynamics(model, {"time": t, "ball.orientation": q * np.where(t < 0.5, 1.0, -1.0)[:, None]})
    tensor = np.diag([0.1, 0.2, 0.3])
    expected = change[:, None] * (tensor @ axis) + rate[:, None] ** 2 * np.cross(axis, tensor @ axis)
    assert found["ball.moment"][5:-5] == pytest.approx(expected[5:-5], abs=1e-5)


def test_plain_python_and_machine_code_agree():
    _, model = person()
    body = mbd.human(75.0, 1.8)
    motion, _ = random_motion(body.joints, np.random.default_rng(5), 2)
    fast = mbd.inverse_dynamics(model, motion)
    slow = mbd.inverse_dynamics(model, motion, backend="python")
    assert len(fast._own) > 20 and slow._own.keys() == fast._own.keys()
    for name in fast._own:
        assert slow._own[name] == pytest.approx(fast._own[name], rel=1e-11, abs=1e-11)


@pytest.mark.slow
def test_a_frame_of_a_person_takes_at_most_twenty_microseconds():
    body, model = person()
    motion, _ = random_motion(body.joints, np.random.default_rng(5), 2000)
    mbd.inverse_dynamics(model, motion)
    times = []
    for _ in range(5):
        started = time.process_time()
        mbd.inverse_dynamics(model, motion)
        times.append(time.process_time() - started)
    assert min(times) / 2000 < 20e-6


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ({"pin.angle": [0.0]}, "under 'time'"),
        ({"time": [0.0, 0.0], "pin.angle": [0.0, 0.0]}, "increasing"),
        ({"time": [0.0, 1.0]}, "'pin.angle' of 'pendulum' is missing"),
        ({"time": [0.0, 1.0], "pin.angel": [0.0, 0.0]}, "did you mean 'pin.angle'"),
        ({"time": [0.0, 1.0], "pin.angle": [0.0, math.nan]}, "has a gap at t = 1 s"),
        ({"time": [0.0, 1.0], "pin.angle": [0.0]}, r"shape \(2,\), got \(1,\)"),
        ({"time": [0.0, 1.0], "pin.angle": ["a", "b"]}, "must be numbers"),
        ({"time": [0.0, 1.0], "pin.angle.rate": [0.0, 0.0]}, "given without its value"),
        (3, "motion must be a run"),
    ],
)
def test_a_motion_that_is_none_is_named(motion, words):
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=0.5), mbd.Revolute, "pin", title="pendulum")
    with pytest.raises(mbd.ModelError, match=words):
        mbd.inverse_dynamics(model, motion)


def test_joints_that_are_none_or_cut_are_named():
    driven = four_bar(lambda t: 3.0 * t)
    run = mbd.simulate(driven, mbd.assemble(driven), dt=1e-2, until=0.05)
    with pytest.raises(mbd.ModelError, match="did you mean 'drive'"):
        mbd.inverse_dynamics(four_bar(), run, joints=["driv"])
    cut = next(name for name in ("crank pin", "coupler pin", "rocker pin") if f"{name}.angle" not in run.final.names)
    with pytest.raises(mbd.ModelError, match="closes a loop and is cut"):
        mbd.inverse_dynamics(four_bar(), run, joints=[cut])


def test_angles_that_look_like_degrees_are_in_doubt():
    """An angle that swings to and fro by more than a turn warns; one that goes round does not."""
    model, time = mbd.Model("leg"), np.linspace(0.0, 1.0, 101)
    rod = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.05)
    model.connect(mbd.Revolute("knee", model.ground.origin, rod.start))
    with pytest.warns(mbd.MbdWarning, match="'knee.angle' swings to and fro by 60 rad"):
        mbd.inverse_dynamics(model, {"time": time, "knee.angle": 30.0 * np.sin(6.0 * time)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbd.inverse_dynamics(model, {"time": time, "knee.angle": 30.0 * time})
        mbd.inverse_dynamics(model, {"time": time, "knee.angle": np.radians(30.0 * np.sin(6.0 * time))})


@pytest.mark.parametrize("loop", [False, True])
def test_pins_rub_by_the_force_that_they_carry(loop):
    """The drive of a run is found again, though friction in the pins follows the force in them."""
    model = mbd.Model("pins", cut=["rocker"] if loop else "auto")
    crank = mbd.Link("crank", mass=1.0, length=0.2, center=0.1, inertia=0.004)
    bar = mbd.Link("bar", mass=2.0, length=0.5, center=0.25, inertia=0.04)
    loss = mbd.PinFriction(0.2, 0.02) + mbd.Viscous(0.05)
    drive = mbd.Revolute("drive", model.ground.origin, crank.start, loss=loss)
    pin = mbd.Revolute("pin", crank.end, bar.start, loss=mbd.PinFriction(0.3, 0.015))
    model.connect(drive, pin)
    if loop:
        third = mbd.Link("third", mass=1.5, length=0.4, center=0.2, inertia=0.02)
        model.connect(mbd.Revolute("support", model.ground.point(0.4, 0.0), third.start))
        model.connect(mbd.Revolute("rocker", bar.end, third.end))
    start = mbd.assemble(model, position={"drive.angle": 0.3}, velocity={"drive.angle.rate": 4.0})
    model.apply(mbd.Motor("motor", drive, torque=lambda t: 6.0 + mbd.sin(9.0 * t)))
    if not loop:
        model.apply(mbd.Motor("other", pin, torque=lambda t: 3.0 * mbd.cos(5.0 * t)))
        start = mbd.assemble(
            model, {"drive.angle": 0.3, "pin.angle": 0.4}, {"drive.angle.rate": 4.0, "pin.angle.rate": 2.0}
        )
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-9, until=0.15)
    bare = model.without("motor", *([] if loop else ["other"]))
    found = mbd.inverse_dynamics(bare, run, joints=["drive"] if loop else None)
    moving = (np.abs(run["drive.rate"]) > 0.1) & (np.abs(run["pin.rate"]) > 0.1)
    assert moving.sum() > 10
    assert found["drive.moment"][moving] == pytest.approx(run["motor.torque"][moving], abs=1e-6)
    if not loop:
        assert found["pin.moment"][moving] == pytest.approx(run["other.torque"][moving], abs=1e-6)
        rubbing = found["drive.net_moment"] - run["motor.torque"] + 0.05 * run["drive.rate"]
        assert np.abs(rubbing[moving]) == pytest.approx(np.abs(run["drive.friction"][moving]), abs=1e-6)


def test_a_model_that_changes_has_other_moments_with_friction_in_its_pins():
    def pendulum(gravity):
        model = mbd.Model("pendulum", gravity=gravity)
        rod = mbd.Link("rod", mass=1.5, length=0.35, center=0.16, inertia=0.016)
        model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.PinFriction(0.1, 0.01)))
        return model

    time = np.linspace(0.0, 1.0, 41)
    motion = {"time": time, "pin.angle": 0.3 * np.sin(2.0 * time)}
    model = pendulum((0.0, -9.81, 0.0))
    mbd.inverse_dynamics(model, motion)
    model.gravity = (0.0, -1.62, 0.0)
    expected = mbd.inverse_dynamics(pendulum((0.0, -1.62, 0.0)), motion)["pin.moment"]
    np.testing.assert_array_equal(mbd.inverse_dynamics(model, motion)["pin.moment"], expected)
