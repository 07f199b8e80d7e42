"""A value of a parameter is refused or accepted alike wherever it is given, and then makes the same motion."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy

import mbd
from mbd.bodies.base import Body
from mbd.constraints.base import Constraint
from mbd.constraints.restitution import MIN_RESTITUTION, chi_for, restitution_of_chi
from mbd.joints.base import Joint
from mbd.joints.losses.base import Loss

DOORS = ("assemble", "simulate", "linearize", "sweep", "state", "controller")
"""Where a value is given that differs from the model's."""
PLAIN: dict[str, Any] = {"backend": "python"}


@dataclass(frozen=True)
class Place:
    """A parameter, a model that is described with a value of it, and a value that suits it.

    rows : whether it enters rows that are active, which a controller cannot shift
    """

    name: str
    model: Callable[[Any], mbd.Model]
    usual: float = 0.7
    rows: bool = False


def scene(*words: Any, body: Body | None = None, joint: Any = None, gravity: Any = (0.3, -9.81, 0.0)) -> mbd.Model:
    """A body on a joint, and functions that make words of the model, the joint and a frame of the body."""
    model = mbd.Model("scene", gravity=gravity)
    body = mbd.RigidBody("box", 2.0, 0.4, (0.2, 0.1, 0.0)) if body is None else body
    model.connect(mbd.Planar("float", model.ground.origin, body.origin) if joint is None else joint(model, body))
    for word in words:
        made = word(model, model.joints[0], body)
        (model.constrain if isinstance(made, Constraint) else model.apply)(made)
    return model


def hinge(loss: Any = None, **more: Any) -> Callable[[mbd.Model, Any], Joint]:
    return lambda model, body: mbd.Revolute("hinge", model.ground.origin, body.origin, loss=loss, **more)


def by_force(make: Callable[[Any, Any, Any], Callable[..., Any]]) -> Any:
    """A scene with a force or constraint of a value, on a body that floats far from the ground's origin."""
    return lambda value: scene(lambda model, joint, body: make(value, model, body)(joint))


def on_hinge(make: Callable[[Any, Any], Any]) -> Any:
    return lambda value: scene(lambda model, joint, body: make(value, joint), joint=hinge())


def end(model: mbd.Model) -> Any:
    return model.ground.point(-3.0, 0.5, 0.0, "wall")


def lossy(loss: Callable[[Any], Loss]) -> Any:
    return lambda value: scene(joint=hinge(loss(value)))


def link(**given: Any) -> mbd.Model:
    fields = {"mass": 2.0, "length": 1.0, "center": 0.4, "inertia": 0.3, **given}
    return scene(body=mbd.Link("rod", **fields), joint=hinge())


def block(*words: Any, **more: Any) -> mbd.Model:
    """A box well above the ground, with a contact."""
    place = lambda model, body: mbd.Translation("place", model.ground.point(0.0, 2.0, 0.0, "above"), body.origin)  # noqa: E731
    return scene(*words, body=mbd.PointMass("box", 2.0), joint=place, **more)


def contact(**given: Any) -> mbd.Model:
    return block(lambda model, joint, body: mbd.Unilateral("foot", mbd.touchdown(body.origin), **given))


def mat(**given: Any) -> mbd.Model:
    fields = {"stiffness": 900.0, **given}
    return block(lambda model, joint, body: mbd.Penalty("mat", mbd.height(body.origin), **fields))


def restitution(value: Any) -> mbd.Model:
    """A mat described by its restitution, for a value of χ."""
    if not isinstance(value, float) or not math.isfinite(value):
        return mat(restitution=value)
    inside = 0.0 < value < 1.0 / MIN_RESTITUTION
    return mat(restitution=restitution_of_chi(value) if inside else 0.01 if value > 0.0 else 1.0 - value)


def flat(aside: Any) -> mbd.Model:
    """A planar body whose foot may lie out of the plane, so that it also sticks sideways."""
    foot = lambda model, joint, body: mbd.Unilateral("foot", mbd.touchdown(body.point(0.0, -0.1, aside, "toe")))  # noqa: E731
    model = scene(foot)
    model.joints[0] = mbd.Planar("float", model.ground.point(0.0, 2.0, 0.0, "above"), model.joints[0].child)
    return model


def wheel(radius: Any) -> mbd.Model:
    return scene(lambda model, joint, body: mbd.Rolling("wheel", body.origin, radius))


