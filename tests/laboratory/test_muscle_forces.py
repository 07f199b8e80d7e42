"""Static optimization: conditions of an optimum, moments that are given, what is said where muscles are too weak."""

import numpy as np
import pytest
from scipy.optimize import minimize

import mbd
from mbd.laboratory.least_activation import least_activation


def arm(strength=1.0):
    """An arm of two links with six muscles, two of which cross both joints."""
    model = mbd.Model("arm")
    upper = mbd.Link("upper", mass=2.0, length=0.3, center=0.13, inertia=0.016)
    lower = mbd.Link("lower", mass=1.2, length=0.25, center=0.11, inertia=0.007)
    shoulder = mbd.Revolute("shoulder", model.ground.origin, upper.start)
    elbow = mbd.Revolute("elbow", upper.end, lower.start)
    model.connect(shoulder, elbow)
    g = model.ground
    paths = {
        "flexor": (0.12, (g.point(0.05, 0.02), upper.point(0.02, -0.12))),
        "extensor": (0.12, (g.point(-0.05, 0.02), upper.point(-0.02, -0.12))),
        "biceps": (0.35, (g.point(0.04, 0.03), lower.point(0.03, -0.04))),
        "triceps": (0.32, (g.point(-0.04, 0.0), upper.point(-0.02, -0.28), lower.point(-0.02, 0.02))),
        "brachialis": (0.17, (upper.point(0.015, -0.15), lower.point(0.02, -0.03))),
        "anconeus": (0.11, (upper.point(-0.02, -0.2), lower.point(-0.025, 0.0))),
    }
    for name, (length, path) in paths.items():
        model.apply(mbd.Muscle(name, path, 500.0 * strength, 0.5 * length, 0.5 * length, pennation=0.1))
    return model


TIME = np.linspace(0.0, 1.0, 21)
MOTION = {"time": TIME, "shoulder.angle": 0.4 + 0.3 * np.sin(5.0 * TIME), "elbow.angle": 0.8 + 0.4 * np.sin(6.0 * TIME)}


@pytest.mark.parametrize("strength", [8.0, 0.02])
def test_activations_are_optimal_and_give_the_moments(strength):
    """Of least Σ a³ + Σ (ρ/ρ₀)²: 3 a² = λ·G inside, more than that at a = 0, less at a = 1, with λ = 2 ρ/ρ₀²."""
    reserve = 0.5
    found = mbd.muscle_forces(arm(strength), MOTION, reserve=reserve)
    joints = ("shoulder.angle", "elbow.angle")
    given = dict.fromkeys(joints, 0.0)
    multiplier = {joint: 2.0 * found[f"{joint}.reserve"] / reserve**2 for joint in joints}
    for name in found.muscles:
        a, slope = found[f"{name}.activation"], 0.0
        for joint in joints:
            lever = found[f"{name}.moment_arm.{joint}"] if f"{name}.moment_arm.{joint}" in found else np.zeros(len(a))
            slope = slope + multiplier[joint] * lever * found[f"{name}.active_strength"]
            given[joint] = given[joint] + lever * found[f"{name}.force"]
        rest = 3.0 * a**2 - slope
        inside = (a > 1e-6) & (a < 1.0 - 1e-6)
        assert np.abs(rest[inside]).max(initial=0.0) < 1e-7
        assert rest[a <= 1e-6].min(initial=0.0) > -1e-7
        assert rest[a >= 1.0 - 1e-6].max(initial=0.0) < 1e-7
    for joint in joints:
        moment = found[f"{joint.removesuffix('.angle')}.moment"]
        np.testing.assert_allclose(given[joint] + found[f"{joint}.reserve"], moment, atol=1e-12)
    assert strength > 0.1 or "fully active" in " ".join(found.notes)


def test_one_muscle_of_one_joint_has_the_activation_that_moved_it():
    """A forward run of a muscle with a rigid tendon without delay, read backwards."""
    model = mbd.Model("forearm")
    body = mbd.Link("forearm", mass=1.5, length=0.35, center=0.16, inertia=0.016)
    model.connect(mbd.Revolute("elbow", model.ground.origin, body.start))
    model.apply(
        mbd.Muscle(
            "biceps", (model.ground.point(0.0, 0.3), body.point(0.02, -0.05)), 120.0, 0.14, 0.18, tendon="rigid",
            activation_time=0.0, deactivation_time=0.0, excitation=lambda t: 0.4 + 0.2 * mbd.sin(8.0 * t),
        )
    )  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, {"elbow.angle": 0.6}), tol=1e-9, until=0.4)
    found = mbd.muscle_forces(model, run, reserve=1e-3)
    np.testing.assert_allclose(found["biceps.activation"], 0.4 + 0.2 * np.sin(8.0 * run.time), atol=1e-5)
    assert "MuscleForces: 1 muscles" in repr(found)
    assert list(found.to_dataframe().columns) == ["biceps.activation", "biceps.force", "elbow.angle.reserve"]


