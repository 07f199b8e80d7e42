"""Muscles: curves against OpenSim's, moment arms against differences, equilibrium, order of schemes, energy."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.forces.muscles.curves import CURVES
from tests.helpers import one_body

OPENSIM = {  # of OpenSim 4.6; De Groote's by its class of 2016, Millard's by its curves with a least active force of 0
    "de groote": {
        "active": {0.8: 0.8364395661, 1.2: 0.7936897181},
        "passive": {1.2: 0.0694011612},
        "speed": {-0.5: 0.2340363935, 0.5: 1.5884234012},
        "tendon": {1.02: 0.2155686246},
    },
    "millard": {
        "active": {0.3: 0.0, 0.45: 4.86937283390155e-05, 0.5: 0.09853248961876138, 0.6: 0.4511018783255816,
                   0.75: 0.8260375363513255, 1.1: 0.957375532280429, 1.6: 0.26302688371190536,
                   1.8: 0.0009943143705208432},
        "passive": {0.9: 0.0, 1.01: 9.529054962971643e-05, 1.2: 0.04969203020562088, 1.5: 0.4602615047912092,
                    1.9: 1.5714285714285712},
        "speed": {-1.1: 0.0, -0.95: 0.0028515625, -0.5: 0.15808560444169842, -0.05: 0.7719217036160186, 0.0: 1.0,
                  0.05: 1.172345715223604, 0.3: 1.2947073906241897, 0.95: 1.3991328125, 1.2: 1.4},
        "tendon": {0.98: 0.0, 1.005: 0.03760449363141661, 1.02: 0.2609359826149298, 1.049: 1.0,
                   1.08: 1.869897959183676},
    },
}  # fmt: skip
EXACT = {"de groote": 1e-10, "millard": 1e-8}


@pytest.mark.parametrize("name", OPENSIM)
def test_curves_are_those_of_OpenSim(name):
    for curve, values in OPENSIM[name].items():
        for x, y in values.items():
            assert getattr(CURVES[name], curve)(x) == pytest.approx(y, abs=EXACT[name])


@pytest.mark.parametrize(("name", "least"), [("de groote", 1e-3), ("millard", 0.01)])
def test_fibers_have_the_velocity_at_which_they_carry_their_load(name, least):
    curves, rng = CURVES[name], np.random.default_rng(3)
    active, load = 10.0 ** rng.uniform(-6.0, 0.1, 60), rng.uniform(-1.5, 2.5, 60)
    for damping in least, 0.1, 0.5:
        for A, f in zip(active, load, strict=True):
            v = float(curves.velocity(A, damping, f, damped=True))
            carried = float(A * curves.speed(v) + damping * v)
            assert carried == pytest.approx(f, abs=1e-13 * (1.0 + abs(f) + v * v))


def forearm(**how):
    """A forearm that hangs from an elbow, with a biceps; `how` changes the muscle."""
    model, arm = one_body(mbd.Link("arm", mass=1.5, length=0.35, center=0.16, inertia=0.016), mbd.Revolute, "elbow")
    elbow = model.joints[0]
    points = (model.ground.point(0.0, 0.30), arm.point(0.01, -0.05))
    given = {"max_force": 600.0, "fiber_length": 0.12, "tendon_length": 0.2, "pennation": 0.2} | how
    path = given.pop("path", points)
    model.apply(mbd.Muscle("biceps", path(model, arm, elbow) if callable(path) else path, **given))
    return model


def leg_extension(**how):
    """A shank that is extended against its weight by a quadriceps over a patella that moves with the knee."""
    model, shank = one_body(
        mbd.Link("shank", mass=4.0, length=0.43, center=0.19, inertia=0.06), mbd.Revolute, "knee", title="leg extension"
    )

    def patella(angle):
        return 0.05 * mbd.cos(0.5 * angle), 0.05 * mbd.sin(0.5 * angle)

    path = (
        model.ground.point(0.03, 0.3),
        mbd.ViaPoint(model.ground.point(0.0, 0.02), place=patella, arguments=("knee.angle",)),
        shank.point(0.04, -0.06),
    )
    given = {"max_force": 3000.0, "fiber_length": 0.1, "tendon_length": 0.25, "pennation": 0.1} | how
    model.apply(mbd.Muscle("quadriceps", path, **given))
    return model


def start_of(model, angle, activation):
    """At rest with fibers in equilibrium."""
    (muscle,) = model.forces
    joint = model.joints[0].name
    values = {f"{joint}.angle": angle}
    length = mbd.assemble(model, values)[f"{muscle.name}.length"]
    if muscle.is_delayed:
        values[f"{muscle.name}.activation"] = activation
    if muscle.is_elastic:
        values[f"{muscle.name}.fiber_length"] = muscle.fiber_at(length, activation)
    return mbd.assemble(model, values)


def conditional(model, arm, elbow):
    return (
        model.ground.point(0.0, 0.3),
        mbd.ViaPoint(model.ground.point(0.02, 0.01), elbow, (-3.0, 0.2)),
        arm.point(0.02, -0.03),
        arm.point(0.01, -0.05),
    )


PATHS = {
    "points": lambda model, arm, elbow: (model.ground.point(0.0, 0.3), arm.point(0.01, -0.05)),
    "conditional": conditional,
    "moving": lambda model, arm, elbow: (
        model.ground.point(0.0, 0.3),
        mbd.ViaPoint(arm.origin, place=(lambda q: 0.02 + 0.01 * q, 0.01, 0.0),
                     arguments=("elbow.angle",)),
        arm.point(0.01, -0.05),
    ),
    "polynomial": lambda model, arm, elbow: mbd.PolynomialPath(elbow, {0: 0.31, 1: -0.03, 2: -0.01, 3: 0.004}),
}  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_the_moment_arm_is_minus_the_slope_of_the_length(path):
    now = {"activation_time": 0.0, "deactivation_time": 0.0, "excitation": 0.4}
    model = forearm(path=PATHS[path], tendon="rigid", tendon_length=0.18, **now)
    angles = np.linspace(-0.3, 1.2, 9)
    h = 1e-3
    steps = h * np.array([-3, -2, -1, 1, 2, 3])
    weights = np.array([-1, 9, -45, 45, -9, 1]) / (60.0 * h)
    for angle in angles:
        around = [mbd.assemble(model, {"elbow.angle": angle + step})["biceps.length"] for step in steps]
        held = mbd.muscle_forces(model, {"time": [0.0], "elbow.angle": [angle]})
        arm = held["biceps.moment_arm.elbow.angle"][0]
        assert arm == pytest.approx(-float(weights @ around), abs=2e-12)
        if path == "polynomial":
            assert arm == pytest.approx(0.03 + 0.02 * angle - 0.012 * angle**2, rel=1e-14)
        # what acts in the equations of motion is the arm times the force
        without = mbd.inverse_dynamics(model.without("biceps"), {"time": [0.0], "elbow.angle": [angle]})
        within = mbd.inverse_dynamics(model, {"time": [0.0], "elbow.angle": [angle]})
        share = without["elbow.moment"][0] - within["elbow.moment"][0]
        assert share == pytest.approx(arm * within["biceps.force"][0], rel=1e-11)


@pytest.mark.parametrize("curves", ["de groote", "millard"])
def test_a_muscle_at_rest_carries_its_weight(curves):
    """The load hangs on the muscle alone: F = m g, with the fibers where F_max f_T says."""
    model, load = one_body(mbd.PointMass("load", mass=20.0), mbd.Translation, "rail", title="hanging", axes="y")
    muscle = mbd.Muscle("muscle", (model.ground.point(0.0, 1.0), load.origin), 800.0, 0.1, 0.2, 0.2, 0.3, curves=curves)
    model.apply(muscle)
    start = mbd.assemble(model, {"rail.y": 0.7, "muscle.activation": 0.3, "muscle.fiber_length": 0.11})
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-9, until=15.0)
    assert run["muscle.force"][-1] == pytest.approx(20.0 * 9.81, rel=1e-6)
    length = run["muscle.length"][-1]
    assert muscle.fiber_at(length, 0.3) == pytest.approx(run["muscle.fiber_length"][-1], rel=1e-6)


def test_a_muscle_without_damping_is_the_limit_of_small_damping():
    """OpenSim's muscles of De Groote have no damping unless a file gives some."""
    ends = []
    for damping in 0.0, 1e-9:
        model, load = one_body(mbd.PointMass("load", mass=20.0), mbd.Translation, "rail", title="hanging", axes="y")
        points = (model.ground.point(0.0, 1.0), load.origin)
        muscle = mbd.Muscle("muscle", points, 800.0, 0.1, 0.2, 0.2, 0.3, damping=damping)
        model.apply(muscle)
        fibers = {"muscle.activation": 0.3, "muscle.fiber_length": muscle.fiber_at(0.3, 0.3)}
        start = mbd.assemble(model, {"rail.y": 0.7, **fibers})
        ends.append(mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.1)["muscle.fiber_length"])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-8)


