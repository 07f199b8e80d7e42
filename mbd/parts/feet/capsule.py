"""A foot that is a capsule: two balls at the ends of an edge, and the straight line between."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.sphere_touchdown import sphere_touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss
from mbd.parts.arguments import between, check, released, sizes
from mbd.topology.description import Description


def capsule_foot(
    model: Description, name: str, first: Frame, second: Frame, radius: float, *, release: Any = None,
    only_while: Any = None,
    friction: float | Loss | None = None, spin_friction: float = 0.0, restitution: float = 0.0, ground: Any = None,
) -> tuple[Unilateral, Unilateral]:  # fmt: skip
    """A capsule over a plane: ``0 ≤ g ⟂ p ≥ 0`` of the ball at either end, g = n · s − r.

    Passive; in the plane and in space. The height of a capsule over a plane is that of its lower end, so that two balls
    are the whole of it: tilted it rolls and slides on one end, level it lies on both, which share its load. The
    contacts are '<name> end 1' and '<name> end 2'.

    Parameters
    ----------
    model, name : the model, and the name that both contacts begin with
    first, second : the middles of the ends, points of one body
    radius : r > 0; the run-time parameters '<point>.radius' [m]
    release, only_while : as of `point_foot`, of both
    friction, spin_friction, restitution : as of `Unilateral`; None: it rolls
    ground : None for y = 0, or a `Plane`, which may lie on another body, or run

    >>> import mbd
    >>> model, foot = mbd.Model("foot"), mbd.RigidBody("foot", 1.0, (0.003, 0.003, 0.001))
    >>> model.connect(mbd.Free("float", model.ground.origin, foot.origin))
    >>> ends = foot.point(-0.06, -0.05), foot.point(0.14, -0.05)
    >>> heel, toe = mbd.parts.capsule_foot(model, "left", *ends, 0.03, friction=0.6)
    >>> heel.name, toe.name
    ('left end 1', 'left end 2')
    """  # fmt: skip
    check(model, name, "capsule_foot")
    ends = between("capsule_foot", name, first=first, second=second)
    (size,) = sizes("capsule_foot", radius=radius)
    if ends[0].body is not ends[1].body:
        raise ModelError(
            f"capsule_foot '{name}': its ends are on '{ends[0].body.name}' and '{ends[1].body.name}'; give two points "
            "of one body"
        )
    one, two = (
        Unilateral(
            f"{name} end {k}", sphere_touchdown(end, size, ground), friction=friction, release=released(release),
            only_while=only_while,
            spin_friction=spin_friction, restitution=restitution,
        )
        for k, end in enumerate(ends, start=1)
    )  # fmt: skip
    model.constrain(one, two)
    return one, two
