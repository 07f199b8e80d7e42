"""Scenes in other forms that move as they do: on ground that is turned or runs, in other units, in halves, …"""

from __future__ import annotations

import dataclasses
import math
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.constraints.surfaces import Surface
from tests.fuzz.geometry import of_quaternion
from tests.fuzz.spatial_structures import any_orientation


@dataclass
class Form:
    """A mechanism with the parameters that differ from its own, and the start of what it has more than a scene.

    what : how it was made
    """

    model: mbd.Model
    parameters: dict[str, float]
    position: dict[str, Any] = field(default_factory=dict)
    velocity: dict[str, float] = field(default_factory=dict)
    what: str = ""

    def gravity(self) -> Any:
        """Its gravity (3,) [m/s²]."""
        return np.array([{**self.model.parameters, **self.parameters}[f"gravity.{axis}"] for axis in "xyz"])

    def changed(self, change: Callable[[Any], Any] = lambda value: value, gravity: Any = None) -> Form:
        """The same with other words in it; what words share they share again."""
        old, known = self.model, dict[int, tuple[Any, Any]]()
        model = mbd.Model(old.name, gravity=old.gravity if gravity is None else gravity, cut=old.cut)
        model.ground, model.controllers = old.ground, list(old.controllers)
        for kind in ("joints", "forces", "constraints"):
            setattr(model, kind, [_changed(word, change, known) for word in getattr(old, kind)])
        return Form(model, dict(self.parameters), dict(self.position), dict(self.velocity), self.what)


def other_form(number: int, model: mbd.Model, parameters: dict[str, float]) -> Form:
    """A form of a mechanism, by a number: one change or two of those that its words allow."""
    rng, form = random.Random(f"form {number}"), Form(model, dict(parameters))
    for name in rng.sample(list(CHANGES), len(CHANGES))[: rng.randint(2, 4)]:
        found = CHANGES[name](rng, form)
        if found is not None:
            form = replace(found, what=f"{form.what} {name}".strip())
    return form


def _changed(value: Any, change: Callable[[Any], Any], known: dict[int, tuple[Any, Any]]) -> Any:
    if id(value) not in known:
        known[id(value)] = value, _changed_parts(change(value), change, known)
    return known[id(value)][1]


def _changed_parts(value: Any, change: Callable[[Any], Any], known: dict[int, tuple[Any, Any]]) -> Any:
    parts = dict(_parts(value))
    found = {name: _changed(part, change, known) for name, part in parts.items()}
    if all(found[name] is parts[name] for name in parts):
        return value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return replace(value, **found)
    return found if isinstance(value, dict) else type(value)(found.values())


def _parts(value: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(value, tuple | list):
        yield from enumerate(value)
    elif isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, mbd.RigidBody | mbd.Link):
        return
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield from ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value) if f.init)


def _has(value: Any, kind: Any) -> bool:
    return isinstance(value, kind) or any(_has(part, kind) for _, part in _parts(value))


def _carried(form: Form, gravity: Any, planar: bool) -> tuple[Form, Any] | None:
    """The mechanism on a carrier in place of the ground, which nothing holds yet; None where words need the ground."""
    old = form.model
    carrier = mbd.RigidBody(f"carrier {len(old.joints)}", 2.0, 0.5 if planar else (0.3, 0.4, 0.5))

    def change(value: Any) -> Any:
        if isinstance(value, Frame) and value.body is old.ground:
            return Frame(carrier, value.name, value.offset, value.rotation, value.landmark)
        if isinstance(value, mbd.RigidBody | mbd.Link) and isinstance(value.inertia, float) and not planar:
            return _like(value, value.name, (value.inertia,) * 3)
        if isinstance(value, mbd.Plane) and value.frame is None:
            return replace(value, frame=old.ground.origin)
        if isinstance(value, mbd.Applied) and value.axes is None:
            return replace(value, axes=old.ground.origin)
        return value

    for word in (*old.forces, *old.constraints):
        if _has(word, Surface | mbd.KnifeEdge | mbd.Nonholonomic) or _has(getattr(word, "arguments", ()), Frame):
            return None
    found = form.changed(change, tuple(map(float, gravity)))
    for name in [name for name in found.parameters if name.startswith(("ground.", "gravity."))]:
        value = found.parameters.pop(name)
        if name.startswith("ground."):
            found.parameters[name.replace("ground", carrier.name, 1)] = value
    for name in [name for name in found.parameters if name.endswith(".inertia") and not planar]:
        value = found.parameters.pop(name)
        found.parameters |= dict.fromkeys((f"{name}.{axes}" for axes in ("xx", "yy", "zz")), value)
    return found, carrier


def _turned(rng: random.Random, form: Form) -> Form | None:
    """Everything turned and elsewhere, a planar mechanism in a plane of space; some by exact quarters of a turn."""
    axis, half = rng.choice(np.eye(3).tolist()), 0.25 * math.pi * rng.choice([1, 2, 3])
    quarters = (math.cos(half), *(math.sin(half) * part for part in axis))
    R = np.round(of_quaternion(np.array([rng.choice([any_orientation(rng), quarters])]))[0], 15) + 0.0
    made = _carried(form, R @ form.gravity(), planar=False)
    if made is None:
        return None
    found, carrier = made
    x, y, z = (rng.choice([0.0, rng.uniform(-2, 2)]) for _ in range(3))
    place = found.model.ground.point(x, y, z)
    turned: Any = tuple(map(tuple, R.tolist()))
    found.model.connect(mbd.Weld(f"{carrier.name} holds", replace(place, rotation=turned), carrier.origin))
    return found


