"""A person in space, who can be printed, changed and taken apart."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Any

from mbd.bodies.base import Bodies, Body
from mbd.bodies.ground import Ground
from mbd.bodies.values import Vector3, among, flag, name_of, number
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.forces.potential import Potential
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.notes import doubt
from mbd.parts.arguments import sizes
from mbd.parts.whole_body.joints import Articulation, articulations
from mbd.parts.whole_body.moments import await_passive_moments, passive_moments
from mbd.parts.whole_body.poses import Position, center_of_mass, hips_over_ground, origins, place_of, standing
from mbd.parts.whole_body.segments import SIDES, Segment, segments_of
from mbd.parts.whole_body.table import SEXES

SHORTEST, TALLEST = 0.4, 2.8
"""Heights outside of which a person is in doubt [m]."""
LIGHTEST, HEAVIEST = 1.0, 700.0
"""The same of masses [kg]."""
LIMBS = {"arm": "upper arm", "leg": "thigh"}
"""A limb, by the segment that it begins with."""


@dataclass(frozen=True)
class Human:
    """A person of rigid segments and joints, made by `mbd.human`.

    ``model.connect(*person.joints)`` puts it into a model; its joints and bodies are plain words like any others. All
    that changes it gives another one and leaves this as it is.

    segments : by name, 'left shank', …, or a body that stands in for one
    articulations : joints by name; the trunk's own joint to the ground is none of them
    floating : whether 'trunk', a `Free` joint of the pelvis, belongs to it
    passive : whether `moments` are there
    """

    prefix: str
    segments: tuple[Segment | Body, ...]
    articulations: tuple[Articulation, ...]
    floating: bool = True
    passive: bool = False

    @cached_property
    def bodies(self) -> dict[str, Body]:
        """Its bodies by the names of its segments, 'pelvis' first."""
        made = {_plain(each, self.prefix): each for each in self.segments}
        return Bodies(
            (name, each.body(self.prefix) if isinstance(each, Segment) else each) for name, each in made.items()
        )

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Its joints: 'trunk' first, a floating pelvis, then from there outwards."""
        trunk = [Free(f"{self.prefix}trunk", Ground().origin, self.bodies["pelvis"].origin)] if self.floating else []
        found = (*trunk, *(each.joint(self.prefix, self.bodies) for each in self.articulations))
        if self.passive:
            await_passive_moments(found)
        return found

    @cached_property
    def moments(self) -> tuple[Potential, ...]:
        """Passive moments of hips, knees and ankles, for ``model.apply(*person.moments)``; none unless asked for.

        A model that has joints of a person who is passive, and none of these, is in doubt.
        """
        return tuple(passive_moments(self.joints)) if self.passive else ()

    def joint(self, name: str) -> Joint:
        """A joint by its name, 'left knee'."""
        known = {joint.name.removeprefix(self.prefix): joint for joint in self.joints}
        if not among(name, known):
            raise ModelError("human: " + nearest(name, known, "joint", "It has"))
        return known[name]

    # numbers ------------------------------------------------------------------------------------------------------
    @property
    def mass(self) -> float:
        """Of all segments [kg]."""
        return self._whole[0]

    @property
    def center(self) -> Vector3:
        """Center of mass standing upright, over the place of the pelvis on the ground [m]."""
        x, y, z = self._whole[1]
        return (x, y + hips_over_ground(self.bodies), z)

    @property
    def height(self) -> float:
        """From the ground to the top of the head, standing upright [m]."""
        if "head" not in self.bodies:
            raise ModelError("human: its height ends at the head, which it lacks")
        head = self.bodies["head"]
        top = next((frame for frame in (*head.points.values(), *head.frames.values()) if frame.name == "top"), None)
        if top is None:
            raise ModelError(f"human: its height ends at the point 'top' of '{head.name}', which it lacks")
        places = origins("pelvis", self.bodies, self.joints)
        return hips_over_ground(self.bodies) + float(place_of(top.offset, places[head.name])[1])

    @property
    def freedoms(self) -> int:
        """Of the joints, 34 of a whole person."""
        return sum(len(joint.freedoms) for joint in self.joints)

    @cached_property
    def _whole(self) -> tuple[float, Vector3]:
        return center_of_mass(origins("pelvis", self.bodies, self.joints), self.bodies)

    def standing(self, knees: float = 0.0) -> dict[str, Position]:
        """Positions for `mbd.assemble`: upright on level ground, feet flat; of legs that differ, the longer one.

        A leg whose knee is welded stays straight.

        Parameters
        ----------
        knees : by how much both are flexed, ankles staying under the hips, below π [rad]

        Raises
        ------
        ModelError
            where knees bend backwards, or by half a turn, and of a hip or an ankle that is held while its knee bends.
        """
        bend = number(knees, "knees of standing")
        if not 0.0 <= bend < math.pi:
            raise ModelError(f"knees of standing must lie between 0 and π rad, got {bend:g}; 20° is math.radians(20)")
        return standing(self.prefix, self.bodies, self.joints, bend)

    # others -------------------------------------------------------------------------------------------------------
    def without(self, *names: str) -> Human:
        """Without some segments and all that hang on them: 'left arm', 'right leg', 'left shank'; or without 'trunk',
        the joint to the ground."""
        gone: set[str] = set()
        for name in names:
            side, _, limb = name.partition(" ") if isinstance(name, str) else ("", "", "")
            segment = f"{side} {LIMBS[limb]}" if limb in LIMBS else name
            if segment != "trunk":
                self._require_removable(name, segment)
            gone.add(segment)
        for each in self.articulations:
            gone |= {each.child} if each.parent in gone else set()
        kept = tuple(each for each in self.segments if _plain(each, self.prefix) not in gone)
        joints = tuple(each for each in self.articulations if each.child not in gone)
        floating = self.floating and "trunk" not in gone
        return replace(self, segments=kept, articulations=joints, floating=floating)

    def scaled(self, what: str, *, mass: float = 1.0, length: float = 1.0) -> Human:
        """With a side ('left'), a limb ('left leg') or a segment ('left shank') of other mass and size."""
        sides = [side for side in SIDES if any(name.startswith(side) for name in self.bodies)]
        limbs = {f"{side} {limb}": f"{side} {first}" for side in sides for limb, first in LIMBS.items()}
        self._require(what, [*self.bodies, *sides, *limbs], "scaled", "segment")
        meant = {name for name in self.bodies if name == what or (what in sides and name.startswith(f"{what} "))}
        if what in limbs:
            meant = set(self.bodies) - set(self.without(limbs[what]).bodies)
        changed = []
        for each in self.segments:
            if _plain(each, self.prefix) in meant:
                if not isinstance(each, Segment):
                    raise ModelError(f"scaled '{what}': '{each.name}' is a body of yours; scale it when you make it")
                each = each.scaled(mass, length)
            changed.append(each)
        return replace(self, segments=tuple(changed))

    def replaced(self, segment: str, body: Body) -> Human:
        """With a body of one's own, such as a prosthetic foot, at whose origin the joint above it lies."""
        self._require(segment, list(self.bodies), "replaced", "segment")
        if not isinstance(body, Body):
            raise ModelError(f"replaced '{segment}': a body such as a mbd.Link is expected, got {body!r}")
        if body.name != self.prefix + segment:
            raise ModelError(f"replaced '{segment}': name the body '{self.prefix}{segment}', not '{body.name}'")
        return replace(
            self, segments=tuple(body if _plain(each, self.prefix) == segment else each for each in self.segments)
        )

    def changed(self, joint: str, **how: Any) -> Human:
        """With other fields of a joint: ``person.changed("left knee", stiffness=50.0, loss=mbd.Viscous(1.0))``."""
        return self._with(joint, lambda each: each.changed(how), "changed")

    def welded(self, *joints: str) -> Human:
        """With some joints held at zero."""
        found = self
        for joint in joints:
            found = found._with(joint, Articulation.welded, "welded")
        return found

    def _with(self, joint: str, change: Any, verb: str) -> Human:
        self._require(joint, [each.name for each in self.articulations], verb, "joint")
        return replace(
            self, articulations=tuple(change(each) if each.name == joint else each for each in self.articulations)
        )

    def _require_removable(self, name: Any, segment: Any) -> None:
        held = next((each.child for each in self.articulations if each.name == name), None)
        if held is not None:
            raise ModelError(f"without: {name!r} is a joint; without({held!r}) leaves it out with all beyond it")
        if name == "pelvis":
            raise ModelError("without: all segments hang on the pelvis; leave out the others")
        limbs = [
            f"{side} {limb}" for side in SIDES for limb, first in LIMBS.items() if f"{side} {first}" in self.bodies
        ]
        if not among(segment, [body for body in self.bodies if body != "pelvis"]):
            self._require(
                name, [*limbs, "trunk", *(body for body in self.bodies if body != "pelvis")], "without", "segment"
            )

    def _require(self, name: Any, known: list[str], verb: str, kind: str) -> None:
        if not among(name, known):
            raise ModelError(f"{verb}: " + nearest(name, known, kind, "The person has"))

    def __repr__(self) -> str:
        title = f"Human({self.prefix.strip()!r}: " if self.prefix else "Human("
        return f"{title}{self.mass:.4g} kg, {len(self.bodies)} bodies, {self.freedoms} degrees of freedom)"

    def __str__(self) -> str:
        held = {joint.child.body.name: joint for joint in self.joints}
        lines = [repr(self), f"{'segment':<16} {'mass [kg]':>9}  {'at':<16} coordinates"]
        for name, body in self.bodies.items():
            joint = held.get(body.name)
            at, free = ("", "") if joint is None else (joint.name, ", ".join(_coordinates(joint)))
            lines.append(f"{name:<16} {body.fields()['mass']:>9.3f}  {at:<16} {free}")
        return "\n".join(lines)


