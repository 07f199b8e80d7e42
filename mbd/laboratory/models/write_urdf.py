"""Models written as URDF: links with their frames at the joints, z up."""

import math
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import ModelError
from mbd.joints.cylindrical import Cylindrical
from mbd.joints.free import Free
from mbd.joints.losses import Coulomb, Viscous
from mbd.joints.planar import Planar
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.translation import Translation
from mbd.joints.universal import Universal
from mbd.joints.weld import Weld
from mbd.laboratory.models.report import ImportReport
from mbd.laboratory.models.written_tree import (
    Inertial,
    Place,
    WrittenJoint,
    inertial_of,
    place_of,
    stops_of,
    tree_to_write,
)

UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Axes of the file, whose z is up, in those of the ground, whose y is."""
X, Y, Z = np.eye(3)
NO_LIMIT = 1e9
"""Effort and velocity of joints without a limit of them, which the format wants [N m, rad/s]."""

Step = tuple[str, Vector, str]
"""Kind, axis and name of a joint of one coordinate."""


def urdf_of(model: Any) -> tuple[str, ImportReport]:
    """The text of a file, and what it tells and leaves out.

    Each link has its frame where the joint to its parent is. A joint of several coordinates becomes a chain with links
    without mass between them.

    Raises
    ------
    ModelError
        for ball and screw joints, which the format lacks.
    """
    report = ImportReport()
    values = dict(model.parameters)
    tree, report.left_out[:] = tree_to_write(model)
    held = [each for each in tree if each.parent.body.name == model.ground.name]
    if len(held) == 1 and isinstance(held[0].joint, Weld):  # as `mbd.read_model` holds the root link of a file
        (each,), links = held, list[str]()
        root, place = each.child.body.name, _ground_on(each, values)
        names, frames = {model.ground.name: root, root: root}, {model.ground.name: (np.zeros(3), UP), root: place}
        links.append(_link(root, _in_frame(inertial_of(each.child.body, values, report), place)))
        tree.remove(each)
        report.understood.append(f"{root!r}, which {each.joint.name!r} holds to the ground, as the root link")
    else:
        root = "world"
        while root in model.bodies:
            root += " ground"
        names, frames = {model.ground.name: root}, {model.ground.name: (np.zeros(3), UP)}
        links = [_link(root, None)]
    joints = list[str]()
    limits, stopped = _limits(model, tree)
    for each in tree:
        body = each.child.body
        names[body.name], frames[body.name] = body.name, place_of(each.child, values)
        inertial = _in_frame(inertial_of(body, values, report), frames[body.name])
        steps, kind = _steps(each)
        at = _seen(place_of(each.parent, values), frames[each.parent.body.name])
        parent = names[each.parent.body.name]
        # links without mass between the joints of a chain
        for number, (word, axis, name) in enumerate(steps):
            last = number == len(steps) - 1
            link = body.name if last else f"{body.name} carrier {number + 1}"
            limit = limits.get(each.joint.name) if len(steps) == 1 else None
            joints.append(_joint(name, word, parent, link, at, axis, each.joint, limit, last))
            links.append(_link(link, inertial if last else None))
            parent, at = link, (np.zeros(3), np.eye(3))
        if kind is not None:
            report.understood.append(kind)
    report.understood.insert(0, f"{len(frames) - 1} bodies, {len(joints)} joints")
    report.left_out += _left_out(model, stopped)
    lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(model.name)}>", *links, *joints, "</robot>"]
    return "\n".join(lines) + "\n", report


def _steps(each: WrittenJoint) -> tuple[list[Step], str | None]:
    """The joint as joints of one coordinate at most, and what to say of it."""
    joint, name = each.joint, each.joint.name
    if isinstance(joint, Weld):
        return [("fixed", X, name)], None
    if isinstance(joint, Free):
        return [("floating", X, name)], None
    if isinstance(joint, Revolute | Prismatic):
        word = "revolute" if isinstance(joint, Revolute) else "prismatic"
        return [(word, each.sign * np.array(joint.axis), name)], None
    if isinstance(joint, Translation):
        steps = [("prismatic", np.eye(3)["xyz".index(axis)], f"{name} {axis}") for axis in joint.axes]
    elif isinstance(joint, Planar):
        steps = [("prismatic", X, f"{name} x"), ("prismatic", Y, f"{name} y"), ("revolute", Z, f"{name} angle")]
    elif isinstance(joint, Universal):
        axes = (joint.axis, joint.second_axis)
        steps = [("revolute", np.array(a), f"{name} {w}") for a, w in zip(axes, ("first", "second"), strict=True)]
    elif isinstance(joint, Cylindrical):
        axis = np.array(joint.axis)
        steps = [("prismatic", axis, f"{name} displacement"), ("revolute", axis, f"{name} angle")]
    else:
        raise ModelError(
            f"joint '{name}': URDF has no {type(joint).__name__}; write an .osim file, or take other joints"
        )
    return steps, f"{type(joint).__name__} {name!r} as {', '.join(repr(s[2]) for s in steps)}"


def _limits(model: Any, tree: list[WrittenJoint]) -> tuple[dict[str, tuple[float, float]], set[str]]:
    """Ranges of the joints that are written by stops on their coordinate, and the names of these stops."""
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    names = set[str]()
    for name, measure in stops_of(model, tree):
        joint, names = measure.joint.name, {*names, name}
        if measure.sign > 0.0:
            low[joint] = max(measure.offset, low.get(joint, -NO_LIMIT))
        else:
            high[joint] = min(-measure.offset, high.get(joint, NO_LIMIT))
    whole = {name: (low.get(name, -NO_LIMIT), high.get(name, NO_LIMIT)) for name in {*low, *high}}
    return whole, names


def _left_out(model: Any, stopped: set[str]) -> list[str]:
    found = [f"{type(force).__name__} {force.name!r}" for force in model.forces]
    found += [f"{type(word).__name__} {word.name!r}" for word in model.constraints if word.name not in stopped]
    for joint in model.joints:
        if getattr(joint, "stiffness", 0.0):
            found.append(f"spring of joint {joint.name!r}")
        parts = _losses(joint)
        found += [f"loss of joint {joint.name!r}" for _ in range(1) if parts is None]
    return found


def _losses(joint: Any) -> tuple[float, float] | None:
    """Damping and friction of a loss that the format can tell; None for another."""
    loss = getattr(joint, "loss", None)
    if loss is None:
        return 0.0, 0.0
    if not isinstance(joint, Revolute | Prismatic):
        return None
    parts = getattr(loss, "losses", (loss,))
    if not all(isinstance(part, Viscous | Coulomb) for part in parts):
        return None
    viscous = [part.coefficient for part in parts if isinstance(part, Viscous)]
    constant = [each for each in viscous if isinstance(each, float)]
    if len(constant) < len(viscous):  # by the state of a mode
        return None
    return sum(constant), sum(float(part.torque) for part in parts if isinstance(part, Coulomb))


def _ground_on(each: WrittenJoint, parameters: dict[str, float]) -> Place:
    """The axes of the file, as the body has them that is welded to the ground."""
    (p, R), (p0, R0) = place_of(each.parent, parameters), place_of(each.child, parameters)
    turned = R0 @ R.T
    return p0 - turned @ p, turned @ UP


def _in_frame(found: Inertial, frame: Place) -> Inertial:
    p, R = frame
    return Inertial(found.mass, R.T @ (found.center - p), R.T @ found.inertia @ R)


def _seen(place: Place, frame: Place) -> Place:
    """A frame of a body in the frame of its link."""
    (p, R), (p0, R0) = place, frame
    return R0.T @ (p - p0), R0.T @ R


def _angles(R: Matrix) -> Vector:
    """Roll, pitch and yaw of ``R = Rz(yaw) Ry(pitch) Rx(roll)``."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) < 1e-12:
        return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])


