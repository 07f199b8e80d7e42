"""A knee with an electric motor."""

from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.user_measure import measure
from mbd.forces.dc_motor import DCMotor
from mbd.joints.losses.base import Loss
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, check, sizes
from mbd.parts.knees.hinge import stop_knee
from mbd.topology.description import Description


def powered_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, voltage: Any, resistance: float, constant: float,
    gear: float, rotor: float, mass: float, inductance: float = 0.0, arguments: Any = ("t",), stop: Stop = None,
    loss: Loss | None = None, anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A direct-current motor on the thigh that turns N times as fast as the knee: ``L di/dt = u − R i − k N q̇``, M = N
    k i.

    The rotor is a body, whose inertia J stands in the knee as N² J; a row holds its angle at N q. Not passive,
    unless u = 0: short-circuited it brakes with ``(N k)²/R`` at low rates. F. Sup, A. Bohara & M. Goldfarb, Design and
    control of a powered transfemoral prosthesis, Int. J. Robotics Research 27 (2008) 263.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the motor is '<name> motor' with the parameters 'voltage',
        'resistance', 'constant', 'inductance', the rotor's joint '<name> shaft', the row '<name> gear'
    thigh, shank : the frames that it joins
    voltage : u [V], as of `DCMotor`, a parameter that a controller may write where it is a number
    resistance, constant, inductance : R [Ω], k [N m/A], L [H] of the motor
    gear : N > 0
    rotor, mass : J about its axis [kg m²] and mass [kg] of the rotor, which turns in the axis of the knee
    arguments : what a function of the voltage is called with
    stop, loss : as of `stop_knee`
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> how = {"voltage": 5.0, "resistance": 0.3, "constant": 0.03, "inductance": 1e-4}
    >>> how |= {"gear": 150.0, "rotor": 1e-5, "mass": 0.1}
    >>> knee = mbd.parts.powered_knee(model, "left knee", thigh.end, shank.start, **how)
    >>> model.check(), model.parameters["left knee motor.voltage"]
    ([], 5.0)
    """  # fmt: skip
    check(model, name, "powered_knee")
    N, J, m = sizes(f"powered_knee '{name}'", gear=gear, rotor=rotor, mass=mass)
    knee = stop_knee(model, name, thigh, shank, stop=stop, loss=loss, anatomy=anatomy)
    shaft = Revolute(f"{name} shaft", thigh, RigidBody(f"{name} rotor", m, J).origin)
    model.connect(shaft)
    ahead = measure(_Gear(N), shaft, knee, unit="rad")
    model.constrain(Bilateral(f"{name} gear", ahead))
    how = {"resistance": resistance, "constant": constant, "inductance": inductance, "arguments": arguments}
    model.apply(DCMotor(f"{name} motor", shaft, voltage, **how))
    return knee


class _Gear:
    """How far the rotor is ahead of its gear, which a process can receive [rad]."""

    def __init__(self, ratio: float) -> None:
        self.ratio = ratio

    def __call__(self, shaft: Any, knee: Any) -> Any:
        return shaft - self.ratio * knee