def _coordinates(joint: Joint) -> list[str]:
    """Names of the coordinates of a joint, a quaternion as one."""
    return list(dict.fromkeys(label.name.partition(".")[0] for label in joint.labels))


def _plain(each: Segment | Body, prefix: str) -> str:
    return each.name if isinstance(each, Segment) else each.name.removeprefix(prefix)


def human(
    mass: float, height: float, sex: str = "male", *, name: str = "", floating: bool = True, passive: bool = False
) -> Human:
    """A person of 15 rigid segments with 34 degrees of freedom: x forward, y up, z to the right.

    Segments by P. de Leva (J. Biomechanics 29 (1996) 1223): ``m = c_m M``, ``I = m (c_r L)²``, lengths in proportion to
    the height. The pelvis is the lower trunk, the torso the middle and the upper one together; neck and ankles fill
    up what the lengths of the table leave of the height. Joints lie on the middle line or straight below each other;
    the feet alone have parts ahead of it. Joints: 'trunk' (`Free`), 'back', 'neck', 'left shoulder', 'left hip'
    (`Spherical`), 'left elbow', 'left wrist', 'left knee' (`Revolute`), 'left ankle' (`Universal`), and the right ones.

    Parameters
    ----------
    mass : M [kg]
    height : H [m]
    sex : 'male' or 'female'
    name : put before all names, for several persons in one model
    floating : whether the pelvis floats against the ground; False: connect a body of it yourself
    passive : whether hips, knees and ankles resist at the ends of their range (see `mbd.parts.passive_moment`): they do
        with ``model.apply(*person.moments)`` beside ``model.connect(*person.joints)``; without it the model is in doubt

    Raises
    ------
    ModelError
        for numbers that are not positive, and a sex that the table has not.

    >>> import mbd
    >>> person = mbd.human(mass=70.0, height=1.75).without("left arm").changed("left knee", loss=mbd.Viscous(0.5))
    >>> model = mbd.Model("person")
    >>> model.connect(*person.joints)
    >>> model.check(), person.freedoms, round(person.mass, 3)
    ([], 29, 66.542)
    """
    M, H = sizes("human", mass=mass, height=height)
    if not SHORTEST <= H <= TALLEST:
        doubt(f"human: a height of {H:g} m; heights are in metres, masses in kg")
    if not LIGHTEST <= M <= HEAVIEST:
        doubt(f"human: a mass of {M:g} kg; masses are in kg, heights in metres")
    if not among(sex, SEXES):
        raise ModelError("human: " + nearest(sex, SEXES, "sex", "The table has"))
    prefix = "" if isinstance(name, str) and name == "" else f"{name_of(name, 'human')} "
    floats, resists = flag(floating, "floating of human"), flag(passive, "passive of human")
    segments = tuple(segments_of(M, H, sex))
    if not all(math.isfinite(moment) for each in segments for moment in each.solid.inertia):
        raise ModelError(f"human: a mass of {M:g} kg and a height of {H:g} m give no finite moments of inertia")
    return Human(prefix, segments, tuple(articulations()), floats, resists)
