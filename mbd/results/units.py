"""Units of named results, from their names."""

from mbd.results.facts import Facts

ENDINGS = {
    "angle": "rad", "first": "rad", "second": "rad", "displacement": "m", "length": "m", "speed": "m/s",
    "reaction_force": "N", "reaction_torque": "N m",
    "force": "N", "friction": "N", "tension": "N", "torque": "N m", "power": "W", "energy": "J",
    "net_moment": "N m", "net_force": "N", "kinetic_energy": "J", "potential_energy": "J", "t": "s",
    "x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s", "ax": "m/s²", "ay": "m/s²", "az": "m/s²",
}  # fmt: skip
"""Unit by the last word of a name."""


EFFORTS = ("reaction_force", "reaction_torque", "force", "torque", "net_moment", "net_force")
"""Vectors that are no places."""

PARTS = {"orientation": "", "angular_velocity": "rad/s", "rotation_vector": "rad", "euler": "rad"}
"""Unit of what a joint that turns freely tells in parts: 'hip.angular_velocity.ground.x', 'hip.euler.zxy.1'."""


def _of_part(name: str) -> str | None:
    """The unit of a part of an orientation or an angular velocity; None for any other name."""
    owner = name.split(".")[1:-1]
    return PARTS[owner[0]] if owner and owner[0] in PARTS and len(owner) <= 2 else None


def unit(name: str, facts: Facts) -> str:
    """The unit of a result; '' where the name does not tell.

    A coordinate has its own unit, its rate and acceleration that unit per second and per second squared; a contact's
    gap has the contact's, and the force of a contact in radians is a torque.
    """
    own = dict(facts.coordinates) | dict(facts.velocities)
    if name in own:
        return own[name]
    stem, _, last = name.rpartition(".")
    observed = dict(facts.observations)
    if name in observed or (stem in observed and last in ("x", "y", "z")):
        return observed.get(name, observed.get(stem, ""))
    if name in facts.angles:
        return "rad"
    part = _of_part(name)
    if part is not None and last != "acceleration":
        return part
    contact = next((item for item in facts.contacts if item.name == stem), None)
    if contact is not None and last == "gap":
        return contact.unit
    if contact is not None and last == "gap_rate":
        return f"{contact.unit}/s"
    if stem.endswith(".friction") and any(f"{item.name}.friction" == stem for item in facts.contacts):
        return "N"
    if last == "friction" and stem in dict(facts.frictions):
        return dict(facts.frictions)[stem]
    if contact is not None and last == "force":
        return "N m" if contact.unit.startswith("rad") else "N"
    if last in ("rate", "acceleration"):
        power = "/s" if last == "rate" else "/s²"
        base = (
            own.get(stem)
            or ("rad" if stem in facts.angles else "")
            or next((value for key, value in own.items() if key.rpartition(".")[0] == stem), "")
            or (unit(stem, facts) if "." in stem else "")  # of a cut joint, whose angle is no coordinate
        )
        base = base.removesuffix("/s") if last == "acceleration" else base  # of a velocity that is no rate
        return base + power if base else ""
    effort = stem.removesuffix(".a").rpartition(".")[2]  # 'mount.force.a.x': in the axes of a frame a
    if last in ("x", "y", "z") and effort in EFFORTS:
        return ENDINGS[effort]
    return ENDINGS.get(last, "")


def unit_of(name: str) -> str:
    """The unit of a coordinate or its rate by its name alone; '' where that does not tell.

    >>> unit_of("left hip.angle"), unit_of("left hip.angle.rate"), unit_of("theta")
    ('rad', 'rad/s', '')
    """
    stem, _, last = name.rpartition(".")
    part = _of_part(name)
    if part is not None:
        return part
    if last != "rate":
        return ENDINGS.get(last, "")
    base = unit_of(stem)
    return f"{base}/s" if base else ""
