"""An ankle from the test bench."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.forces.tabulated_spring import TabulatedSpring
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import between, check
from mbd.topology.description import Description


def tabulated_ankle(
    model: Description,
    name: str,
    shank: Frame,
    foot: Frame,
    *,
    angle: Any,
    torque: Any,
    loss: Loss | None = None,
    anatomy: str = "",
) -> Revolute:
    """A hinge with a measured spring, ``V = ∫ T dq``: toes up (dorsiflexion) where q > 0, and the foot feels −T(q).

    Passive: a torque that follows the angle alone stores what it takes. Tables: M. Major, J. Scham & M. Orendurff, The
    effects of common footwear on stance-phase mechanical properties of the prosthetic foot-shoe system, Prosthetics and
    Orthotics International 42 (2018) 198, among many. Curve: see `TabulatedSpring`.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the spring is '<name> spring'
    shank, foot : the frames that it joins
    angle, torque : the table [rad, N m]; the torque rises with the angle
    loss : hysteresis, such as Viscous(0.5) or Tabulated(…)
    anatomy : the joint of the body that it is, 'left ankle', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model, foot = mbd.Model("leg"), mbd.RigidBody("foot", 0.8, 0.003)
    >>> model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    >>> bench = {"angle": [-0.15, 0.0, 0.1, 0.2], "torque": [-20.0, 0.0, 30.0, 90.0]}
    >>> ankle = mbd.parts.tabulated_ankle(model, "left ankle", shank.end, foot.origin, **bench)
    >>> model.check(), model.forces[0].name
    ([], 'left ankle spring')
    """
    check(model, name, "tabulated_ankle")
    between("tabulated_ankle", name, shank=shank, foot=foot)
    ankle = Revolute(name, shank, foot, loss=loss, anatomy=anatomy)
    model.connect(ankle)
    model.apply(TabulatedSpring(f"{name} spring", ankle, angle, torque))
    return ankle
