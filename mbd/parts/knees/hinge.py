"""A knee on one axis, with any loss and a stop."""

from mbd.bodies.base import Frame
from mbd.constraints.measures import flexion
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, between, check, constrain_stop
from mbd.topology.description import Description


def stop_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, stop: Stop = None, loss: Loss | None = None,
    stiffness: float = 0.0, rest: float = 0.0, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A hinge with a rubber stop at full extension, which pushes only; in stance the weight holds it there.

    ``p = k δⁿ (1 + χ δ̇/δ̇₀)`` or ``k δⁿ + c δ̇`` of the hyperextension δ = q > 0: see `mbd.Penalty`. Passive.
    K. H. Hunt & F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42
    (1975) 440.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the stop is '<name> stop'
    thigh, shank : the frames that it joins; the knee bends with negative angles
    stop : arguments of the `Penalty`, such as {'stiffness': 1300.0, 'restitution': 0.4}; None: no stop
    loss : of the hinge
    stiffness, rest : of its spring, an extension assist with rest > 0 [N m/rad, rad]
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> rubber = {"stiffness": 1300.0, "restitution": 0.4}
    >>> knee = mbd.parts.stop_knee(model, "left knee", thigh.end, shank.start, stop=rubber, loss=mbd.Viscous(0.7))
    >>> model.check(), model.parameters["left knee stop.stiffness"]
    ([], 1300.0)
    """  # fmt: skip
    check(model, name, "stop_knee")
    between("stop_knee", name, thigh=thigh, shank=shank)
    knee = Revolute(name, thigh, shank, loss=loss, stiffness=stiffness, rest=rest, anatomy=anatomy)
    model.connect(knee)
    if stop is not None:
        constrain_stop(model, name, flexion(knee), stop)
    return knee
