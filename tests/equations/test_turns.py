"""Angles count turns, and joints hold their directions, whichever joints are cut."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.forward_kinematics import misfit, placed, poses, turn

TURN = 2.0 * math.pi


def frame(rng, body):
    """A point with axes turned anywhere."""
    point = body.point(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5))
    return point.turned(rng.uniform(-3.1, 3.1)) if rng.random() < 0.7 else point


def body(rng, name):
    center = (rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), 0.0)
    return mbd.RigidBody(name, mass=rng.uniform(0.5, 2.0), inertia=rng.uniform(0.1, 0.5), center=center)


def joint(rng, kind, name, a, b):
    if kind == "Revolute":
        return mbd.Revolute(name, a, b, axis=(0.0, 0.0, rng.choice([1.0, -1.0])))
    return {"Planar": mbd.Planar, "Weld": mbd.Weld, "Prismatic": mbd.Prismatic, "Translation": mbd.Translation}[kind](
        name, a, b
    )


def value(rng, label):
    """Angles over several turns, short lengths."""
    return rng.uniform(-15.0, 15.0) if label.unit == "rad" else rng.uniform(-0.5, 0.5)


def mechanism(seed, cut="auto"):
    """A planar mechanism with joints of all kinds, often with a loop, and the coordinates of all its joints."""
    rng = random.Random(seed)
    model = mbd.Model(f"planar {seed}", gravity=(rng.uniform(-3, 3), -9.81, 0.0), cut=cut)
    known, values, tree = [model.ground], {}, []
    kinds = ["Revolute", "Planar", "Weld", "Prismatic", "Translation"]
    for k in range(rng.randint(2, 4)):
        new, onto = body(rng, f"body {k}"), rng.choice(known)
        kind = "Revolute" if k == 0 else rng.choices(kinds, [6, 1, 2, 2, 1])[0]
        made = joint(rng, kind, f"joint {k}", frame(rng, onto), frame(rng, new))
        values |= {f"{made.name}.{label.name}": value(rng, label) for label in made.labels}
        tree.append(made)
        known.append(new)
    model.connect(*tree)
    if rng.random() < 0.7:
        tree.append(closing(rng, model, tree, known, values))
        model.connect(tree[-1])
    return model, values


def closing(rng, model, tree, known, values):
    """A joint between the last body and another that fits where they are, and its coordinates."""
    pose = poses(model, tree, values.__getitem__)
    last, other = known[-1], rng.choice(known[:-1])
    kind = rng.choice(["Revolute", "Weld", "Prismatic", "Translation"])
    b = frame(rng, last)
    (R, p), (C, c) = pose[last.name], placed(b)
    (S, s) = pose[other.name]
    place, axes = S.T @ (p + R @ c - s), S.T @ R @ C
    angle = rng.uniform(-15.0, 15.0) if kind == "Revolute" else 0.0
    flip = rng.choice([1.0, -1.0])
    a = other.point(*place[:2]).turned(math.atan2(axes[1, 0], axes[0, 0]) - flip * angle)
    if kind == "Revolute":
        values["closing.angle"] = angle
        return mbd.Revolute("closing", a, b, axis=(0.0, 0.0, flip))
    made = joint(rng, kind, "closing", a, b)
    values |= dict.fromkeys(made.coordinate_names, 0.0)
    return made


def cuts(seed):
    """All, and each of two random choices."""
    names = [each.name for each in mechanism(seed)[0].joints]
    rng = random.Random(seed + 1)
    return ["auto", "all", [rng.choice(names)], rng.sample(names, 2)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(8))
def test_a_start_comes_out_as_named_and_every_joint_fits_its_bodies_under_every_cut(seed):
    for cut in cuts(seed):
        model, values = mechanism(seed, cut)
        start = mbd.assemble(model, position=values, backend="python")
        run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=1e-3, backend="python")
        for name, named in values.items():
            assert run[name][0] == pytest.approx(named, abs=1e-8), (cut, name)
        assert_fits(model, run, 0, 1e-7)


def laden(seed, cut):
    """The mechanism with springs, a potential and a motor that see angles over all their turns."""
    model, values = mechanism(seed, cut)
    single = [each for each in model.joints if len(each.labels) == 1]
    angles = [name for name in values if name.endswith("angle")]
    for k, each in enumerate(single):
        model.apply(mbd.TorsionSpring(f"spring {k}", each, stiffness=1.0 + k, rest=0.3))
    model.apply(
        mbd.Motor(
            "drive", single[0], torque=lambda q: 0.2 * q + mbd.sin(0.3 * q), arguments=single[0].coordinate_names
        ),
        mbd.Potential("coupling", lambda a, b: 0.05 * (a + 1.7 * b) ** 2, arguments=(angles[0], angles[-1])),
    )
    return model, values


def motion(seed, cut, rates):
    """Rates and accelerations of all joints and torques of the motor at a start."""
    model, values = laden(seed, cut)
    start = mbd.assemble(model, position=values, velocity=rates, project=cut == "auto", backend="python")
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-6, until=1e-6, backend="python")
    asked = [f"{name}{what}" for name in values for what in ("", ".rate", ".acceleration")]
    return {name: run[name][0] for name in [*asked, "drive.torque", "potential_energy", "kinetic_energy"]}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(6))
def test_forces_that_see_angles_of_many_turns_move_every_cut_alike(seed):
    rng = random.Random(seed)
    _, values = mechanism(seed)
    first = motion(seed, "auto", {f"{name}.rate": rng.uniform(-2, 2) for name in values})
    rates = {name: first[name] for name in first if name.endswith(".rate")}
    size = max(map(abs, first.values()))
    for cut in cuts(seed)[1:]:
        assert motion(seed, cut, rates) == pytest.approx(first, rel=1e-6, abs=1e-7 * size), cut


def assert_fits(model, run, row, tolerance):
    """Every joint puts its child where the run has it, by forward kinematics of its own coordinates."""
    found = {model.ground.name: (np.eye(3), np.zeros(3))}
    for each in model.bodies.values():
        if each is not model.ground:
            (x, y), (u, v) = ([run[f"{each.name}.{at}.{axis}"][row] for axis in "xy"] for at in ("origin", "center"))
            heading = math.atan2(v - y, u - x) - math.atan2(each.center.offset[1], each.center.offset[0])
            found[each.name] = (turn((0, 0, 1), heading), np.array([x, y, 0.0]))
    for each in model.joints:
        values = {label.name: run[f"{each.name}.{label.name}"][row] for label in each.labels}
        off = misfit(each, found, values)
        assert max(off) < tolerance, (each.name, off)


# motions over many turns ---------------------------------------------------------------------------------------------
SCHEMES = {
    "HHT": (mbd.HHT(), {"dt": 1e-3}),
    "generalized-alpha": (mbd.GeneralizedAlpha(0.9), {"dt": 1e-3}),
    "Radau IIA": (mbd.RadauIIA(), {"tol": 1e-6}),
    "Runge-Kutta": (mbd.RungeKutta853(), {"tol": 1e-6}),
}


def gears(ratio, torque, cut="auto", loss=None):
    """Two discs whose angles hold x + ratio · y = 0, driven by a torque on the first."""
    model = mbd.Model("gears", gravity=(0.0, 0.0, 0.0), cut=cut)
    a, b = (mbd.RigidBody(name, mass=1.0, inertia=inertia) for name, inertia in (("a", 0.03), ("b", 0.02)))
    x = mbd.Revolute("x", model.ground.origin, a.origin, loss=loss)
    y = mbd.Revolute("y", model.ground.point(0.5, 0.0), b.origin, loss=loss)
    model.connect(x, y)
    model.constrain(mbd.Bilateral("mesh", mbd.measure(lambda p, q: p + ratio * q, "x.angle", "y.angle")))
    model.apply(mbd.Motor("drive", x, torque))
    return model


@pytest.mark.parametrize("scheme", SCHEMES)
def test_gears_with_friction_in_their_pins_turn_as_far_as_their_torque_drives_them(scheme):
    ratio, torque, until = 1.7, 0.6, 1.5
    integrator, settings = SCHEMES[scheme]
    model = gears(ratio, torque, loss=mbd.PinFriction(1e-6, 1e-3))
    run = mbd.simulate(model, mbd.assemble(model, position={"x.angle": 0.4}), integrator, until=until, **settings)
    turned = 0.5 * torque / (0.03 + 0.02 / ratio**2) * until**2
    assert run["x.angle"][-1] - 0.4 == pytest.approx(turned, rel=1e-5)
    assert run["y.angle"][-1] == pytest.approx(-run["x.angle"][-1] / ratio, rel=1e-9)


def stopped(cut):
    """An arm whose elbow runs into a stop after more than two turns, with an event of its shoulder beyond a turn."""
    model = mbd.Model("arm", gravity=(0.0, -1.0, 0.0), cut=cut)
    upper, lower = (mbd.Link(name, 1.0, 0.3, 0.1, 0.02) for name in ("upper", "lower"))
    shoulder = mbd.Revolute("shoulder", model.ground.origin, upper.start)
    elbow = mbd.Revolute("elbow", upper.end, lower.start)
    model.connect(shoulder, elbow)
    model.apply(mbd.Motor("a", shoulder, 1.5), mbd.Motor("b", elbow, 0.9))
    model.constrain(
        mbd.Unilateral("stop", mbd.measure(lambda q: 11.0 - q, "elbow.angle"), restitution=0.5),
        mbd.Event("second turn", mbd.measure(lambda q: q - 7.5, "shoulder.angle")),
    )
    return model


def swung(cut, until=1.1, scheme="Runge-Kutta", start=None):
    model = stopped(cut)
    begin = mbd.assemble(model, position={"shoulder.angle": 7.0, "elbow.angle": -5.0}) if start is None else start
    integrator, settings = SCHEMES[scheme]
    return mbd.simulate(model, begin, integrator, until=until, **settings)


def test_stops_and_events_beyond_a_turn_are_met_under_every_cut():
    told = [(event.name, event.time) for event in swung("auto").events]
    assert {"stop", "second turn"} == {name for name, _ in told}
    for scheme, cut in ("HHT", "all"), ("Radau IIA", ["elbow"]), ("Runge-Kutta", "all"):
        run = swung(cut, scheme=scheme)
        assert [event.name for event in run.events] == [name for name, _ in told]
        assert [event.time for event in run.events] == pytest.approx([time for _, time in told], abs=1e-4)
        assert run["elbow.angle"][0] == pytest.approx(-5.0, abs=1e-9)
        assert np.max(np.abs(np.diff(run["elbow.angle"]))) < 1.0
        assert np.max(run["elbow.angle"]) < 11.0 + 1e-6


def test_a_run_of_many_turns_goes_on_to_the_bit_from_its_middle(tmp_path):
    whole = swung("all", scheme="HHT")
    half = swung("all", 0.2, "HHT")
    half.save(tmp_path / "half.npz")
    for state in half.final, mbd.load(tmp_path / "half.npz").final:
        rest = swung("all", scheme="HHT", start=state)
        assert rest["elbow.angle"][-1] == whole["elbow.angle"][-1]
    bare = replace(half.final, memory=None)
    assert swung("all", scheme="HHT", start=bare)["elbow.angle"][0] == half["elbow.angle"][-1]


def test_a_state_turned_by_hand_holds_the_directions_of_the_same_pose():
    """A slider guided by a cut joint, its body turned by two whole turns beside its rod."""
    model = mbd.Model("slider", cut=["guide"])
    crank, rod = mbd.Link("crank", 1.0, 0.3, 0.1), mbd.Link("rod", 1.0, 0.8, 0.1)
    piston = mbd.RigidBody("piston", mass=0.5, inertia=0.01)
    model.connect(
        mbd.Revolute("pin", model.ground.origin, crank.start), mbd.Revolute("crank end", crank.end, rod.start),
        mbd.Revolute("wrist", rod.end, piston.origin), mbd.Prismatic("guide", model.ground.origin, piston.origin),
    )  # fmt: skip
    start = mbd.assemble(model, position={"pin.angle": 0.4})
    q = start.q.copy()
    q[start.names.index("wrist.angle")] += 2 * TURN
    run, turned = (mbd.simulate(model, s, mbd.HHT(), dt=1e-3, until=0.1) for s in (start, replace(start, q=q)))
    assert turned["wrist.angle"] == pytest.approx(run["wrist.angle"] + 2 * TURN, abs=1e-9)
    assert turned.violation.angle < 1e-9


def test_coordinates_of_a_floating_body_serve_in_measures_as_in_starts_and_results():
    model = mbd.Model("pendulum", cut="all")
    rod = mbd.Link("rod", 1.0, 1.0, 0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    model.constrain(mbd.Event("turned", mbd.measure(lambda q: q - 7.5, "rod floating.angle")))
    start = mbd.assemble(model, position={"rod floating.angle": 7.2}, velocity={"pin.angle": 6.0})
    run = mbd.simulate(model, start, dt=1e-3, until=0.2)
    assert [event.name for event in run.events] == ["turned"]
    assert run["pin.angle"][-1] == pytest.approx(run["rod floating.angle"][-1] - 2 * np.pi, abs=1e-6)
