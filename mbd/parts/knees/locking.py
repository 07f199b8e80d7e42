"""A knee that locks."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.measures import flexion
from mbd.constraints.unilateral import Unilateral
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import between, check, released
from mbd.topology.description import Description


def locking_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, release: Any = None, restitution: float = 0.0,
    loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A hinge that swings out and locks as it is straight, by an impact, until the other foot has struck: ``0 ≤ −q ⟂
    p``.

    Passive: the impact takes ``½ (1 − e²) γ²/(J M⁻¹ Jᵀ)``. T. McGeer, Passive walking with knees, Proc. IEEE Conf.
    Robotics and Automation (1990) 1640; V. F. Hsu Chen, Passive dynamic walking with knees, M.Eng. thesis, MIT (2007).

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the lock is '<name> lock'
    thigh, shank : the frames that it joins
    release : name of the contact after whose impact it unlocks, the foot that takes over, or `When`; None: it opens as
        it would pull, like a stop
    restitution : e of the lock
    loss : of the hinge
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=0.5, length=0.5, center=0.3)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=0.05, length=0.5, center=0.1)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> knee = mbd.parts.locking_knee(model, "left knee", thigh.end, shank.start)
    >>> model.check(), [word.name for word in model.constraints]
    ([], ['left knee lock'])
    """  # fmt: skip
    check(model, name, "locking_knee")
    between("locking_knee", name, thigh=thigh, shank=shank)
    knee = Revolute(name, thigh, shank, loss=loss, anatomy=anatomy)
    model.connect(knee)
    rule = released(release, after_impact=True)
    model.constrain(Unilateral(f"{name} lock", flexion(knee), restitution=restitution, release=rule))
    return knee
