"""Observations: what a function of the motion says, wherever results go, and nothing of the motion changes."""

import random

import numpy as np
import pytest
import sympy
from hypothesis import given, settings, strategies as st

import mbd
from mbd.errors import ModelError, TraceError, TrajectoryError
from mbd.testing.mechanisms import random_tree


def leg() -> tuple[mbd.Model, mbd.Revolute, mbd.Link]:
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.05)
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start), knee)
    model.constrain(mbd.Unilateral("stop", mbd.flexion(knee)))
    return model, knee, shank


def run_of(model: mbd.Model) -> mbd.Trajectory:
    start = mbd.assemble(model, position={"hip.angle": 1.0, "knee.angle": -0.1})
    return mbd.simulate(model, start, dt=1e-2, until=0.4, backend="python")


@settings(max_examples=8)
@given(seed=st.integers(0, 10_000))
def test_an_observation_is_the_function_of_the_results(seed):
    rng = random.Random(seed)
    model = random_tree(seed, bodies=2, spatial=seed % 2 == 0)
    body = next(reversed(model.bodies.values()))
    place = [rng.uniform(-1.0, 1.0) for _ in range(3)]
    point, end = body.point(*place, name="mark"), body.center
    (name, other), joint = (
        rng.choices([each for joint in model.joints for each in joint.coordinate_names], k=2),
        "joint 0",
    )
    force = f"{joint}.reaction_force.x"
    model.observe("waves", lambda t, a, b: mbd.sin(a) * b + t * t, "t", name, f"{other}.rate")
    model.observe("arm", lambda p, q: [u - v for u, v in zip(p, q, strict=True)], point, end, unit="m")
    model.observe("load", lambda f, w: f * w, force, "waves")
    model.observe("lift", lambda scope: scope.rate(scope.frame(point).position[1]), unit="m/s")
    model.observe("spin", lambda scope: scope.rate(scope.named(f"{name}.rate")))
    run = mbd.simulate(model, mbd.assemble(model), dt=1e-3, until=3e-3, backend="python")
    for read in run, run.at([0.0, 0.0017]):
        waves = np.sin(read[name]) * read[f"{other}.rate"] + read["t"] ** 2
        np.testing.assert_allclose(read["waves"], waves, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(read["arm"], read[point.full_name] - read[end.full_name], atol=1e-13)
        np.testing.assert_allclose(read["load"], read[force] * waves, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(read["lift"], read[f"{point.full_name}.vy"], atol=1e-12)
        np.testing.assert_allclose(read["spin"], read[f"{name}.acceleration"], atol=1e-12)


def test_the_motion_is_the_same_to_the_bit_and_costs_the_same():
    model, knee, shank = leg()
    plain, cost = run_of(model), repr(model.cost())
    model.observe("lift", mbd.height(shank.end))
    model.observe("bend", lambda angle: -angle, knee, unit="rad")
    model.observe("push", "stop.force", unit="N")
    run = run_of(model)
    assert repr(model.cost()) == cost and run.record.v.tobytes() == plain.record.v.tobytes()
    assert run.record.q.tobytes() == plain.record.q.tobytes() and [e.time for e in run.events]
    np.testing.assert_array_equal(run["push"], run["stop.force"])
    np.testing.assert_array_equal(run["bend"], -run["knee.angle"])
    assert run.to_xarray(["bend", "lift"])["bend"].attrs["units"] == "rad" and "lift [m]" in model.describe()


def test_expressions_and_mechanisms_given_by_energies_are_observed():
    y = mbd.Coordinate("y", unit="m")
    m, g = sympy.symbols("m g")
    ball = mbd.Lagrangian("ball", [y], m * y.v**2 / 2, m * g * y.q, parameters={m: 0.2, g: 9.81})
    ball.observe("momentum", m * y.v, unit="N s")
    ball.observe("weight", lambda a: -0.2 * a, "y.acceleration")
    assert ball.check() == [] and "momentum [N s]" in ball.describe()
    run = mbd.simulate(ball, mbd.assemble(ball, position={"y": 1.0}), dt=1e-2, until=0.1, backend="python")
    np.testing.assert_allclose(run["momentum"], 0.2 * run["y.rate"], rtol=1e-14)
    np.testing.assert_allclose(run["weight"], 0.2 * 9.81, rtol=1e-9)
    ball.observe("weight", "y")
    assert any("'weight' is used 2 times" in fault for fault in ball.check())


def test_a_controller_reads_an_observation():
    model, knee, _ = leg()
    model.observe("bend", lambda angle: -angle, "knee.angle")
    model.apply(mbd.Motor("drive", knee, torque=0.5))
    seen = []

    def law(t, read, memory):
        seen.append(read["bend"])
        return {}

    model.apply(mbd.Controller("law", law, period=0.1, reads=["bend"], writes=["drive.torque"]))
    run = run_of(model)
    np.testing.assert_allclose(seen[:3], -run.at([0.0, 0.1, 0.2], side="left")["knee.angle"], atol=1e-6)


def test_what_is_left_out_takes_its_observations_along():
    model, *_ = leg()
    model.observe("push", "stop.force")
    model.observe("bend", "knee.angle")
    assert [each.name for each in model.without("stop").observations] == ["bend"]
    assert [each.name for each in model.without("bend").observations] == ["push"]
    assert len(model.observations) == 2


def test_what_is_no_number_is_an_error_where_it_is_asked_for(tmp_path):
    model, *_ = leg()
    model.observe("root", lambda angle: mbd.sqrt(angle), "knee.angle")
    run = run_of(model)
    for ask in (lambda: run["root"], lambda: run.at(0.0)["root"]):
        with pytest.raises(TrajectoryError, match="observation 'root' is nan at t = 0 s, and no number at"):
            ask()
    assert np.isnan(run.to_dataframe(["root"])["root"].iloc[0])
    with pytest.raises(TrajectoryError, match="observation 'root'"):
        mbd.load(run.save(tmp_path / "leg"))["root"]


@pytest.mark.parametrize(
    ("name", "function", "arguments", "words"),
    [
        ("t", "knee.angle", (), "the results have 't'"),
        ("knee", "knee.angle", (), "the name 'knee' is used 2 times"),
        ("shank.end", "knee.angle", (), "holds no dot"),
        ("u", "knee.angel", (), "observation 'u': no result named 'knee.angel'; did you mean 'knee.angle'"),
        ("u", "u", (), "no result named 'u'"),
        ("u", lambda scope: "x", (), "gives 'x' where a number is expected"),
        ("u", lambda scope: None, (), "is a 'return' missing"),
        ("u", lambda scope: float("nan"), (), "not a finite number"),
        ("u", lambda scope: [scope.time], (), "one number or three components"),
        ("u", lambda a: 1.0 if a > 0.0 else 0.0, ("knee.angle",), "observation 'u'"),
        ("u", lambda a, b: a, ("knee.angle",), "called with 1 argument,"),
        ("u", lambda scope: scope.rate(scope.named("knee.reaction_force.x")), (), "the rate of a function of acc"),
        ("u", lambda scope: scope.frame(leg()[2].point(0.3, 0.7)).position, (), "name the point"),
        ("u", lambda p: p[0], (mbd.Link("arm", 1.0, 1.0, 0.5).end,), "a body that no joint connects"),
        ("u", lambda a: a, (("k", 3.0),), "belongs into the function"),
        ("u", mbd.height(mbd.Link("arm", 1.0, 1.0, 0.5).end), ("t",), "take no arguments"),
        ("u", 3.0, (), "takes a function"),
    ],
)  # fmt: skip
def test_a_wrong_observation_is_named(name, function, arguments, words):
    model, *_ = leg()

    def observed():
        model.observe(name, function, *arguments)
        run_of(model)

    with pytest.raises((ModelError, TraceError), match=words):
        observed()


@pytest.mark.parametrize("name", ["manager", "turns", "opening"])
def test_resets_know_observations_of_every_name(name):
    """Also of names under which a mechanism keeps something of its own."""
    model, read = mbd.Model("pendulum"), []
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(mbd.Revolute("hip", model.ground.origin, rod.start))
    model.observe(name, lambda angle: 2.0 * angle, "hip.angle")

    def reset(named):
        read.append((named[name], named["hip.angle"]))
        return {}

    model.constrain(mbd.Event("look", mbd.measure(lambda t: t - 0.05, "t"), reset=reset))
    mbd.simulate(model, mbd.assemble(model, {"hip.angle": 0.3}), dt=0.01, until=0.1)
    ((value, angle),) = read
    assert value == 2.0 * angle
