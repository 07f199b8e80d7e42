"""Named angles of the joints of a body, after the recommendations of ISB.

The axes of both frames of a joint are x forward, y up, z to the right where it is at zero. Hip, knee, ankle, back,
neck, elbow and wrist take the joint coordinate system of Grood & Suntay (J. Biomech. Eng. 105 (1983) 136): a first turn
about z of the parent, a third about the long axis y of the child, the second about the floating axis across both,

    R = R_z(first) R_x(second) R_y(third)

(G. Wu et al., J. Biomechanics 35 (2002) 543: ankle, hip, spine; 38 (2005) 981: elbow, wrist). The shoulder takes
``R = R_y(plane) R_x(−elevation) R_y(rotation)`` (the same, 2005, humerus against thorax), whose plane is 0 for an arm
that is raised sideways and π/2 forward. While an arm hangs, plane and rotation are one turn, so that it has flexion
and adduction like a hip besides. A left joint is seen in the mirror, ``R ← S R S`` with S = diag(1, 1, −1): the same
pose of both sides has the same angles.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from mbd.bodies.algebra import IDENTITY, product, transpose
from mbd.bodies.scope import Rotation
from mbd.joints.euler import euler_angles

MIRROR: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
HALF_TURN: Rotation = ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
"""About y: before and after R it makes a turn about x one about −x."""
PALM_FORWARD: Rotation = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
"""Columns: axes of a right forearm in the sense of ISB, whose palm looks forward along x, in those of one whose palm
looks at the thigh."""


class System(NamedTuple):
    """A sequence with the names and signs of its angles; parent, child : axes before it, as columns in the joint's."""

    names: tuple[str, ...]
    signs: tuple[float, ...] = (1.0, 1.0, 1.0)
    sequence: str = "zxy"
    parent: Rotation = IDENTITY
    child: Rotation = IDENTITY


class Angle(NamedTuple):
    """An angle of a joint: its name, the one that tells where it is undetermined ('' for none), and its sequence."""

    name: str
    second: str
    sequence: str


LEG = System(("flexion", "adduction", "internal_rotation"))
KNEE = System(LEG.names, (-1.0, 1.0, 1.0))
ANKLE = System(("dorsiflexion", "inversion", "internal_rotation"))
SPINE = System(("flexion", "lateral_bending", "axial_rotation"), (-1.0, 1.0, 1.0))
RAISED = System(
    ("plane_of_elevation", "elevation", "internal_rotation"), sequence="yxy", parent=HALF_TURN, child=HALF_TURN
)
ARM = System(("flexion", "adduction"))
ELBOW = System(("flexion", "carrying_angle", "pronation"), child=PALM_FORWARD)
WRIST = System(("flexion", "ulnar_deviation", "axial_rotation"), parent=PALM_FORWARD, child=PALM_FORWARD)

SYSTEMS = {
    "hip": (LEG,), "knee": (KNEE,), "ankle": (ANKLE,), "shoulder": (RAISED, ARM), "elbow": (ELBOW,), "wrist": (WRIST,),
}  # fmt: skip

ANATOMY: dict[str, tuple[System, ...]] = {
    "back": (SPINE,),
    "neck": (SPINE,),
    **{f"{side} {name}": systems for side in ("left", "right") for name, systems in SYSTEMS.items()},
}
"""By the words that joints take as `anatomy`."""


def angles_of(anatomy: str) -> list[tuple[list[Angle], System]]:
    """The names of the angles of a joint of the body, by the sequence that they are read from; none for ''."""
    return [
        (
            [Angle(name, "" if k == 1 else system.names[1], system.sequence) for k, name in enumerate(system.names)],
            system,
        )
        for system in ANATOMY.get(anatomy, ())
    ]


def measured(R: Rotation, system: System, mirrored: bool) -> Sequence[Any]:
    """The angles of a system [rad] of a joint's rotation R, seen in a mirror or not."""
    seen = product(product(MIRROR, R), MIRROR) if mirrored else R
    angles = euler_angles(product(product(transpose(system.parent), seen), system.child), system.sequence)
    return [angle if sign > 0.0 else -angle for sign, angle in zip(system.signs, angles, strict=True)]