def test_a_slack_muscle_has_no_length_of_fibers_at_rest():
    ground = mbd.Model("slack").ground
    muscle = mbd.Muscle("muscle", (ground.point(0.0, 1.0), ground.point(0.0, 0.0)), 800.0, 0.1, 0.2)
    with pytest.raises(mbd.ModelError, match="slack at length 0.1 m"):
        muscle.fiber_at(0.1, 0.5)
    values = {"fiber_length": 0.08, "tendon_length": 0.22, "pennation": 0.3}
    other = dataclasses.replace(muscle, **values)
    given = {f"muscle.{name}": value for name, value in values.items()}
    assert muscle.fiber_at(0.32, 0.5, given) == other.fiber_at(0.32, 0.5) != muscle.fiber_at(0.32, 0.5)
    with pytest.raises(mbd.ModelError, match="length of 'muscle' must be finite"):
        muscle.fiber_at(math.nan, 0.5)


def test_activation_follows_the_published_equation():
    """Held still, so that only the activation moves: against scipy's solution of the equation."""
    from scipy.integrate import solve_ivp

    model = forearm(excitation=lambda t: 0.5 + 0.4 * mbd.sin(20.0 * t))
    run = mbd.simulate(model, start_of(model, 0.5, 0.1), mbd.RungeKutta853(), tol=1e-11, until=0.2)

    def rate(t, a):
        e = 0.5 + 0.4 * math.sin(20.0 * t)
        f, scale = 0.5 * np.tanh(10.0 * (e - a)), 0.5 + 1.5 * a
        return (e - a) * ((f + 0.5) / (0.015 * scale) + (0.5 - f) * scale / 0.06)

    exact = solve_ivp(rate, (0.0, 0.2), [0.1], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
    assert run["biceps.activation"][-1] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize(
    ("scheme", "order", "dts"),
    [(mbd.RungeKutta4(), 4, (2e-3, 1e-3, 5e-4)), (mbd.HHT(alpha=0.05), 2, (2e-3, 1e-3, 5e-4))],
    ids=["RungeKutta4", "HHT"],
)
@pytest.mark.parametrize("build", [forearm, leg_extension])
def test_schemes_keep_their_order_on_what_muscles_move(build, scheme, order, dts):
    model = build(excitation=lambda t: 0.3 + 0.2 * mbd.sin(9.0 * t))
    angle = {"arm": 0.6, "leg extension": -1.2}[model.name]
    start = start_of(model, angle, 0.3)
    name = f"{model.joints[0].name}.angle"
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-12, until=0.2)[name][-1]
    errors = [abs(mbd.simulate(model, start, scheme, dt=dt, until=0.2)[name][-1] - exact) for dt in dts]
    assert abs(exact - angle) > 0.05
    assert math.log2(errors[0] / errors[-1]) / 2 == pytest.approx(order, abs=0.2)


