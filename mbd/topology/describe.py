"""A model in a page of text."""

import re
from collections.abc import Mapping, Sequence

from mbd.bodies.base import Body
from mbd.constraints.base import Constraint
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.notebook import folded, paragraphs, table
from mbd.topology.check import faults
from mbd.topology.description import Description
from mbd.topology.plan import plan

UNITS = {"mass": "kg", "length": "m", "center": "m", "inertia": "kg m²"}


def description(model: Description) -> str:
    """Bodies, joints, forces, constraints, coordinates and faults."""
    g = ", ".join(f"{value:.6g}" for value in model.gravity)
    return listed(f"{model.name}: gravity ({g}) m/s²", parts(model))


def parts(model: Description) -> dict[str, list[str]]:
    """The same by title, an entry a line."""
    found = faults(model)
    if model.foreign():
        return {"faults": found}
    return {
        "bodies": [_body(body) for body in model.bodies.values() if body is not model.ground],
        "joints": [_joint(joint) for joint in model.joints],
        "forces": [f"{force.name}: {type(force).__name__}, {force.kind}" for force in model.forces],
        "constraints": [described_constraint(word) for word in model.constraints],
        "controllers": [controller.name for controller in model.controllers],
        "observations": [f"{each.name} [{each.unit or '-'}]" for each in model.observations],
        "coordinates": [] if found else _choice(model),
        "faults": found,
    }


def listed(head: str, parts: Mapping[str, Sequence[str]]) -> str:
    """A line, then titles with their entries; nothing where there are none."""
    lines = [head]
    for title, entries in parts.items():
        lines += [f"{title}:", *(f"  {entry}" for entry in entries)] if entries else []
    return "\n".join(lines)


def in_html(head: str, parts: Mapping[str, Sequence[str]]) -> str:
    """The same for a notebook, a table for each title."""
    tables = []
    for title, entries in parts.items():
        divided = [re.split(r": | = | (?=\[)", entry, maxsplit=1) for entry in entries]
        plain = title in ("coordinates", "faults") and not all(len(pair) == 2 for pair in divided)
        tables += [table(title, (), [[entry] for entry in entries] if plain else divided)] if entries else []
    return folded(head, "\n".join(tables), is_open=True) if tables else paragraphs([head])


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
