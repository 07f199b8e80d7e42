"""A knee with a brake that the weight closes."""

from mbd.bodies.base import Frame
from mbd.joints.losses.base import Loss
from mbd.joints.losses.pin_friction import PinFriction
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, added, check
from mbd.parts.knees.hinge import stop_knee
from mbd.topology.description import Description


def friction_brake_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, mu: float, radius: float, stop: Stop = None,
    loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A single axis whose load presses a drum against its brake: ``|M| ≤ μ r N``, N the force in the knee.

    It sticks while it can, and slips beyond; unloaded, in swing, it is free but for its loss. Passive. C. W. Radcliffe,
    The Knud Jansen lecture: above-knee prosthetics, Prosthetics and Orthotics International 1 (1977) 146.

    Parameters
    ----------
    model, name : the model, and the name of the hinge
    thigh, shank : the frames that it joins
    mu : coefficient of friction of the brake; the run-time parameter '<name> loss.mu', or '<name> loss.pinfriction.mu'
        beside another loss
    radius : r of the drum [m]
    stop : as of `stop_knee`
    loss : of swing, such as Viscous(0.3)
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> knee = mbd.parts.friction_brake_knee(model, "left knee", thigh.end, shank.start, mu=0.4, radius=0.03)
    >>> model.check(), knee.loss.needs_reaction
    ([], True)
    """  # fmt: skip
    check(model, name, "friction_brake_knee")
    return stop_knee(
        model, name, thigh, shank, stop=stop, loss=added(name, PinFriction(mu, radius), loss), anatomy=anatomy
    )