def energy(model, run):
    """Kinetic and potential energy with that of tendon and passive fibers, by the integrals of De Groote's curves."""
    (m,) = model.forces
    c = CURVES["de groote"]
    x, w = np.polynomial.legendre.leggauss(40)
    fiber, path = run[f"{m.name}.fiber_length"], run[f"{m.name}.length"]
    along = np.sqrt(fiber**2 - (m.fiber_length * np.sin(m.pennation)) ** 2)

    def work(curve, length):
        middle, half = 0.5 * (length + 1.0), 0.5 * (length - 1.0)
        return half * sum(wk * curve(middle + half * xk) for xk, wk in zip(x, w, strict=True))

    tendon = m.max_force * m.tendon_length * work(c.tendon, (path - along) / m.tendon_length)
    passive = m.max_force * m.fiber_length * work(c.passive, fiber / m.fiber_length)
    return run["kinetic_energy"] + run["gravity.energy"] + tendon + passive


@pytest.mark.parametrize("build", [forearm, leg_extension])
def test_a_muscle_that_is_not_excited_gives_no_energy(build):
    model = build(excitation=0.0)
    start = start_of(model, {"arm": 0.9, "leg extension": -1.3}[model.name], 0.0)
    run = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-9, until=0.3)
    whole = energy(model, run)
    assert whole[-1] < whole[0] - 1e-3
    assert np.diff(whole).max() < 1e-7 * np.ptp(whole)


