"""All forces and torques on every body: reported reactions and contact forces, everything else from its own law."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.constraints.user_measure import UserMeasure
from mbd.joints.base import Joint
from mbd.joints.losses.base import Loss, LossSum
from tests.fuzz.bodies import Bodies, mass_of
from tests.fuzz.geometry import Array, cross
from tests.fuzz.quantities import TINY, gap_of, named, triple, user_gap, value_of
from tests.fuzz.round_bodies import edge_gap
from tests.fuzz.turning import ball_spring, bushing


@dataclass
class Load:
    """Resultant on one body about its mass center, with the sizes of what it is made of; (n, 3) and (n,)."""

    force: Array
    torque: Array
    force_size: Array
    torque_size: Array

    def add(self, arm: Array, force: Array, torque: Array | None = None) -> None:
        """A force at an arm from the mass center, and a torque."""
        moment = cross(arm, force)
        self.force = self.force + force
        self.torque = self.torque + moment
        self.force_size = self.force_size + np.linalg.norm(force, axis=1)
        self.torque_size = self.torque_size + np.linalg.norm(arm, axis=1) * np.linalg.norm(force, axis=1)
        if torque is not None:
            self.torque = self.torque + torque
            self.torque_size = self.torque_size + np.linalg.norm(torque, axis=1)


@dataclass
class Loads:
    """Collects forces on bodies, and the power and the energy of each named effect.

    power : of effects that give or take energy (n,) [W]; stored : potential energy of effects (n,) [J]
    """

    bodies: Bodies
    on: dict[str, Load] = field(default_factory=dict)
    centers: dict[str, Array] = field(default_factory=dict)
    power: dict[str, Array] = field(default_factory=dict)
    stored: dict[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.bodies.told)
        for name, body in self.bodies.model.bodies.items():
            if body is self.bodies.model.ground:
                continue
            zero = np.zeros((n, 3))
            self.on[name] = Load(zero, zero, np.zeros(n), np.zeros(n))
            H = self.bodies.placed[name].H
            center = mass_of(body, self.bodies.told.parameters).center
            self.centers[name] = H[:, :3, :3] @ center + H[:, :3, 3]

    def force(self, body: str, place: Array, force: Array, torque: Array | None = None) -> None:
        """A force at a place of the ground, on a body; the ground takes anything."""
        if body in self.on:
            self.on[body].add(place - self.centers[body], force, torque)

    def pair(self, joint: Joint, force: Array, torque: Array) -> None:
        """On the child of a joint at its frame's origin, and back on the parent at the same place."""
        place = self.bodies.place(joint.child)
        self.force(joint.child.body.name, place, force, torque)
        self.force(joint.parent.body.name, place, -force, -torque)

    def effort(self, joint: Joint, k: int, size: Any) -> None:
        """A force or torque along one coordinate of a joint, positive where it drives it forward."""
        axis, turns = self.direction(joint, k)
        wrench = np.broadcast_to(np.asarray(size, dtype=float), (len(axis),))[:, None] * axis
        nothing = np.zeros_like(wrench)
        self.pair(joint, nothing if turns else wrench, wrench if turns else nothing)

    def direction(self, joint: Joint, k: int) -> tuple[Array, bool]:
        """The axis of a coordinate in ground axes (n, 3), and whether it turns."""
        R = self.bodies.frame(joint.parent).H[:, :3, :3]
        turns = joint.freedoms[k].unit == "rad"
        if isinstance(joint, mbd.Spherical | mbd.Free):
            R = self.bodies.frame(joint.child).H[:, :3, :3] if turns else R
            return R[:, :, k % 3], turns
        if isinstance(joint, mbd.Universal) and k == 1:
            return self.bodies.frame(joint.child).H[:, :3, :3] @ np.asarray(joint.second_axis), True
        if isinstance(joint, mbd.Planar | mbd.Translation):
            return R @ np.eye(3)["xyz".index({"angle": "z"}.get(joint.labels[k].name, joint.labels[k].name))], turns
        axis: Any = getattr(joint, "axis", None)
        return R @ np.asarray(axis), turns

    def along(self, gap: Any, force: Array) -> None:
        """A force p along ∂g."""
        for body, place, direction in gap.points:
            self.force(body, place, force[:, None] * direction)
        joints = {joint.name: joint for joint in self.bodies.model.joints}
        for name, k, factor in gap.efforts:
            self.effort(joints[name], k, force * factor)


