"""A foot with a heel and a toe."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.unilateral import Unilateral
from mbd.parts.arguments import between, check
from mbd.parts.feet.point import point_foot
from mbd.topology.description import Description


def heel_and_toe(
    model: Description, name: str, heel: Frame, toe: Frame, *, release: Any = None,
    only_while: Any = None, friction: float | None = None,
    ground: Any = None,
) -> tuple[Unilateral, Unilateral]:  # fmt: skip
    """Two points that strike and stick each on its own: the foot lands on the heel, lies flat, and tips over the toe.

    Passive. The contacts are '<name> heel' and '<name> toe'. Flat on the ground, two sticking points hold one direction
    twice; their friction is shared such that Σλ² is least. M. Wisse, D. G. E. Hobbelen, R. J. J. Rotteveel, S. O.
    Anderson & G. J. Zeglin, Ankle springs instead of arc-shaped feet for passive dynamic walkers, IEEE-RAS Int. Conf.
    on Humanoid Robots (2006) 110.

    Parameters
    ----------
    model, name : the model, and the name that both contacts begin with
    heel, toe : points of the foot
    release, only_while : as of `point_foot`, of both; None: each opens on pull
    friction, ground : as of `point_foot`

    >>> import mbd
    >>> model, foot = mbd.Model("foot"), mbd.RigidBody("foot", 1.0, 0.003)
    >>> model.connect(mbd.Planar("body", model.ground.origin, foot.origin))
    >>> heel, toe = mbd.parts.heel_and_toe(model, "left", foot.point(-0.06, -0.08), foot.point(0.14, -0.08))
    >>> heel.name, toe.name
    ('left heel', 'left toe')
    """  # fmt: skip
    check(model, name, "heel_and_toe")
    ends = between("heel_and_toe", name, heel=heel, toe=toe)
    first, second = (
        point_foot(
            model, f"{name} {end}", frame, release=release, only_while=only_while, friction=friction, ground=ground
        )
        for end, frame in zip(("heel", "toe"), ends, strict=True)
    )
    return first, second