@pytest.mark.parametrize("curves", ["de groote", "millard"])
@pytest.mark.parametrize("tendon", ["elastic", "rigid"])
def test_the_ledger_holds_the_work_of_muscles(curves, tendon):
    model = forearm(excitation=lambda t: 0.4 + 0.3 * mbd.sin(9.0 * t), curves=curves, tendon=tendon)
    run = mbd.simulate(model, start_of(model, 0.6, 0.4), mbd.RungeKutta853(), tol=1e-9, until=0.4)
    change = np.diff((run["kinetic_energy"] + run["gravity.energy"])[[0, -1]])[0]
    assert run.energy["biceps"][-1] == pytest.approx(change, rel=1e-6)
    assert abs(change) > 1e-2


WRONG = {
    "two points": {"path": lambda m, a, e: (a.origin,)},
    "max_force": {"max_force": -1.0},
    "tendon of": {"tendon": "stiff"},
    "curves of": {"curves": "hill"},
    "excitation": {"excitation": 1.5},
    "both 0 or both positive": {"activation_time": 0.0},
    "damping must be": {"curves": "millard", "damping": 0.0},
    "cannot be conditional": {"path": lambda m, a, e: (m.ground.origin, mbd.ViaPoint(a.end, e, (0.0, 1.0)))},
    "pennation": {"pennation": 1.6},
}


@pytest.mark.parametrize("sentence", WRONG)
def test_wrong_values_are_refused_when_it_is_made(sentence):
    with pytest.raises(mbd.ModelError, match=sentence):
        forearm(**WRONG[sentence])


def test_polynomials_are_fitted_to_lengths():
    hip = mbd.Revolute("hip", mbd.Link("a", 1.0, 0.4, 0.2).end, mbd.Link("b", 1.0, 0.4, 0.2).start)
    knee = mbd.Revolute("knee", mbd.Link("c", 1.0, 0.4, 0.2).end, mbd.Link("d", 1.0, 0.4, 0.2).start)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 2))
    length = 0.4 - 0.05 * q[:, 0] + 0.03 * q[:, 1] + 0.01 * q[:, 0] * q[:, 1] ** 2
    path = mbd.PolynomialPath.fitted([hip, knee], q, length, 3)
    assert dict(path.terms)[1, 2] == pytest.approx(0.01, abs=1e-12)
    with pytest.raises(mbd.ModelError, match="give more"):
        mbd.PolynomialPath.fitted([hip, knee], q[:5], length[:5], 3)
    with pytest.raises(mbd.ModelError, match="whole numbers"):
        mbd.PolynomialPath([hip, knee], {(1,): 0.1})


@pytest.mark.parametrize(
    ("coordinates", "degree", "told"),
    [(np.zeros((5, 1)), 1.5, "degree"), (np.zeros((5, 1)), -1, "degree"), (np.full((5, 1), np.nan), 1, "finite")],
)
def test_a_fit_of_a_path_names_what_is_wrong(coordinates, degree, told):
    model = forearm()
    with pytest.raises(mbd.ModelError, match=told):
        mbd.PolynomialPath.fitted(model.joints[0], coordinates, np.zeros(5), degree)


def test_damping_below_that_of_the_curves_is_refused_as_a_parameter_too():
    model = forearm(curves="millard")
    start = start_of(model, 0.5, 0.1)
    with pytest.raises(mbd.ModelError, match="damping 0.001 is below 0.01"):
        mbd.simulate(model, start, dt=1e-3, until=0.01, parameters={"biceps.damping": 0.001})


def test_a_derivative_by_fiber_length_says_that_it_is_not_that_by_the_optimal_length_of_the_same_name() -> None:
    model, name = forearm(), "biceps.fiber_length"
    start = start_of(model, 0.4, 0.3)
    how: Any = {"integrator": mbd.RungeKutta853(), "dt": 1e-3, "until": 0.1}

    def ends(state: float = 0.0, optimal: float = 0.0) -> Any:
        place = {"elbow.angle": 0.4, "biceps.activation": 0.3, name: float(start[name]) + state}
        begun = mbd.assemble(model, place, parameters={name: 0.12 + optimal})
        return mbd.simulate(model, begun, **how).final["elbow.angle"]

    with pytest.warns(mbd.MbdWarning, match=r"'biceps.fiber_length' is a state of the start and a run-time parameter"):
        found = mbd.sensitivities(model, start, **how, wrt=[name, {"optimal": {name: 1.0}}], of=["elbow.angle"])
    for each, label in ("state", name), ("optimal", "optimal"):
        near, far = (ends(**{each: h}) - ends(**{each: -h}) for h in (1e-5, 2e-5))
        np.testing.assert_allclose(found["elbow.angle", label], (8.0 * near - far) / 1.2e-4, rtol=1e-6)
