"""Names of the forces that hold a mechanism, which laws may read."""

from mbd.constraints.base import Constraint
from mbd.forces.base import Force
from mbd.joints.base import Joint
from mbd.topology.description import Description

OF_ROWS = ("force", "multiplier", "tension", "torque", "spin.torque")
OF_FRICTION = ("friction", "friction.forward", "friction.sideways")
OF_GAPS = ("gap", "gap_rate")
REACTIONS = ("reaction_force", "reaction_torque")


def names_of_held_forces(model: Description) -> set[str]:
    """What laws may ask for of constraints, contacts and joints; which of these a word has shows in the derivation."""
    found = {f"{word.name}.{what}" for word in model.contacts for what in (*OF_ROWS, *OF_FRICTION, *OF_GAPS)}
    held = [*model.bilaterals, *model.nonholonomic]
    found |= {f"{word.name}.{what}" for word in held for what in (*OF_ROWS, "friction")}
    for joint in model.joints:
        found |= _reactions(joint)
    return found


def reactions_read(model: Description) -> set[str]:
    """Names of the joints whose reactions laws read; these are cut, so that rows carry them."""
    words: list[Force | Constraint] = [*model.forces, *model.constraints]
    named = {mention for word in words for mention in word.mentions() if isinstance(mention, str)}
    if not any("reaction_" in name for name in named):
        return set()
    return {joint.name for joint in model.joints if named & _reactions(joint)}


def _reactions(joint: Joint) -> set[str]:
    """Whole vectors, and their components in ground axes."""
    return {f"{joint.name}.{what}{axis}" for what in REACTIONS for axis in ("", ".x", ".y", ".z")}
