"""What the functions of parts are given, checked at the border."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.values import name_of, number
from mbd.constraints.measure import Measure
from mbd.constraints.penalty import Penalty
from mbd.constraints.rules import When
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.joints.losses.base import Loss, loss_of
from mbd.topology.description import Description

Stop = Mapping[str, Any] | None
"""Arguments of the `Penalty` at a stop, such as {'stiffness': 1300.0, 'restitution': 0.4}; None: no stop."""


def check(model: Any, name: Any, part: str) -> Description:
    """The model that a part is added to, and its name."""
    if not isinstance(model, Description):
        raise ModelError(f"mbd.parts.{part} adds to a mbd.Model, its first argument; got {model!r}")
    name_of(name, part)
    return model


def between(part: str, name: str, **frames: Any) -> tuple[Frame, ...]:
    """Frames by what they are called."""
    return tuple(frame_of(frame, f"{called} of {part} '{name}'") for called, frame in frames.items())


def released(release: Any, after_impact: bool = False) -> Any:
    """A rule of release, of which the name of the other contact is the short form."""
    return When(release, after_impact=after_impact) if isinstance(release, str) else release


def added(name: str, *losses: Loss | None) -> Loss | None:
    """The sum of what there is of some losses."""
    total: Loss | None = None
    for loss in losses:
        given = loss_of(loss, name)
        if given is not None:
            total = given if total is None else total + given
    return total


def constrain_stop(model: Description, name: str, measure: Measure, stop: Stop, what: str = "stop") -> None:
    """Add the penalty contact '<name> <what>'."""
    if not isinstance(stop, Mapping):
        raise ModelError(f"{what} of '{name}' is a dictionary of arguments of mbd.Penalty, got {stop!r}")
    try:
        model.constrain(Penalty(f"{name} {what}", measure, **stop))
    except TypeError as error:
        text = f"{what} of '{name}': {error}; give arguments of mbd.Penalty such as stiffness=1300.0"
        raise ModelError(text) from None


def sizes(part: str, **values: Any) -> tuple[float, ...]:
    """Positive numbers by what they are called."""
    found = []
    for called, value in values.items():
        found.append(number(value, f"{called} of {part}"))
        if found[-1] <= 0.0:
            raise ModelError(f"{called} of {part} must be positive, got {found[-1]:g}")
    return tuple(found)
