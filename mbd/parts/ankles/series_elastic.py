"""An ankle that a motor drives through a spring."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.rigid_body import RigidBody
from mbd.forces.motor import Motor
from mbd.forces.potential import Potential
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import between, check, sizes
from mbd.topology.description import Description


def series_elastic_ankle(
    model: Description, name: str, shank: Frame, foot: Frame, *, torque: Any, stiffness: float, inertia: float,
    mass: float, arguments: Any = ("t",), loss: Loss | None = None, motor_loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A motor turns a drive on the shank, which pulls the foot by a spring: ``J q̈_d = τ − k (q_d − q)``.

    Not passive, unless τ = 0. G. A. Pratt & M. M. Williamson, Series elastic actuators, Proc. IEEE/RSJ Int. Conf. on
    Intelligent Robots and Systems (1995) 399; in ankles S. K. Au, J. Weber & H. Herr, Powered ankle–foot prosthesis
    improves walking metabolic economy, IEEE Trans. Robotics 25 (2009) 51.

    Parameters
    ----------
    model, name : the model, and the name of the ankle; the drive's joint is '<name> drive', its motor '<name> motor',
        the spring '<name> spring' with the run-time parameter 'stiffness'
    shank, foot : the frames that it joins
    torque : τ behind the gear [N m], as of `Motor`; 0 where it is passive
    stiffness : k of the spring [N m/rad]
    inertia, mass : J of the drive about the ankle, with the gear's N² times that of the rotor [kg m²]; its mass [kg]
    arguments : what a function of the torque is called with
    loss, motor_loss : of the ankle, and of the drive's joint
    anatomy : the joint of the body that it is, 'left ankle', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model, foot = mbd.Model("leg"), mbd.RigidBody("foot", 0.8, 0.003)
    >>> model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    >>> how = {"torque": lambda t: 20.0 * mbd.sin(5.0 * t), "stiffness": 300.0, "inertia": 0.05, "mass": 0.3}
    >>> ankle = mbd.parts.series_elastic_ankle(model, "left ankle", shank.end, foot.origin, **how)
    >>> model.check(), model.parameters["left ankle spring.stiffness"]
    ([], 300.0)
    """  # fmt: skip
    check(model, name, "series_elastic_ankle")
    between("series_elastic_ankle", name, shank=shank, foot=foot)
    J, m = sizes(f"series_elastic_ankle '{name}'", inertia=inertia, mass=mass)
    drive = Revolute(f"{name} drive", shank, RigidBody(f"{name} pulley", m, J).origin, loss=motor_loss)
    ankle = Revolute(name, shank, foot, loss=loss, anatomy=anatomy)
    model.connect(drive, ankle)
    stretch = (f"{name} drive.angle", f"{name}.angle", ("stiffness", stiffness))
    model.apply(Potential(f"{name} spring", _stored, stretch), Motor(f"{name} motor", drive, torque, arguments))
    return ankle


def _stored(drive: Any, ankle: Any, stiffness: Any) -> Any:
    """½ k (q_d − q)²."""
    return 0.5 * stiffness * (drive - ankle) * (drive - ankle)