def loads(bodies: Bodies) -> Loads:
    """Everything that acts on the bodies.

    Raises
    ------
    NotImplementedError
        for a word that this judge does not know.
    """
    found = Loads(bodies)
    _weights(found)
    for joint in bodies.model.joints:
        _joint(found, joint)
    for force in bodies.model.forces:
        _force(found, force)
    for word in bodies.model.constraints:
        _constraint(found, word)
    return found


def _weights(found: Loads) -> None:
    parameters = found.bodies.told.parameters
    g = np.array([float(np.max(parameters[f"gravity.{axis}"])) for axis in "xyz"])
    height = np.zeros(len(found.bodies.told))
    for name, body in found.bodies.model.bodies.items():
        if name in found.on:
            mass = mass_of(body, parameters).mass
            found.force(name, found.centers[name], np.broadcast_to(mass * g, found.centers[name].shape))
            height = height - mass * (found.centers[name] @ g)
    found.stored["gravity"] = height


def _joint(found: Loads, joint: Joint) -> None:
    """Its reaction, and what acts along its coordinates: spring, losses, dry friction."""
    told = found.bodies.told
    found.pair(joint, told.vector(f"{joint.name}.reaction_force"), told.vector(f"{joint.name}.reaction_torque"))
    if isinstance(joint, mbd.Spherical):
        ball_spring(found, joint)
    for k, (label, speed) in enumerate(zip(joint.freedoms, joint.velocity_names, strict=True)):
        name, rate = f"{joint.name}.{label.name}", told[speed]
        if len(joint.labels) == 1:
            q = told[name]
            stiffness = told.parameters.get(f"{joint.name} spring.stiffness", 0.0)
            rest = told.parameters.get(f"{joint.name} spring.rest", 0.0)
            found.effort(joint, k, -stiffness * (q - rest))
            found.stored[f"{joint.name} spring"] = 0.5 * stiffness * (q - rest) ** 2
        for place, owner, loss in joint.losses():
            if place == k:
                size = loss_force(loss, rate, owner, told.parameters)
                if isinstance(joint, mbd.Spherical) and isinstance(joint.loss, Loss):
                    size = _against(loss, rate, [told[each] for each in joint.velocity_names], owner, told.parameters)
                found.effort(joint, k, -size)
                found.power[owner] = found.power.get(owner, 0.0) - size * rate
        for friction in dict.fromkeys((f"{name}.friction", f"{joint.name}.friction")):
            if friction in told and (friction == f"{name}.friction" or len(joint.labels) == 1):
                found.effort(joint, k, told[friction])
                found.power[friction] = told[friction] * rate


def _against(loss: Any, rate: Array, velocity: list[Array], owner: str, parameters: Any) -> Any:
    """The part along one of the components of a velocity of a loss that acts against all of it."""
    speed = np.linalg.norm(velocity, axis=0)
    return loss_force(loss, speed, owner, parameters) * rate / np.where(speed > 0.0, speed, 1.0)


def loss_force(loss: Any, rate: Array, owner: str, parameters: Any) -> Any:
    """F(v) of a smooth loss, positive against the motion; 0 of dry friction."""
    if isinstance(loss, LossSum):
        return sum((loss_force(part, rate, name, parameters) for name, part in loss.named(owner)), start=0.0 * rate)
    if isinstance(loss, mbd.Viscous):
        return parameters[f"{owner}.coefficient"] * rate
    if isinstance(loss, mbd.Quadratic):
        return parameters[f"{owner}.coefficient"] * np.abs(rate) * rate
    if isinstance(loss, mbd.Coulomb):
        if loss.smoothing is None:
            return 0.0 * rate
        return parameters[f"{owner}.torque"] * rate / np.sqrt(rate**2 + parameters[f"{owner}.smoothing"] ** 2)
    if isinstance(loss, mbd.PinFriction | mbd.Stribeck):
        return 0.0 * rate
    if isinstance(loss, mbd.Tabulated):
        return _tabulated(loss, rate)
    if isinstance(loss, mbd.Dissipation):
        assert callable(loss.function)
        return np.imag(loss.function(rate + 1j * TINY)) / TINY
    raise NotImplementedError(f"losses of kind {type(loss).__name__}")


