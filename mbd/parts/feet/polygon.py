"""A foot that is a convex polygon: one contact at each corner."""

from collections.abc import Iterable
from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.values import is_several
from mbd.constraints.touchdown import touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.joints.losses.base import Loss
from mbd.parts.arguments import check, released
from mbd.topology.description import Description


def polygon_foot(
    model: Description, name: str, corners: Iterable[Frame], *, release: Any = None, only_while: Any = None,
    friction: float | Loss | None = None, spin_friction: float = 0.0, restitution: float = 0.0, ground: Any = None,
) -> tuple[Unilateral, ...]:  # fmt: skip
    """A convex polygon, or the corners of a box, over the ground: ``0 ≤ g ⟂ p ≥ 0`` at each corner.

    Passive; in the plane and in space. Over a plane no other point of a convex hull is lower than its lowest corner:
    it lands on a corner or an edge, tips over it, and lies flat, where the corners share its load. The contacts are
    '<name> corner 1', '<name> corner 2', …

    Parameters
    ----------
    model, name : the model, and the name that all contacts begin with
    corners : points of one body, two at least, none twice; those inside the hull never touch a plane
    release, only_while : as of `point_foot`, of all
    friction, spin_friction, restitution : as of `Unilateral`; None: corners stick
    ground : as of `touchdown`; on ground that is not flat only the corners touch

    >>> import mbd
    >>> model, foot = mbd.Model("foot"), mbd.RigidBody("foot", 1.0, (0.003, 0.003, 0.001))
    >>> model.connect(mbd.Free("float", model.ground.origin, foot.origin))
    >>> corners = [foot.point(x, -0.08, z) for x in (-0.06, 0.14) for z in (-0.04, 0.04)]
    >>> [contact.name for contact in mbd.parts.polygon_foot(model, "left", corners, friction=0.6)]
    ['left corner 1', 'left corner 2', 'left corner 3', 'left corner 4']
    """  # fmt: skip
    check(model, name, "polygon_foot")
    if isinstance(corners, Frame) or not is_several(corners):
        raise ModelError(f"corners of polygon_foot '{name}' are points of a body, two at least, got {corners!r}")
    points = [frame_of(corner, f"a corner of polygon_foot '{name}'") for corner in corners]
    if len(points) < 2:
        raise ModelError(
            f"corners of polygon_foot '{name}' are two at least, got {len(points)}; one is mbd.parts.point_foot"
        )
    bodies = list(dict.fromkeys(point.body.name for point in points))
    if len(bodies) > 1:
        raise ModelError(f"corners of polygon_foot '{name}' are points of one body, got those of {', '.join(bodies)}")
    if len({(point.name, point.offset) for point in points}) < len(points):
        raise ModelError(f"polygon_foot '{name}' has a corner twice; give each once")
    contacts = tuple(
        Unilateral(
            f"{name} corner {k}", touchdown(point, ground), friction=friction, release=released(release),
            only_while=only_while,
            spin_friction=spin_friction, restitution=restitution,
        )
        for k, point in enumerate(points, start=1)
    )  # fmt: skip
    model.constrain(*contacts)
    return contacts