def _text(values: Any) -> str:
    return " ".join(repr(float(value) + 0.0) for value in np.atleast_1d(values))


def _link(name: str, found: Inertial | None) -> str:
    if found is None or found.mass == 0.0:
        return f"  <link name={quoteattr(name)}/>"
    J = found.inertia
    elements = {"ixx": J[0, 0], "ixy": J[0, 1], "ixz": J[0, 2], "iyy": J[1, 1], "iyz": J[1, 2], "izz": J[2, 2]}
    tensor = " ".join(f'{key}="{_text(value)}"' for key, value in elements.items())
    return (
        f'  <link name={quoteattr(name)}><inertial><origin xyz="{_text(found.center)}"/>'
        f'<mass value="{_text(found.mass)}"/><inertia {tensor}/></inertial></link>'
    )


def _joint(
    name: str, word: str, parent: str, child: str, at: Place, axis: Vector, joint: Any,
    limit: tuple[float, float] | None, last: bool,
) -> str:  # fmt: skip
    kind = "continuous" if word == "revolute" and limit is None else word
    parts = [
        f"<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>",
        f'<origin xyz="{_text(at[0])}" rpy="{_text(_angles(at[1]))}"/>',
    ]
    if word in ("revolute", "prismatic"):
        parts.append(f'<axis xyz="{_text(axis)}"/>')
        damping, friction = (_losses(joint) or (0.0, 0.0)) if last else (0.0, 0.0)
        if damping or friction:
            parts.append(f'<dynamics damping="{_text(damping)}" friction="{_text(friction)}"/>')
        if kind != "continuous":
            low, high = (-NO_LIMIT, NO_LIMIT) if limit is None else limit
            ends = f'lower="{_text(low)}" upper="{_text(high)}"'
            parts.append(f'<limit {ends} effort="{NO_LIMIT:g}" velocity="{NO_LIMIT:g}"/>')
    return f'  <joint name={quoteattr(name)} type="{kind}">{"".join(parts)}</joint>'
