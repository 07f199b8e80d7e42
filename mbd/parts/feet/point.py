"""A foot that is a point."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.touchdown import touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.joints.losses.base import Loss
from mbd.parts.arguments import check, released
from mbd.topology.description import Description


def point_foot(
    model: Description,
    name: str,
    point: Frame,
    *,
    release: Any = None,
    only_while: Any = None,
    friction: float | Loss | None = None,
    ground: Any = None,
) -> Unilateral:
    """A point that strikes without bouncing and then sticks, or slips with friction: ``0 ≤ g ⟂ p ≥ 0``.

    Passive. The point foot of the simplest walkers: M. Garcia, A. Chatterjee, A. Ruina & M. Coleman, The simplest
    walking model, J. Biomech. Eng. 120 (1998) 281.

    Parameters
    ----------
    model, name : the model, and the name of the contact
    point : where it meets the ground
    release : name of the foot that takes over as it strikes (McGeer's rule), or `When`; None: it opens on pull. With
        ``When(other, may_pull=False)`` it opens by either; friction of a foot that pulls is 0, never negative
    only_while : as of `Unilateral`: it may touch only then, so that the swing foot of a straight leg passes the ground
    friction : μ; None: it sticks; or a loss of the speed of the slip, as of `Unilateral`
    ground : as of `touchdown`

    >>> import mbd
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=3.0, length=0.4, center=0.2)
    >>> model.connect(mbd.Planar("body", model.ground.origin, shank.start))
    >>> mbd.parts.point_foot(model, "left foot", shank.end, friction=0.8).slides
    True
    """
    check(model, name, "point_foot")
    foot = Unilateral(
        name, touchdown(point, ground), friction=friction, release=released(release), only_while=only_while
    )
    model.constrain(foot)
    return foot
