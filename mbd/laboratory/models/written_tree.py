"""A model as other programs write it down: bodies with numbers, joints with frames, one after the other."""

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Body, Frame
from mbd.constraints.measures import JointMeasure
from mbd.constraints.unilateral import Unilateral
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.joints.prismatic import Prismatic
from mbd.joints.reversed import Reversed
from mbd.joints.revolute import Revolute
from mbd.joints.weld import Weld
from mbd.laboratory.models.report import ImportReport
from mbd.topology.plan import uncut

Place = tuple[Vector, Matrix]
"""Origin and axes (columns) of a frame in those of its body."""


class _Numbers:
    """Parameters as numbers, for words that ask a scope for them."""

    def __init__(self, parameters: dict[str, float]) -> None:
        self._known = parameters

    def parameter(self, owner: str, field: str, value: float) -> Any:
        """The model's value."""
        return float(self._known.get(f"{owner}.{field}", value))


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass [kg], center of mass [m] and inertia about it [kg m²] in axes of a body."""

    mass: float
    center: Vector
    inertia: Matrix


@dataclass(frozen=True, eq=False)
class WrittenJoint:
    """A joint of the tree, its child farther from the ground; `sign` is −1 where it was connected backwards."""

    joint: Joint
    parent: Frame
    child: Frame
    sign: float = 1.0


def tree_to_write(model: Any) -> tuple[list[WrittenJoint], list[str]]:
    """Joints from the ground outwards, and what of the model they do not tell.

    Raises
    ------
    ModelError
        for a joint that is connected backwards and has several coordinates.
    """
    found = []
    plan = uncut(model)
    for joint in plan.edges:
        if isinstance(joint, Reversed):
            inner = joint.joint
            if not isinstance(inner, Revolute | Prismatic | Weld):
                raise ModelError(
                    f"joint '{inner.name}' leads from the outer body to the inner one; exchange its frames to write it"
                )
            found.append(WrittenJoint(inner, inner.child, inner.parent, -1.0))
        else:
            found.append(WrittenJoint(joint, joint.parent, joint.child))
    left = [f"joint {joint.name!r}, which closes a loop" for joint in plan.cut]
    left += [
        f"joint {each.joint.name!r}, added for a body that floats" for each in found if each.joint in plan.floating
    ]
    return found, left


def stops_of(model: Any, tree: list[WrittenJoint]) -> list[tuple[str, JointMeasure]]:
    """Names and measures of the stops on coordinates of the joints that are written."""
    written = {each.joint.name for each in tree}
    stops = [(word.name, word.measure) for word in model.constraints if isinstance(word, Unilateral)]
    return [
        (name, measure)
        for name, measure in stops
        if isinstance(measure, JointMeasure) and abs(measure.sign) == 1.0 and measure.joint.name in written
    ]


def inertial_of(body: Body, parameters: dict[str, float], report: ImportReport) -> Inertial:
    """The numbers of a body.

    A body of the plane has a moment about z alone, which other programs refuse. About x and y it gets half of that, as
    a lamina has, which enters no motion in the plane; the report tells.
    """
    found: Any = body.mass_properties(_Numbers(parameters))
    inertia = np.array([[float(x) for x in row] for row in found.inertia])
    moment = inertia[2, 2]
    if moment != 0.0 and np.array_equal(inertia, np.diag([0.0, 0.0, moment])):
        inertia = np.diag([0.5 * moment, 0.5 * moment, moment])
        report.approximated.append(
            f"moments of {body.name!r} about x and y, of which it has none: half of that about z"
        )
    return Inertial(float(found.mass), np.array([float(x) for x in found.center]), inertia)


def place_of(frame: Frame, parameters: dict[str, float]) -> Place:
    """Where a frame is on its body."""
    R, p = frame.placement(_Numbers(parameters))
    return np.array([float(x) for x in p]), np.array([[float(x) for x in row] for row in R])


def turned_to(axis: Any, onto: int) -> Matrix:
    """A rotation whose column `onto` is an axis."""
    z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    other = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(other, z) / np.linalg.norm(np.cross(other, z))
    found = np.zeros((3, 3))
    found[:, onto], found[:, (onto + 1) % 3] = z, x
    found[:, (onto + 2) % 3] = np.cross(z, x)
    straight = np.eye(3)
    return straight if np.allclose(straight[:, onto], z, atol=0.0) else found