def bead(value: Any) -> mbd.Lagrangian:
    """A bead on a straight wire with a spring, in sympy, whose mass must be positive."""
    x = mbd.Coordinate("x", unit="m")
    m, k = sympy.symbols("m k")
    return mbd.Lagrangian(
        "bead", [x], m * x.v**2 / 2, k * (x.q - 0.4) ** 2 / 2,
        parameters={m: value, k: 3.0}, domains={m: mbd.Domain(low=0.0, excluded=(0.0,), unit="kg")},
    )  # fmt: skip


PLACES = [
    Place("m", bead),
    Place("box.mass", lambda v: scene(
        body=mbd.PointMass("box", v), joint=lambda m, b: mbd.Translation("place", m.ground.origin, b.origin))),
    Place("rod.mass", lambda v: link(mass=v)),
    Place("rod.length", lambda v: link(length=v)),
    Place("rod.center", lambda v: link(center=v)),
    Place("rod.inertia", lambda v: link(inertia=v)),
    Place("rod.inertia.xx", lambda v: link(inertia=(v, 0.5, 0.6))),
    Place("rod.inertia.xy", lambda v: link(inertia=(0.6, 0.5, 0.6, v, 0.0, 0.0)), 0.1),
    Place("slab.mass", lambda v: scene(body=mbd.RigidBody("slab", v, 0.3, (0.1, 0.2, 0.0)))),
    Place("slab.center.x", lambda v: scene(body=mbd.RigidBody("slab", 2.0, 0.3, (v, 0.2, 0.0)))),
    Place("slab.inertia", lambda v: scene(body=mbd.RigidBody("slab", 2.0, v, (0.1, 0.2, 0.0)))),
    Place("slab.inertia.zz", lambda v: scene(body=mbd.RigidBody("slab", 2.0, (0.3, 0.5, v), (0.1, 0.2, 0.0)))),
    Place("gravity.x", lambda v: scene(gravity=(v, -9.0, 0.0))),
    Place("ground.wall.x", by_force(lambda v, m, b: lambda joint: mbd.Spring(
        "pull", m.ground.point(v, 5.0, 0.0, "wall"), b.origin, 50.0, 0.3))),
    Place("hinge spring.stiffness", lambda v: scene(joint=hinge(stiffness=v))),
    Place("hinge spring.rest", lambda v: scene(joint=hinge(stiffness=3.0, rest=v))),
    Place("hinge spring.rest", lambda v: scene(joint=hinge(rest=v))),
    Place("box.toe.z", flat, 0.0),
    Place("nut.pitch", lambda v: scene(joint=lambda m, b: mbd.Screw("nut", m.ground.origin, b.origin, v),
                                       body=mbd.RigidBody("box", 2.0, (0.3, 0.4, 0.5)))),
    Place("hinge loss.coefficient", lossy(mbd.Viscous)),
    Place("hinge loss.quadratic.coefficient", lossy(lambda v: mbd.Viscous(0.3) + mbd.Quadratic(v))),
    Place("hinge loss.torque", lossy(mbd.Coulomb)),
    Place("hinge loss.smoothing", lossy(lambda v: mbd.Coulomb(0.4, smoothing=v))),
    Place("hinge loss.mu", lossy(lambda v: mbd.PinFriction(v, 0.02))),
    Place("hinge loss.radius", lossy(lambda v: mbd.PinFriction(0.3, v)), 0.02),
    Place("pull.stiffness", by_force(lambda v, m, b: lambda joint: mbd.Spring("pull", end(m), b.origin, v, 0.3))),
    Place("pull.length", by_force(lambda v, m, b: lambda joint: mbd.Spring("pull", end(m), b.origin, 50.0, v))),
    Place("pull.coefficient", by_force(lambda v, m, b: lambda joint: mbd.Damper(
        "pull", end(m), b.origin, mbd.Viscous(v)))),
    Place("coil.stiffness", on_hinge(lambda v, joint: mbd.TorsionSpring("coil", joint, v))),
    Place("coil.rest", on_hinge(lambda v, joint: mbd.TorsionSpring("coil", joint, 3.0, v))),
    Place("drive.torque", on_hinge(lambda v, joint: mbd.Motor("drive", joint, v))),
    Place("well.depth", on_hinge(lambda v, joint: mbd.Potential(
        "well", lambda angle, depth: depth * angle**2, ["hinge.angle", ("depth", v)]))),
    Place("push.force.y", by_force(lambda v, m, b: lambda joint: mbd.Applied("push", b.origin, force=(1.0, v)))),
    Place("hold.value", on_hinge(lambda v, joint: mbd.Bilateral("hold", joint, v)), rows=True),
    Place("edge.bias", by_force(lambda v, m, b: lambda joint: mbd.Nonholonomic(
        "edge", lambda rate: rate, v, ["float.x.rate"])), rows=True),
    Place("wheel.radius", wheel),
    Place("foot.mu", lambda v: contact(friction=v)),
    Place("mat.stiffness", lambda v: mat(stiffness=v)),
    Place("mat.damping", lambda v: mat(damping=v)),
    Place("mat.chi", restitution, chi_for(0.6)),
]  # fmt: skip

