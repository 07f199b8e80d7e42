"""A hydraulic ankle."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.values import is_number
from mbd.joints.losses.base import Loss
from mbd.joints.losses.valves import Valves
from mbd.joints.losses.viscous import Viscous
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import added, between, check
from mbd.topology.description import Description


def hydraulic_ankle(
    model: Description, name: str, shank: Frame, foot: Frame, *, plantarflexion: Any, dorsiflexion: Any,
    stiffness: float = 0.0, rest: float = 0.0, loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A hinge whose cylinder resists plantarflexion and dorsiflexion by valves of their own, beside a spring.

    ``T = k (q − rest) + c q̇`` with c of plantarflexion where q̇ < 0, of dorsiflexion where q̇ > 0. Passive. A. R. De
    Asha, R. Munjal, J. Kulkarni & J. G. Buckley, Walking speed related joint kinetic alterations in trans-tibial
    amputees: impact of hydraulic 'ankle' damping, J. NeuroEngineering and Rehabilitation 10 (2013) 107.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; its run-time parameters are '<name> loss.backward.coefficient'
        (plantarflexion), '<name> loss.forward.coefficient' and '<name> spring.stiffness'
    shank, foot : the frames that it joins
    plantarflexion, dorsiflexion : c [N m s/rad], or any loss that does not stick
    stiffness, rest : of the spring [N m/rad, rad]
    loss : beside them
    anatomy : the joint of the body that it is, 'left ankle', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model, foot = mbd.Model("leg"), mbd.RigidBody("foot", 0.8, 0.003)
    >>> model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    >>> how = {"plantarflexion": 8.0, "dorsiflexion": 20.0, "stiffness": 100.0}
    >>> ankle = mbd.parts.hydraulic_ankle(model, "left ankle", shank.end, foot.origin, **how)
    >>> model.check(), model.parameters["left ankle loss.forward.coefficient"]
    ([], 20.0)
    """  # fmt: skip
    check(model, name, "hydraulic_ankle")
    between("hydraulic_ankle", name, shank=shank, foot=foot)
    down, up = (Viscous(value) if is_number(value) else value for value in (plantarflexion, dorsiflexion))
    ankle = Revolute(
        name, shank, foot, loss=added(name, Valves(down, up), loss), stiffness=stiffness, rest=rest, anatomy=anatomy
    )
    model.connect(ankle)
    return ankle