def test_what_is_missing_is_named():
    model = arm()
    bare = model.without(*(force.name for force in model.forces))
    with pytest.raises(mbd.ModelError, match=r"'arm' has no mbd\.Muscle"):
        mbd.muscle_forces(bare, MOTION)
    with pytest.raises(mbd.ModelError, match="several mbd"):
        mbd.muscle_forces(bare, MOTION, muscles=["biceps"])
    with pytest.raises(mbd.ModelError, match="reserve is the moment"):
        mbd.muscle_forces(model, MOTION, reserve=0.0)
    with pytest.raises(mbd.UnknownNameError, match="biceps"):
        mbd.muscle_forces(model, MOTION)["bicep.force"]
    given = mbd.muscle_forces(bare, MOTION, muscles=model.forces)
    assert given["biceps.force"] == pytest.approx(mbd.muscle_forces(model, MOTION)["biceps.force"])


@pytest.mark.parametrize("seed", range(3))
def test_activations_are_those_of_scipy(seed):
    """Of random moments that 12 muscles give about 3 joints, by sequential quadratic programming."""
    rng, m, j = np.random.default_rng(seed), 12, 3
    moment, wanted = rng.normal(size=(4, j, m)) * 20.0, rng.normal(size=(4, j)) * 30.0
    found, reserves = least_activation(moment, wanted, 1.0, np.arange(4.0))
    for k in range(4):
        A = np.concatenate([moment[k], np.eye(j)], axis=1)
        optimum = minimize(
            lambda z: float(np.sum(z[:m] ** 3) + np.sum(z[m:] ** 2)), np.full(m + j, 0.1), method="SLSQP",
            jac=lambda z: np.concatenate([3.0 * z[:m] ** 2, 2.0 * z[m:]]), bounds=[(0.0, 1.0)] * m + [(None, None)] * j,
            constraints=[{"type": "eq", "fun": lambda z, A=A, w=wanted[k]: A @ z - w, "jac": lambda z, A=A: A}],
            options={"ftol": 1e-12, "maxiter": 500},
        )  # fmt: skip
        assert found[k] == pytest.approx(optimum.x[:m], abs=1e-4)
        assert reserves[k] == pytest.approx(optimum.x[m:], abs=1e-4)
        ours = np.sum(found[k] ** 3) + np.sum(reserves[k] ** 2)
        assert ours <= optimum.fun * (1.0 + 1e-9)


def test_parameters_of_muscles_may_differ_from_the_model():
    """Muscles of half the strength, by parameters, pull as those that are described with it."""
    names = ("flexor", "extensor", "biceps", "triceps", "brachialis", "anconeus")
    given = {f"{name}.max_force": 2000.0 for name in names}
    found, described = mbd.muscle_forces(arm(8.0), MOTION, parameters=given), mbd.muscle_forces(arm(4.0), MOTION)
    for name in names:
        np.testing.assert_allclose(found[f"{name}.force"], described[f"{name}.force"], rtol=1e-9, atol=1e-9)


def test_a_held_forearm_presses_on_its_elbow_with_its_muscle():
    """Level, with a vertical muscle 4 cm before the elbow: F = m g c / d, and the elbow is pressed by F − m g."""
    model = mbd.Model("forearm")
    forearm = mbd.Link("forearm", mass=2.0, length=0.35, center=0.16, inertia=0.02)
    model.connect(mbd.Revolute("elbow", model.ground.origin, forearm.start))
    model.apply(mbd.Muscle("biceps", (model.ground.point(0.04, 0.3), forearm.point(0.0, -0.04)), 900.0, 0.1, 0.2))
    found = mbd.muscle_forces(model, {"time": [0.0], "elbow.angle": [np.pi / 2]}, reserve=1e-6)
    weight = 2.0 * 9.81
    assert found["biceps.force"][0] == pytest.approx(weight * 0.16 / 0.04, rel=1e-9)
    assert found.moments["elbow.reaction_force"][0] == pytest.approx([0.0, weight, 0.0], abs=1e-12)
    pressed = found.with_muscles["elbow.reaction_force"][0]
    assert pressed == pytest.approx([0.0, weight - found["biceps.force"][0], 0.0], abs=1e-9)
    with pytest.raises(mbd.UnknownNameError, match=r"is there twice: found\.with_muscles\['elbow.reaction_force'\]"):
        found["elbow.reaction_force"]
    assert not [name for name in found if "reaction" in name]


def test_what_is_left_to_joints_while_muscles_pull_are_the_reserves():
    found = mbd.muscle_forces(arm(0.4), MOTION)
    size = np.abs(found["shoulder.moment"]).max()
    for joint in "shoulder", "elbow":
        left = found.with_muscles[f"{joint}.moment"]
        assert left == pytest.approx(found[f"{joint}.angle.reserve"], abs=1e-9 * size)
    # the biceps and the other muscles over the elbow press it; their forces balance on the forearm
    a, b = (each["elbow.reaction_force"] for each in (found.moments, found.with_muscles))
    over = sum(found[f"{name}.force"] for name in ("biceps", "triceps", "brachialis", "anconeus"))
    assert np.all(np.linalg.norm(b - a, axis=1) <= over + 1e-9)
    assert np.linalg.norm(b - a, axis=1).max() > 0.5 * over.max()
