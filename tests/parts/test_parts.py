"""Single parts: what their numbers mean, held against formulas and published values."""

import math

import numpy as np
import pytest

import mbd
from mbd import parts
from mbd.errors import ModelError
from mbd.parts.knees.four_bar import LINKS
from mbd.testing.losses import force_at
from tests.helpers import FreeScope


def leg():
    """A thigh on a hip, and a shank."""
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    return model, thigh.end, shank.start


def test_one_way_valves_tell_flexion_from_extension():
    model, *ends = leg()
    loss = parts.hydraulic_knee(model, "knee", *ends, flexion=0.8, extension=0.2, loss=mbd.Viscous(0.1)).loss
    assert force_at(loss, -2.0) == pytest.approx(-0.8 * 4.0 - 0.2)
    assert force_at(loss, 2.0) == pytest.approx(0.2 * 4.0 + 0.2)
    assert model.parameters["knee loss.valves.backward.coefficient"] == 0.8


HINGES = {
    "stop_knee": {}, "locking_knee": {}, "hydraulic_knee": {"flexion": 0.8, "extension": 0.2},
    "friction_brake_knee": {"mu": 0.2, "radius": 0.02}, "pneumatic_knee": {"volume": 5e-4, "swept": 1e-4},
    "powered_knee": {
        "voltage": 0.0, "resistance": 1.0, "constant": 0.05, "gear": 50.0, "rotor": 1e-5, "mass": 0.1,
    },
    "bumper_ankle": {"heel": {"stiffness": 50.0}, "toe": {"stiffness": 90.0}, "clearance": 1.0},
    "hydraulic_ankle": {"plantarflexion": 2.0, "dorsiflexion": 3.0},
    "tabulated_ankle": {"angle": (-0.4, 0.0, 0.4), "torque": (-9.0, 0.0, 20.0)},
    "series_elastic_ankle": {"torque": 0.0, "stiffness": 300.0, "inertia": 0.1, "mass": 0.2},
}  # fmt: skip
"""Parts that are one hinge of a leg, with what they need."""


@pytest.mark.parametrize("name", HINGES)
def test_hinges_of_a_leg_are_joints_of_the_body_when_they_say_so(name):
    model, *ends = leg()
    part = name.rpartition("_")[2]
    joint = getattr(parts, name)(model, part, *ends, **HINGES[name], anatomy=f"left {part}")
    assert joint.anatomy == f"left {part}" and getattr(parts, name)(leg()[0], part, *ends, **HINGES[name]).anatomy == ""
    state = mbd.assemble(model, {f"{part}.angle": -0.3}, backend="python")
    run = mbd.simulate(model, state, mbd.HHT(), dt=1e-3, until=1e-3, backend="python")
    told = run[f"{part}.{'flexion' if part == 'knee' else 'dorsiflexion'}"][0]
    assert told == pytest.approx(0.3 if part == "knee" else -0.3)
    with pytest.raises(ModelError, match="'left knie'"):
        getattr(parts, name)(leg()[0], part, *ends, **HINGES[name], anatomy="left knie")


def test_an_orifice_obeys_bernoulli():
    piston, opening, arm, rate = 3e-4, 2e-6, 0.03, 1.5
    pressure = 0.5 * 870.0 * (piston * arm * rate / (0.61 * opening)) ** 2
    moment = parts.orifice(piston=piston, opening=opening, arm=arm) * rate**2
    assert moment == pytest.approx(pressure * piston * arm, rel=1e-12)


@pytest.mark.parametrize(
    ("loss", "a", "b"),
    [(parts.SWING_3R60.backward, 213.5932, -4927.5), (parts.STANCE_3R60.forward, 7.0819, 65579.0)],
)
def test_the_dampers_of_the_3r60_follow_their_laws_until_these_would_drive(loss, a, b):
    for speed in (1e-3, 3e-3, 0.02):
        published = (a / speed + b) * speed
        assert force_at(loss, speed) == pytest.approx(published, rel=6e-3)  # of the smoothing, (ε/v)²/2
        assert force_at(loss, -speed) == -force_at(loss, speed)
    assert b > 0.0 or force_at(loss, 1.01 * a / -b) == 0.0 < force_at(loss, 0.99 * a / -b)


