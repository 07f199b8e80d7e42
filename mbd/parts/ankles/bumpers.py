"""A single-axis ankle between two bumpers."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.base import Frame
from mbd.constraints.measures import extension, flexion
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import between, check, constrain_stop
from mbd.topology.description import Description


def bumper_ankle(
    model: Description, name: str, shank: Frame, foot: Frame, *, heel: Mapping[str, Any], toe: Mapping[str, Any],
    clearance: float = 0.0, loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A hinge with a rubber bumper for either direction, which push only: ``T = k δⁿ + c δ̇`` or Hunt and Crossley's
    law.

    The heel's bumper resists plantarflexion, ``δ = −q − clearance``, that of the toe dorsiflexion, ``δ = q −
    clearance``. Passive. The single-axis foot: D. A. Winter & S. E. Sienko, Biomechanics of below-knee amputee gait, J.
    Biomechanics 21 (1988) 361; contact laws as of `mbd.Penalty`.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the bumpers are '<name> heel bumper' and '<name> toe bumper'
    shank, foot : the frames that it joins
    heel, toe : arguments of the `Penalty`, such as {'stiffness': 150.0, 'damping': 1.0, 'release': 'pull'}
    clearance : angle to either side before they touch [rad]
    loss : of the hinge
    anatomy : the joint of the body that it is, 'left ankle', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model, foot = mbd.Model("leg"), mbd.RigidBody("foot", 0.8, 0.003)
    >>> model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    >>> soft, hard = ({"stiffness": k, "damping": 1.0, "release": "pull"} for k in (150.0, 600.0))
    >>> ankle = mbd.parts.bumper_ankle(model, "left ankle", shank.end, foot.origin, heel=soft, toe=hard)
    >>> model.check(), [word.name for word in model.constraints]
    ([], ['left ankle heel bumper', 'left ankle toe bumper'])
    """  # fmt: skip
    check(model, name, "bumper_ankle")
    between("bumper_ankle", name, shank=shank, foot=foot)
    ankle = Revolute(name, shank, foot, loss=loss, anatomy=anatomy)
    model.connect(ankle)
    for end, how, room in ("heel", heel, extension(ankle, -clearance)), ("toe", toe, flexion(ankle, -clearance)):
        constrain_stop(model, name, room, how, f"{end} bumper")
    return ankle