NUMBERS = (-3.0, -1e-9, 0.0, 2.5, 40.0, Fraction(1, 3))
NO_NUMBERS = (float("nan"), float("inf"), -float("inf"), 10**400, "0.5", True, np.True_, None, 1j, [0.5], np.ones(1))


def refused(attempt: Callable[[], Any]) -> str:
    """The message with which something is refused, '' if it is not."""
    try:
        attempt()
    except mbd.MbdError as error:
        return str(error)
    return ""


def assembled(model: mbd.Model, parameters: Any = None) -> mbd.State:
    model.require_valid()
    return mbd.assemble(model, parameters=parameters, **PLAIN)


def simulated(model: mbd.Model, start: mbd.State, **more: Any) -> mbd.Trajectory:
    return mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=3e-3, **PLAIN, **more)


@cache
def written_to(place: Place) -> tuple[mbd.Model, dict[str, Any]]:
    """The usual model with a controller, and what that writes."""
    model, values = place.model(place.usual), {}
    model.apply(mbd.Controller("writer", lambda *_: values, period=1.0, writes=place.name))
    return model, values


def through(door: str, place: Place, model: mbd.Model, start: mbd.State, value: Any) -> Callable[[], Any]:
    """Give a value of a parameter of a described model."""
    given = {place.name: value}

    def consistent(_: Any = None) -> mbd.State:  # which a parameter of a row asks for
        return assembled(model, given) if place.rows else start

    def swept() -> None:
        run = mbd.sweep(
            model, {place.name: [value]}, consistent, integrator=mbd.HHT(0.05), dt=1e-3, until=3e-3, **PLAIN
        )
        if not run.success[0]:
            raise mbd.ModelError([run.messages[0]])

    def written() -> mbd.Trajectory:
        driven, values = written_to(place)
        values[place.name] = value
        return simulated(driven, start)

    return {
        "assemble": lambda: assembled(model, given),
        "simulate": lambda: simulated(model, consistent(), parameters=given),
        "linearize": lambda: mbd.linearize(model, consistent(), parameters=given, **PLAIN),
        "sweep": swept,
        "state": lambda: simulated(model, replace(consistent(), parameters=given)),
        "controller": written,
    }[door]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.name)
def test_a_value_is_refused_or_accepted_alike_wherever_it_is_given(place: Place) -> None:
    model = place.model(place.usual)
    start = assembled(model)
    assert model.parameters[place.name] == pytest.approx(place.usual)
    for value in NUMBERS:
        told = refused(lambda v=value: assembled(place.model(float(v))))
        for door in DOORS if not place.rows else DOORS[:-1]:
            message = refused(through(door, place, model, start, value))
            assert bool(message) == bool(told), (door, value, told, message)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.name)
def test_a_value_makes_the_same_motion_wherever_it_is_given(place: Place) -> None:
    """To the round-off of the steps: the words' own form may fold, or cut another joint."""
    model, value = place.model(place.usual), 0.9 * place.usual + 0.01
    other = place.model(value)
    described = simulated(other, assembled(other))
    given = {place.name: value}
    changed = simulated(model, assembled(model, given), parameters=given)
    for name in described.final.names:
        assert changed[name] == pytest.approx(described[name], rel=1e-9, abs=1e-12)
        assert changed[f"{name}.rate"] == pytest.approx(described[f"{name}.rate"], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: repr(value)[:9])
def test_what_is_no_finite_number_is_refused_wherever_it_is_given(value: Any) -> None:
    for place in PLACES:
        if value is not None:  # which may be a word's own way to leave something out
            assert refused(lambda p=place: assembled(p.model(value))), place.name
    place = next(place for place in PLACES if place.name == "foot.mu")
    model = place.model(place.usual)
    for door in DOORS:
        message = refused(through(door, place, model, assembled(model), value))
        assert "finite number" in message and repr(place.name) in message, (door, message)