def test_the_pivots_of_the_3r60_have_the_lengths_of_its_links():
    """Lengths and angles of the table, in mm and degrees; forward is the other way there."""
    at = {name: complex(-x, y) * 1e3 for name, (x, y) in parts.PIVOTS_3R60.items()}
    lengths = {
        ("shank", "front lower"): 88.5, ("front lower", "rear lower"): 40.25, ("front lower", "swing lower"): 14.9,
        ("front lower", "front upper"): 95.0, ("rear lower", "rear middle"): 7.9, ("rear middle", "rear upper"): 76.95,
        ("front upper", "rear upper"): 26.0, ("front upper", "swing upper"): 17.7, ("front upper", "thigh"): 25.1,
        ("shank", "rear middle"): 89.25,
    }  # fmt: skip
    for (a, b), length in lengths.items():
        assert abs(at[b] - at[a]) == pytest.approx(length, abs=1e-3), (a, b)

    def bearing(a, b):
        return math.degrees(np.angle(at[b] - at[a]))

    lower, upper = bearing("shank", "front lower"), bearing("front upper", "thigh")
    assert lower - 90.0 == pytest.approx(18.0, abs=1e-2)
    assert bearing("front lower", "rear lower") - lower == pytest.approx(-112.0, abs=1e-2)
    assert bearing("front lower", "swing lower") - lower == pytest.approx(-98.0, abs=1e-2)
    assert upper - 90.0 == pytest.approx(10.0, abs=1e-2)
    assert bearing("front upper", "rear upper") - upper == pytest.approx(-122.0, abs=1e-2)
    assert bearing("front upper", "swing upper") - upper == pytest.approx(-116.0, abs=1e-2)
    assert sum(mass for mass, *_ in LINKS.values()) == pytest.approx(0.6815)


def test_a_keel_is_as_stiff_at_its_toe_as_was_asked():
    model, foot = mbd.Model("foot"), mbd.RigidBody("foot", 1.0, 0.01)
    model.connect(mbd.Planar("body", model.ground.origin, foot.origin))
    how = {"length": 0.2, "stiffness": 4e4, "mass": 0.2}
    parts.keel_foot(model, "left", foot.point(-0.05, -0.1), foot.point(0.0, -0.08), **how)
    reach = 0.85 * 0.2
    assert model.parameters["left keel spring.stiffness"] / reach**2 == pytest.approx(4e4)
    moments = [model.parameters[f"left blade.inertia.{axis}"] for axis in ("xx", "yy", "zz")]
    rod = model.parameters["left blade.mass"] * reach**2 / 12.0  # along x
    assert moments == pytest.approx([0.0, rod, rod])
    assert model.parameters["left blade.toe.x"] == pytest.approx(reach)


def test_a_measured_spring_passes_through_its_points_and_stores_what_it_takes():
    _, *ends = leg()
    knee = mbd.Revolute("knee", *ends)
    spring = mbd.TabulatedSpring("spring", knee, [-0.15, 0.0, 0.1, 0.2], [-20.0, 0.0, 30.0, 90.0])
    from mbd.tape.table import Table

    energy = Table("spring", *spring.pieces())
    for angle, torque in zip(spring.angle, spring.torque, strict=True):
        assert energy.value(angle, 1) == pytest.approx(torque, abs=1e-12)
    for angle in np.linspace(-0.3, 0.4, 50):
        slope = (energy.value(angle + 1e-6) - energy.value(angle - 1e-6)) / 2e-6
        assert energy.value(angle, 1) == pytest.approx(slope, abs=1e-4)
        assert energy.value(angle, 2) >= 0.0  # the curve rises where the points do


def test_ligaments_resist_as_published():
    """Anderson's double exponential at 10° of extension beyond the range of the knee, and little within."""
    model, *ends = leg()
    knee = mbd.Revolute("knee", *ends)
    moment = parts.passive_moment(model, "ligaments", knee, of="knee")
    scope = FreeScope([knee])

    def pull(q):
        from mbd.bodies.algebra import derivatives_at

        _, (slope,) = derivatives_at(lambda angle: moment.function(angle, 1.0), [q], scope.tape)
        return -slope.data

    assert pull(0.13) == pytest.approx(-6.09 + 11.03 * math.exp(-11.33 * 2.53))
    assert abs(pull(-1.0)) < 1e-4


def test_a_motor_runs_up_as_its_inductance_and_rotor_have_it():
    """``J N² q̈ = N k i``, ``L di/dt = u − R i − k N q̇``: against the matrix exponential; a rotor counts N² times."""
    from scipy.linalg import expm

    model, gear, rotor, R, k, L, u = mbd.Model("motor", gravity=(0, 0, 0)), 50.0, 1e-5, 0.5, 0.05, 5e-3, 3.0
    wheel = mbd.RigidBody("wheel", 1.0, 0.02)
    how = {"resistance": R, "constant": k, "inductance": L, "gear": gear, "rotor": rotor, "mass": 0.1}
    parts.powered_knee(model, "knee", model.ground.origin, wheel.origin, voltage=u, **how)
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta853(), dt=1e-3, until=0.05)
    J = 0.02 + gear**2 * rotor
    rates = np.array([[0.0, gear * k / J, 0.0], [-k * gear / L, -R / L, u / L], [0.0, 0.0, 0.0]])
    rate, current, _ = expm(rates * 0.05) @ [0.0, 0.0, 1.0]
    assert run["knee.angle.rate"][-1] == pytest.approx(rate, rel=1e-9)
    assert run["knee motor.current"][-1] == pytest.approx(current, rel=1e-9)
    assert run["knee shaft.angle"][-1] == pytest.approx(gear * run["knee.angle"][-1], rel=1e-12)


