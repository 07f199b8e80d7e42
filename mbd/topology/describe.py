"""A model in a page of text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from mbd.errors import ModelError
from mbd.topology.check import faults
from mbd.topology.plan import plan

if TYPE_CHECKING:
    from mbd.bodies.base import Body
    from mbd.constraints.base import Constraint
    from mbd.description import Description
    from mbd.joints.base import Joint

__all__ = ["described_constraint", "description", "section"]

UNITS = {"mass": "kg", "length": "m", "center": "m", "inertia": "kg m²"}


def description(model: Description) -> str:
    """Bodies, joints, forces, constraints, coordinates and faults."""
    g = ", ".join(f"{value:.6g}" for value in model.gravity)
    lines = [f"{model.name}: gravity ({g}) m/s²"]
    lines += section("bodies", [_body(body) for body in model.bodies.values() if body is not model.ground])
    lines += section("joints", [_joint(joint) for joint in model.joints])
    lines += section("forces", [f"{force.name}: {type(force).__name__}, {force.kind}" for force in model.forces])
    lines += section("constraints", [described_constraint(word) for word in model.constraints])
    lines += section("controllers", [controller.name for controller in model.controllers])
    found = faults(model)
    if not found:
        lines += section("coordinates", _choice(model))
    lines += section("faults", found)
    return "\n".join(lines)


def section(title: str, entries: Iterable[str]) -> list[str]:
    """A title and its entries, nothing if there are none."""
    listed = list(entries)
    return [f"{title}:", *(f"  {entry}" for entry in listed)] if listed else []


def _body(body: Body) -> str:
    values = [f"{field} {value:.6g} {UNITS.get(field.split('.')[0], '')}" for field, value in body.fields().items()]
    return f"{body.name}: {type(body).__name__}, " + ", ".join(values)


def _joint(joint: Joint) -> str:
    coordinates = ", ".join(
        f"{name} [{label.unit or '-'}]" for name, label in zip(joint.coordinate_names, joint.labels, strict=True)
    )
    text = f"{joint.name}: {type(joint).__name__} {joint.parent.full_name} → {joint.child.full_name}"
    text += f", {coordinates}" if coordinates else ""
    if not joint.is_vector:
        pairs = zip(joint.velocity_names, joint.velocity_labels, strict=True)
        text += f", velocities {', '.join(f'{name} [{label.unit}]' for name, label in pairs)}"
    text += f", loss {joint.loss}" if joint.loss is not None else ""
    return text + (f", stiffness {joint.stiffness:.6g}, rest {joint.rest:.6g}" if joint.stiffness else "")


def described_constraint(word: Constraint) -> str:
    """A constraint in a line."""
    return f"{word.name}: {type(word).__name__}{word.details}"


def _choice(model: Description) -> list[str]:
    try:
        chosen = plan(model)
    except ModelError as error:
        return list(error.faults)
    kind = "planar" if chosen.planar else "spatial"
    return [
        f"{chosen.dof} of the tree: {', '.join(chosen.coordinate_names) or 'none'}",
        f"cut joints: {', '.join(joint.name for joint in chosen.cut) or 'none'}",
        f"mobility {chosen.mobility} by the {kind} count of Grübler",
        *chosen.notes,
    ]