def _tabulated(loss: mbd.Tabulated, rate: Array) -> Array:
    """Fritsch and Carlson's cubic through the points and the origin, straight beyond its ends."""
    from scipy.interpolate import PchipInterpolator

    points = dict(zip(loss.rate, loss.torque, strict=True)) | ({} if 0.0 in loss.rate else {0.0: 0.0})
    v = np.array(sorted(points))
    curve = PchipInterpolator(v, [points[each] for each in v])
    slope = curve.derivative()
    inside = np.clip(rate, v[0], v[-1])
    ends = np.where(
        rate < v[0], max(float(slope(v[0])), 0.0), np.where(rate > v[-1], max(float(slope(v[-1])), 0.0), 0.0)
    )
    return np.asarray(curve(inside) + ends * (rate - inside))


def _force(found: Loads, force: Any) -> None:
    bodies, told = found.bodies, found.bodies.told
    name = force.name
    if isinstance(force, mbd.Spring | mbd.Damper):
        a, b = bodies.place(force.a), bodies.place(force.b)
        length = np.linalg.norm(b - a, axis=1)
        along = (b - a) / np.where(length > 0.0, length, 1.0)[:, None]
        if isinstance(force, mbd.Spring):
            stretch = length - told.parameters[f"{name}.length"]
            pull = told.parameters[f"{name}.stiffness"] * stretch
            found.stored[name] = 0.5 * pull * stretch
        else:
            motion = bodies.velocity(force.b.body.name, b) - bodies.velocity(force.a.body.name, a)
            rate = np.sum(along * motion, axis=1)
            pull = loss_force(force.law, rate, name, told.parameters)
            found.power[name] = -pull * rate
        found.force(force.b.body.name, b, -pull[:, None] * along)
        found.force(force.a.body.name, a, pull[:, None] * along)
    elif isinstance(force, mbd.Bushing):
        bushing(found, force)
    elif isinstance(force, mbd.TorsionSpring):
        stretch = told[force.joint.coordinate_names[0]] - told.parameters[f"{name}.rest"]
        stiffness = told.parameters[f"{name}.stiffness"]
        found.effort(force.joint, 0, -stiffness * stretch)
        found.stored[name] = 0.5 * stiffness * stretch**2
    elif isinstance(force, mbd.Motor):
        torque = value_of(force.torque, force.arguments, bodies, name, "torque")
        found.effort(force.joint, 0, torque)
        found.power[name] = torque * told[f"{force.joint.coordinate_names[0]}.rate"]
    elif isinstance(force, mbd.Applied):
        _applied(found, force)
    elif isinstance(force, mbd.Potential):
        _potential(found, force)
    else:
        raise NotImplementedError(f"forces of kind {type(force).__name__}")


def _applied(found: Loads, force: Any) -> None:
    bodies = found.bodies
    place, nothing = bodies.place(force.frame), np.zeros((len(bodies.told), 3))
    push = nothing if force.force is None else triple(force.force, force.arguments, bodies, force.name, "force")
    twist = nothing if force.torque is None else triple(force.torque, force.arguments, bodies, force.name, "torque")
    if force.axes is not None:
        R = bodies.frame(force.axes).H[:, :3, :3]
        push, twist = (np.einsum("nij,nj->ni", R, part) for part in (push, twist))
    body = force.frame.body.name
    found.force(body, place, push, twist)
    power = np.sum(push * bodies.velocity(body, place), axis=1)
    found.power[force.name] = power + np.sum(twist * bodies.twist(body).angular, axis=1)