def test_a_person_weighs_what_he_weighs():
    for table in ("Winter", "de Leva male", "de Leva female"):
        who = parts.person(70.0, 1.75, table)
        legs = 2.0 * sum(each.solid.mass for each in (who.thigh, who.shank, who.foot))
        assert legs + who.rest == pytest.approx(70.0)
    light = who.scaled(shank={"mass": 0.5, "length": 0.9})
    assert light.shank.solid.inertia[2] == pytest.approx(who.shank.solid.inertia[2] * 0.5 * 0.81)
    assert light.thigh == who.thigh


WRONG = [
    (lambda m, a, b: parts.point_foot("leg", "foot", a), "mbd.Model"),
    (lambda m, a, b: parts.arc_foot(m, "foot", a, -0.1), "must be positive"),
    (lambda m, a, b: parts.heel_and_toe(m, "foot", a, "toe"), "toe of heel_and_toe"),
    (lambda m, a, b: parts.keel_foot(m, "foot", a, a, length=0.2, stiffness=-1.0, mass=0.1), "stiffness of keel_foot"),
    (lambda m, a, b: parts.locking_knee(m, "knee", a, 3), "shank of locking_knee"),
    (lambda m, a, b: parts.stop_knee(m, "knee", a, b, stop=1300.0), "dictionary of arguments"),
    (lambda m, a, b: parts.stop_knee(m, "knee", a, b, stop={"hardness": 1.0}), "hardness"),
    (lambda m, a, b: parts.hydraulic_knee(m, "knee", a, b, flexion="hard", extension=1.0), "backward of Valves"),
    (lambda m, a, b: parts.hydraulic_knee(m, "knee", a, b, flexion=mbd.Coulomb(1.0), extension=1.0), "sticks"),
    (lambda m, a, b: parts.pneumatic_knee(m, "knee", a, b, volume=1e-5, swept=1e-5), "empty in flexion by 57°"),
    (lambda m, a, b: parts.pneumatic_knee(m, "knee", a, b, volume=1e-4, swept=1e-5, exponent=1.0), "above 1"),
    (lambda m, a, b: parts.magnetorheological_knee(m, "k", a, b, torques={}, viscous=1.0, foot="f"), "stance flexion"),
    (lambda m, a, b: parts.tabulated_ankle(m, "ankle", a, b, angle=[0.0, 0.0], torque=[0.0, 1.0]), "must increase"),
    (lambda m, a, b: parts.bumper_ankle(m, "ankle", a, b, heel=3.0, toe={}), "heel bumper of 'ankle' is a dictionary"),
    (lambda m, a, b: parts.bumper_ankle(m, "ankle", a, b, heel=None, toe={}), "heel bumper of 'ankle' is a dictionary"),
    (
        lambda m, a, b: parts.bumper_ankle(m, "ankle", a, b, heel={"stifness": 1.0}, toe={}),
        "heel bumper of 'ankle': .*stifness.*; give arguments of mbd.Penalty",
    ),
    (lambda m, a, b: parts.elastic_socket(m, "fit", a, b, stiffness=3.0, damping=1.0), "stiffness"),
    (lambda m, a, b: parts.passive_moment(m, "l", mbd.Revolute("k", a, b), of="toe"), "knee"),
    (lambda m, a, b: parts.person(70.0, 1.75, "winter"), "Winter"),
    (lambda m, a, b: parts.person(-70.0, 1.75), "mass of person"),
    (lambda m, a, b: parts.person(70.0, 1.75).scaled(shin={}), "shank"),
    (lambda m, a, b: mbd.DCMotor("m", mbd.Revolute("k", a, b), 1.0, resistance=0.0, constant=1.0), "resistance"),
]


@pytest.mark.parametrize(("make", "told"), WRONG, ids=[told for _, told in WRONG])
def test_wrong_arguments_are_named(make, told):
    with pytest.raises(ModelError, match=told):
        make(*leg())


def test_an_unknown_part_is_named():
    with pytest.raises(AttributeError, match="locking_knee"):
        parts.locked_knee
