"""A knee whose brake follows the phase of the gait."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.values import is_number, number
from mbd.constraints.controller import Controller
from mbd.errors import ModelError
from mbd.joints.losses.coulomb import Coulomb
from mbd.joints.losses.viscous import Viscous
from mbd.joints.revolute import Revolute
from mbd.parts.arguments import Stop, check
from mbd.parts.knees.hinge import stop_knee
from mbd.topology.description import Description

PHASES = ("stance flexion", "stance extension", "swing flexion", "swing extension")
"""What a phase may be: whether the foot bears load, and whether the knee bends or stretches."""


def phase(load: float, rate: float, threshold: float = 20.0) -> str:
    """The phase of a knee: stance where the load of its foot [N] is above a threshold, flexion where its rate is
    negative.

    >>> phase(400.0, -1.0), phase(0.0, 2.0)
    ('stance flexion', 'swing extension')
    """
    return f"{'stance' if load > threshold else 'swing'} {'flexion' if rate < 0.0 else 'extension'}"


def magnetorheological_knee(
    model: Description, name: str, thigh: Frame, shank: Frame, *, torques: Mapping[str, float], viscous: float,
    foot: str, threshold: float = 20.0, period: float = 2e-3, smoothing: float | None = 0.01, stop: Stop = None,
    anatomy: str = "",
) -> Revolute:  # fmt: skip
    """A Bingham brake, ``M = τ Sgn ω + c ω``, whose yield torque τ a controller sets by the phase of the gait.

    Passive at every τ ≥ 0: the controller decides how much is lost, and gives nothing. H. Herr & A. Wilkenfeld,
    User-adaptive control of a magnetorheological prosthetic knee, Industrial Robot 30 (2003) 42: a state machine of
    stance and swing, flexion and extension.

    Parameters
    ----------
    model, name : the model, and the name of the hinge; the controller is '<name> control', which writes
        '<name> loss.coulomb.torque'
    thigh, shank : the frames that it joins
    torques : τ by phase, all of `PHASES` [N m]: {'stance flexion': 40, 'stance extension': 5, …}
    viscous : c of the fluid and bearings [N m s/rad]
    foot : name of the contact that bears load in stance; its 'force' is read
    threshold : load above which it is stance [N]
    period : of the controller [s]
    smoothing : rate over which the yield torque sets in [rad/s]; None: it truly sticks
    stop : as of `stop_knee`
    anatomy : the joint of the body that it is, 'left knee', for angles of ISB beside its own (`Revolute`)

    >>> import mbd
    >>> thigh = mbd.Link("thigh", mass=7.0, length=0.4, center=0.2, inertia=0.1)
    >>> model, shank = mbd.Model("leg"), mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    >>> model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    >>> foot = mbd.parts.point_foot(model, "left foot", shank.end)
    >>> torques = dict(zip(mbd.parts.PHASES, (40.0, 5.0, 2.0, 1.0)))
    >>> how = {"torques": torques, "viscous": 0.3, "foot": "left foot"}
    >>> knee = mbd.parts.magnetorheological_knee(model, "left knee", thigh.end, shank.start, **how)
    >>> model.check(), model.controllers[0].writes
    ([], ('left knee loss.coulomb.torque',))
    """  # fmt: skip
    check(model, name, "magnetorheological_knee")
    known = _torques(torques, name)
    if not isinstance(foot, str):
        raise ModelError(f"foot of magnetorheological_knee '{name}' is the name of a contact, got {foot!r}")
    limit = number(threshold, f"threshold of magnetorheological_knee '{name}'")
    loss = Coulomb(known["swing flexion"], smoothing) + Viscous(viscous)
    knee = stop_knee(model, name, thigh, shank, stop=stop, loss=loss, anatomy=anatomy)
    control = _Control(known, f"{foot}.force", f"{name}.angle.rate", f"{name} loss.coulomb.torque", limit)
    reads, writes = (f"{foot}.force", f"{name}.angle.rate"), (f"{name} loss.coulomb.torque",)
    model.apply(Controller(f"{name} control", control, period=period, reads=reads, writes=writes))
    return knee


def _torques(values: Any, name: str) -> dict[str, float]:
    """The torques of all phases, checked."""
    if not isinstance(values, Mapping) or set(values) != set(PHASES):
        raise ModelError(
            f"torques of magnetorheological_knee '{name}' tells each of {', '.join(map(repr, PHASES))}; got {values!r}"
        )
    for kind, value in values.items():
        if not is_number(value) or value < 0.0:
            raise ModelError(f"torques of magnetorheological_knee '{name}': '{kind}' must be ≥ 0 N m, got {value!r}")
    return {kind: float(value) for kind, value in values.items()}


class _Control:
    """The state machine, which a process can receive."""

    def __init__(self, torques: dict[str, float], load: str, rate: str, writes: str, threshold: float) -> None:
        self.torques, self.load, self.rate = torques, load, rate
        self.writes, self.threshold = writes, threshold

    def __call__(self, time: float, values: Mapping[str, float], state: Any) -> dict[str, float]:
        """The yield torque of the phase."""
        return {self.writes: self.torques[phase(values[self.load], values[self.rate], self.threshold)]}
