"""A foot with a roll-over shape."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.rolling_touchdown import profile_touchdown
from mbd.constraints.unilateral import Unilateral
from mbd.parts.arguments import check, released
from mbd.topology.description import Description


def profile_foot(
    model: Description, name: str, frame: Frame, sole: Any, *, release: Any = None,
    only_while: Any = None, friction: float | None = None,
    ground: Any = None,
) -> Unilateral:  # fmt: skip
    """A convex sole that strikes without bouncing and rolls along its length: ``g = y_O − h(ψ)``, ``v_O + h φ̇ = 0``.

    Without `friction` it sticks whatever its force may be. A leg that falls over on such a sole comes to where it can
    neither stay nor leave, and the run ends with the same switches again and again; with friction=0.6 it slips and goes
    on.

    Passive. A. H. Hansen, D. S. Childress & E. H. Knox, Roll-over shapes of human locomotor systems, Clinical
    Biomechanics 19 (2004) 407: shapes of feet and prostheses as points in axes of the shank.

    Parameters
    ----------
    model, name : the model, and the name of the contact
    frame : in whose axes the sole lies: that of the shank for a roll-over shape of ankle and foot
    sole : (n ≥ 3, 2) points from heel to toe [m], or the support function h(ψ); see `profile_touchdown`
    release, only_while, friction, ground : as of `point_foot`; the ground is a plane

    >>> import mbd
    >>> model, leg = mbd.Model("leg"), mbd.Link("leg", mass=3.0, length=0.9, center=0.4)
    >>> model.connect(mbd.Planar("body", model.ground.origin, leg.start))
    >>> shape = [(-0.05, 0.005), (0.0, 0.0), (0.06, 0.003), (0.13, 0.02)]
    >>> foot = mbd.parts.profile_foot(model, "left foot", leg.end, shape, friction=0.6)
    >>> model.check(), foot.measure.sole
    ([], <Sole of circumference 0.363228 m>)
    """  # fmt: skip
    check(model, name, "profile_foot")
    foot = Unilateral(
        name,
        profile_touchdown(frame, sole, ground),
        friction=friction,
        release=released(release),
        only_while=only_while,
    )
    model.constrain(foot)
    return foot
