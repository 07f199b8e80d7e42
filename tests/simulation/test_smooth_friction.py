"""Friction of contacts that is smooth in the velocity: the tippe-top, Jellett's invariant, shared loads, impacts."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.joints.quaternions import rotation_of
from tests.problems import case

L4 = case("l4-tippe-top")
UP = mbd.Plane(normal=(0.0, 0.0, 1.0))
RK = mbd.RungeKutta853()


@lru_cache(maxsize=8)
def tippe_top(friction):
    """A ball whose center of mass is not its middle; see L4."""
    m, R, a, A, C, g = (L4.definition[name] for name in ("m", "R", "offset_a", "A", "C", "g"))
    model = mbd.Model("tippe-top", gravity=(0.0, 0.0, -g))
    body = mbd.RigidBody("top", m, (A, A, C))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    ball = mbd.sphere_touchdown(body.point(0.0, 0.0, a, name="middle"), R, UP)
    model.constrain(mbd.Unilateral("tip", ball, friction=friction))
    return model


def released(model, tilt, spin, velocity=(0.0, 0.0)):
    R, a = L4.definition["R"], L4.definition["offset_a"]
    speed = {"float.angular_velocity": spin, "float.x.rate": velocity[0], "float.y.rate": velocity[1]}
    place = {"float.z": R - a * np.cos(tilt), "float.orientation": ((0.0, 1.0, 0.0), tilt)}
    return mbd.assemble(model, position=place, velocity=speed, closed="tip")


def jellett(run):
    """L · (R e_z − a e), constant whatever the force at the point of contact is (Jellett 1872)."""
    R, a, A, C = (L4.definition[name] for name in ("R", "offset_a", "A", "C"))
    turned = np.array([rotation_of(each) for each in run["float.orientation"]])
    momentum = np.einsum("kij,kj->ki", turned, run["float.angular_velocity"] * [A, A, C])
    return np.einsum("ki,ki->k", momentum, R * np.array([0.0, 0.0, 1.0]) - a * turned[:, :, 2])


@pytest.mark.parametrize(("scheme", "how"), [(RK, {"tol": 1e-11}), (mbd.RadauIIA(), {"dt": 4e-4})])
def test_a_tippe_top_turns_over(scheme, how):
    model = tippe_top(mbd.Viscous(L4.definition["mu"]))
    run = mbd.simulate(model, released(model, L4.start["theta0"], tuple(L4.start["w_body"])), scheme, until=6.0, **how)
    assert not run.events
    tilt = L4["tilt of the axis"]
    at = run.at(np.array(tilt.t))
    axis = np.array([rotation_of(each) for each in at["float.orientation"]])[:, :, 2]
    place = np.column_stack([at[f"float.{name}"] for name in ("x", "y", "x.rate", "y.rate")])
    energy = at["kinetic_energy"] + at["potential_energy"]
    for name, found in (
        ("tilt of the axis", np.arccos(axis[:, 2])), ("symmetry axis", axis), ("mass centre", place),
        ("angular velocity", at["float.angular_velocity.ground"]), ("total energy", energy),
    ):  # fmt: skip
        assert np.max(np.abs(found - np.array(L4[name].value))) < L4[name].accuracy, name
    invariant = L4["Jellett's invariant"]
    assert np.max(np.abs(jellett(run) - invariant.value)) < max(invariant.accuracy, 1e-9 * invariant.value)


@settings(max_examples=8)
@given(
    friction=st.sampled_from([mbd.Viscous(0.3), mbd.Viscous(2.0), mbd.Coulomb(0.2, smoothing=0.02), 0.1]),
    tilt=st.floats(0.1, 2.8), spin=st.tuples(*[st.floats(-20.0, 20.0)] * 2, st.floats(-150.0, 150.0)),
    velocity=st.tuples(*[st.floats(-0.2, 0.2)] * 2),
)  # fmt: skip
def test_jelletts_invariant_holds_under_any_friction(friction, tilt, spin, velocity):
    model = tippe_top(friction)
    run = mbd.simulate(model, released(model, tilt, spin, velocity), RK, tol=1e-9, until=0.05, contact="events")
    R, a, A, C = (L4.definition[name] for name in ("R", "offset_a", "A", "C"))
    size = (R + a) * (max(A, C) * np.linalg.norm(spin) + 1e-6)
    assert np.max(np.abs(np.diff(jellett(run)))) < 1e-7 * size


@lru_cache(maxsize=8)
def slider(friction, axes="xyz"):
    model = mbd.Model("slider", gravity=(0.0, -10.0, 0.0))
    mass = mbd.PointMass("block", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, mass.origin, axes=axes))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin), friction=friction, restitution=0.5))
    return model


@pytest.mark.parametrize("axes", ["xy", "xyz"])
def test_speed_dies_out_as_the_law_says(axes):
    """v' = −μ g v; v' = −g (c + μ v), which stops."""
    for friction, end in (
        (mbd.Viscous(0.3), np.exp(-1.5)),
        (mbd.Coulomb(0.05) + mbd.Viscous(0.3), (1.0 + 1.0 / 6.0) * np.exp(-1.5) - 1.0 / 6.0),
        (mbd.Coulomb(0.2) + mbd.Viscous(0.5), 0.0),
    ):
        model = slider(friction, axes)
        run = mbd.simulate(
            model, mbd.assemble(model, velocity={"slide.x": 1.0}, closed="foot"), mbd.RadauIIA(), dt=5e-3, until=0.5
        )
        assert run["slide.x.rate"][-1] == pytest.approx(end, abs=1e-9)
        assert run["foot.friction"][0] == pytest.approx(run["foot.friction.forward"][0], abs=0.0)
        assert abs(run.energy.numerical[-1]) < 1e-7
        if end == 0.0:  # v' = −g (0.2 + 0.5 v)
            assert [event.kind for event in run.events] == ["stuck"]
            assert run.events[0].time == pytest.approx(np.log(3.5) / 5.0, abs=1e-9)


def test_parameters_are_those_of_the_loss_and_run_times_inputs():
    model = slider(mbd.Viscous(0.3))
    start = mbd.assemble(model, velocity={"slide.x": 1.0}, closed="foot")
    assert model.parameters["foot friction.coefficient"] == 0.3
    run = mbd.simulate(model, start, RK, dt=0.01, until=0.5, parameters={"foot friction.coefficient": 0.1})
    assert run["slide.x.rate"][-1] == pytest.approx(np.exp(-0.5), abs=1e-10)
    with pytest.raises(mbd.ModelError, match="coefficient -1"):
        mbd.simulate(model, start, RK, dt=0.01, until=0.5, parameters={"foot friction.coefficient": -1.0})


@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
def test_impacts_know_no_smooth_friction(law):
    model = slider(mbd.Viscous(0.3))
    start = mbd.assemble(model, position={"slide.y": 0.01}, velocity={"slide.x": 1.0, "slide.y": -1.0})
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-3, until=0.05, impact=law)
    assert run.events[0].kind == "closed"
    assert run["slide.x.rate"][-1] == 1.0
    assert abs(run.energy.numerical[-1]) < 1e-9


def test_feet_that_share_a_load_slide_alike_by_every_scheme_and_the_twin():
    model = mbd.Model("table")
    body = mbd.RigidBody("body", 2.0, (0.02, 0.02, 0.02))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    feet = [f"foot {k}" for k in range(4)]
    for foot, (x, z) in zip(feet, ((0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)), strict=True):
        floor = mbd.touchdown(body.point(x, -0.05, z))
        model.constrain(mbd.Unilateral(foot, floor, friction=mbd.Viscous(0.2)))
    speed = {"float.x.rate": 1.0, "float.z.rate": 0.5, "float.angular_velocity.y": 3.0}
    start = mbd.assemble(model, position={"float.y": 0.05}, velocity=speed, closed=feet)
    exact = mbd.simulate(model, start, RK, dt=0.01, until=0.05)
    assert sum(exact[f"{foot}.force"][-1] for foot in feet) == pytest.approx(2.0 * 9.81, rel=1e-12)
    for scheme, bound in ((mbd.RadauIIA(), 1e-9), (mbd.HHT(0.05), 1e-4)):
        run = mbd.simulate(model, start, scheme, dt=0.01, until=0.05)
        twin = mbd.simulate(model, start, scheme, dt=0.01, until=0.05, backend="python")
        for name in ("float.x.rate", "float.z.rate", *(f"{foot}.force" for foot in feet)):
            assert run[name][-1] == pytest.approx(exact[name][-1], rel=bound)
            assert twin[name][-1] == pytest.approx(run[name][-1], rel=1e-7)


def test_what_is_no_friction_of_a_contact_is_refused_by_name():
    body = mbd.RigidBody("body", 1.0, 1.0)
    with pytest.raises(mbd.ModelError, match="friction of 'foot'.*follows the force in a joint"):
        mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=mbd.PinFriction(0.3, 0.01))