def _pulled(rng: random.Random, form: Form) -> Form | None:
    """On ground that runs or gathers speed, under gravity that is as much more as the ground accelerates."""
    axis = rng.choice([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    v, a = rng.choice([0.0, rng.uniform(-2, 2)]), rng.choice([0.0, rng.uniform(-4, 4)])
    made = _carried(
        form, form.gravity() + a * np.array(axis), planar=all(joint.is_planar for joint in form.model.joints)
    )
    if made is None:
        return None
    found, carrier = made
    rail = mbd.Prismatic(f"{carrier.name} rail", found.model.ground.origin, carrier.origin, axis=axis)
    found.model.connect(rail)
    found.model.constrain(mbd.Bilateral(f"{carrier.name} pull", rail, value=lambda t: v * t + 0.5 * a * t * t))
    found.position[rail.coordinate_names[0]], found.velocity[rail.coordinate_names[0]] = 0.0, v
    return found


def _like(body: Any, name: str, inertia: Any) -> Any:
    """A body of the same shape and mass."""
    if isinstance(body, mbd.Link):
        return mbd.Link(name, body.mass, body.length, body.center_distance, inertia)
    return mbd.RigidBody(name, body.mass, inertia, body.center_offset)


def _halves(rng: random.Random, form: Form) -> Form | None:
    """A body in two parts that a weld holds together."""
    bodies = [body for body in form.model.bodies.values() if isinstance(body, mbd.RigidBody | mbd.Link)]
    if not bodies:
        return None
    body, share, found = rng.choice(bodies), rng.uniform(0.05, 0.95), form.changed()
    part, given = _like(body, f"{body.name} half", body.inertia), found.parameters
    for name, own in body.parameters().items():
        kind, value = name.removeprefix(body.name), given.get(name, own)
        size = 1.0 - share if kind.startswith((".mass", ".inertia")) else 1.0
        if value != 0.0:
            given |= {f"{part.name}{kind}": size * value, name: share * value if size < 1.0 else value}
    place = (rng.uniform(-1, 1), rng.uniform(-1, 1), 0.0)
    found.model.connect(mbd.Weld(f"{part.name} weld", body.point(*place), part.point(*place)))
    return found


def _shuffled(rng: random.Random, form: Form) -> Form:
    """Joints, forces and constraints in another order."""
    found = form.changed()
    for words in (found.model.joints, found.model.forces, found.model.constraints):
        rng.shuffle(words)
    return found


def _twice(rng: random.Random, form: Form) -> Form | None:
    """Each contact and each drive a second time: rows that follow from others."""
    found = form.changed()
    again = [word for word in found.model.constraints if isinstance(word, mbd.Bilateral | mbd.Unilateral)]
    if not again or any(isinstance(word, mbd.Unilateral) and word.release is not None for word in again):
        return None
    for word in again:
        name = f"{word.name} again"
        found.model.constrain(replace(word, name=name))
        own = {given: value for given, value in found.parameters.items() if given.startswith(f"{word.name}.")}
        found.parameters |= {given.replace(word.name, name, 1): value for given, value in own.items()}
    return found


def _beside(rng: random.Random, form: Form) -> Form:
    """Beside bodies that nothing connects with it: one falls and bounces, one spins."""
    found, mass = form.changed(), 10.0 ** rng.uniform(-3, 3)
    ball, top = mbd.PointMass("other ball", mass), mbd.RigidBody("other top", mass, 0.1 * mass)
    fall = mbd.Prismatic("other fall", found.model.ground.origin, ball.origin, axis=(0.0, 1.0, 0.0))
    found.model.connect(fall, mbd.Revolute("other spin", found.model.ground.origin, top.origin))
    bounce = rng.choice([0.0, 0.5])
    found.model.constrain(mbd.Unilateral("other floor", mbd.extension(fall, 0.0), restitution=bounce))
    found.position |= {"other fall.displacement": rng.uniform(0.0, 0.05), "other spin.angle": 0.3}
    found.velocity["other spin.angle"] = 10.0 ** rng.uniform(-2, 2)
    return found


def _heavier(rng: random.Random, form: Form) -> Form | None:
    """Masses in another unit, where all forces grow with them."""
    losses = [loss for joint in form.model.joints for _, _, loss in joint.losses()]
    others = mbd.Tabulated | mbd.Dissipation | mbd.Stribeck
    if form.model.forces or form.model.controllers or _has(losses, others):
        return None
    found, unit = form.changed(), 10.0 ** rng.choice([-6, -3, 3, 6])
    grows = re.compile(r"\.(mass|inertia|(rotational_)?stiffness|damping|coefficient|torque)\b")
    for name, value in {**found.model.parameters, **found.parameters}.items():
        if value and grows.search(name):
            found.parameters[name] = unit * value
    return found


CHANGES: dict[str, Callable[[random.Random, Form], Form | None]] = {
    "turned": _turned, "pulled": _pulled, "halves": _halves, "shuffled": _shuffled, "twice": _twice, "beside": _beside,
    "heavier": _heavier,
}  # fmt: skip
"""By name: what makes a form of another; None where its words mean another mechanism there."""