def _potential(found: Loads, force: Any) -> None:
    """The negative gradient of V in its arguments, by complex steps."""
    gap = user_gap(UserMeasure(force.function, force.arguments), found.bodies, force.name)
    found.along(gap, -np.ones(len(found.bodies.told)))
    found.stored[force.name] = gap.value
    if np.any(gap.drift):
        found.power[force.name] = gap.drift


def _constraint(found: Loads, word: Any) -> None:
    bodies, told = found.bodies, found.bodies.told
    if isinstance(word, mbd.Event):
        return
    if isinstance(word, mbd.Bilateral):
        gap = gap_of(word.measure, bodies)
        found.along(gap, -told[f"{word.name}.multiplier"])
    elif isinstance(word, mbd.Unilateral | mbd.Penalty):
        gap = gap_of(word.measure, bodies)
        found.along(gap, told[f"{word.name}.force"])
        _tangential(found, word, gap)
    elif isinstance(word, mbd.KnifeEdge):
        R = bodies.frame(word.frame).H[:, :3, :3]
        side = told[f"{word.name}.force"][:, None] * (R @ np.asarray(word.normal))
        found.force(word.frame.body.name, bodies.place(word.frame), side)
    elif isinstance(word, mbd.Rolling):
        _rolling(found, word)
    elif isinstance(word, mbd.Nonholonomic):
        _nonholonomic(found, word)
    else:
        raise NotImplementedError(f"constraints of kind {type(word).__name__}")


def _tangential(found: Loads, word: Any, gap: Any) -> None:
    told = found.bodies.told
    for part, direction in gap.tangents:
        name = f"{word.name}.friction.{part}"
        name = name if name in told or part != "forward" else f"{word.name}.friction"
        if name in told:
            for k, (body, place, _) in enumerate(gap.points):
                found.force(body, place, (1.0 if k == 0 else -1.0) * told[name][:, None] * direction)


def _rolling(found: Loads, word: Any) -> None:
    bodies, plane = found.bodies, word.ground
    if word.axis is not None:
        edge = edge_gap(word.center, bodies.told.parameters[f"{word.name}.radius"], word.axis, plane, bodies)
        for part, direction in edge.tangents:
            for k, (body, place, _) in enumerate(edge.points):
                push = (1.0 if k == 0 else -1.0) * bodies.told[f"{word.name}.{part}.force"]
                found.force(body, place, push[:, None] * direction)
        return
    n = len(bodies.told)
    R = np.broadcast_to(np.eye(3), (n, 3, 3)) if plane.frame is None else bodies.frame(plane.frame).H[:, :3, :3]
    normal = np.asarray(plane.normal)
    place = bodies.place(word.center) - bodies.told.parameters[f"{word.name}.radius"] * (R @ normal)
    push = bodies.told[f"{word.name}.force"][:, None] * (R @ np.cross(normal, [0.0, 0.0, 1.0]))
    found.force(word.center.body.name, place, push)
    if plane.frame is not None:
        found.force(plane.frame.body.name, place, -push)


def _nonholonomic(found: Loads, word: Any) -> None:
    """The force along each rate that the row contains, ∂row/∂rate by complex steps."""
    bodies, told = found.bodies, found.bodies.told
    rates = {f"{name}.rate": (j, k) for j in bodies.model.joints for k, name in enumerate(j.coordinate_names)}
    rates |= {f"{j.name}.rate": (j, 0) for j in bodies.model.joints if len(j.labels) == 1}
    values = [named(given, bodies) for _, given in word.arguments]
    for k, (_, given) in enumerate(word.arguments):
        if given in rates:
            moved = [value + 1j * TINY if j == k else value for j, value in enumerate(values)]
            slope = np.imag(np.asarray(word.row(*moved)) + 0j) / TINY
            joint, place = rates[given]
            found.effort(joint, place, told[f"{word.name}.force"] * slope)
        elif isinstance(given, Frame) or ".v" in given:
            raise NotImplementedError(f"a row on '{given}'")
