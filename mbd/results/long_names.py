"""Names of results in words, for the axes of plots and the attributes of tables."""

from __future__ import annotations

from mbd.joints.anatomy import ANATOMY, angles_of
from mbd.results.units import EFFORTS

__all__ = ["long_name"]

WORDS = {
    "x": "place of {} along x", "y": "place of {} along y", "z": "place of {} along z",
    "vx": "velocity of {} along x", "vy": "velocity of {} along y", "vz": "velocity of {} along z",
    "ax": "acceleration of {} along x", "ay": "acceleration of {} along y", "az": "acceleration of {} along z",
    "rate": "rate of {}", "acceleration": "acceleration of {}", "angle": "angle of {}",
    "displacement": "displacement of {}", "gap": "gap of {}", "gap_rate": "rate of the gap of {}",
    "force": "force of {}", "torque": "torque of {}", "tension": "tension of {}", "length": "length of {}",
    "friction": "friction of {}", "multiplier": "multiplier of {}", "residual": "residual of {}",
    "net_moment": "net moment of {}", "net_force": "net force of {}", "power": "power of {}", "energy": "energy of {}",
    "reaction_force": "reaction force of {}", "reaction_torque": "reaction torque of {}",
}  # fmt: skip
"""Words for the last part of a name."""

ANGLES = {angle.name for part in ANATOMY for angles, _ in angles_of(part) for angle in angles}
"""Angles of joints of the body."""


FRAMES = {"": "in axes of the child", "parent": "in axes of the parent", "ground": "in axes of the ground"}
PLACES = {"1": "first", "2": "second", "3": "third"}


def _of_orientation(name: str) -> str:
    """A part of an orientation or an angular velocity in words; '' for any other result."""
    joint, _, rest = name.partition(".")
    kind, *between = rest.split(".")
    last = between.pop() if between else ""
    which = between[0] if between else ""
    if kind == "angular_velocity" and which in FRAMES and last in ("x", "y", "z"):
        return f"angular velocity of {joint} about {last} {FRAMES[which]}"
    if kind == "orientation" and not between and last in ("w", "x", "y", "z"):
        return f"part {last} of the orientation of {joint}"
    if kind == "rotation_vector" and last in ("x", "y", "z"):
        return f"rotation vector of {joint} along {last}"
    if kind == "euler" and last in PLACES:
        return f"{PLACES[last]} angle of {joint} about {which}"
    return ""


def long_name(name: str) -> str:
    """A result in words; the name itself where its parts do not tell.

    >>> long_name("left hip.angle.rate"), long_name("shank.end.vx"), long_name("knee.reaction_force.y")
    ('rate of angle of left hip', 'velocity of shank.end along x', 'reaction force of knee along y')
    """
    stem, _, last = name.rpartition(".")
    if not stem:
        return "time" if name == "t" else name.replace("_", " ")
    owner, _, kind = stem.rpartition(".")
    if last in ("x", "y", "z") and owner and kind in EFFORTS:
        return f"{WORDS[kind].format(owner)} along {last}"
    turning = _of_orientation(name)
    if turning:
        return turning
    if last in ("rate", "acceleration") and owner:
        return WORDS[last].format(long_name(stem))
    if last in ANGLES:
        return f"{last.replace('_', ' ')} of {stem}"
    return WORDS[last].format(stem) if last in WORDS else name
