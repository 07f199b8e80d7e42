"""A foot that is an arc."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.rolling_touchdown import rolling_touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.parts.arguments import check, released
from mbd.topology.description import Description


def arc_foot(
    model: Description, name: str, center: Frame, radius: float, *, release: Any = None,
    only_while: Any = None, friction: float | None = None,
    ground: Any = None,
) -> Unilateral:  # fmt: skip
    """A round foot that strikes without bouncing and rolls: ``g = y_C − r``, ``v_C + r φ̇ = 0`` at the touching point.

    Passive. T. McGeer, Passive dynamic walking, Int. J. Robotics Research 9 (1990) 62, whose radius was 0.3 leg
    lengths.

    Parameters
    ----------
    model, name : the model, and the name of the contact
    center : of the arc, a frame of the shank or foot
    radius : r > 0 [m]; the run-time parameter '<center>.radius'
    release, only_while, friction, ground : as of `point_foot`; the ground is a plane

    >>> import mbd
    >>> model, leg = mbd.Model("leg"), mbd.Link("leg", mass=3.0, length=1.0, center=0.5)
    >>> model.connect(mbd.Planar("body", model.ground.origin, leg.start))
    >>> foot = mbd.parts.arc_foot(model, "left foot", leg.point(0.0, -0.7, name="arc"), 0.3)
    >>> model.check(), model.parameters["leg.arc.radius"]
    ([], 0.3)
    """  # fmt: skip
    check(model, name, "arc_foot")
    foot = Unilateral(
        name,
        rolling_touchdown(center, radius, ground),
        friction=friction,
        release=released(release),
        only_while=only_while,
    )
    model.constrain(foot)
    return foot
