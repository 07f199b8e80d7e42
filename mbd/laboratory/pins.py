"""Friction of pins in inverse dynamics: it follows the force in its joint, which the motion tells."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from operator import is_
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.joints.base import Joint
from mbd.joints.losses import PinFriction
from mbd.joints.losses.base import LossSum
from mbd.results.trajectory import Trajectory

KNOWN: WeakKeyDictionary[Any, tuple[tuple[Joint, ...], Any, tuple[Pin, ...]]] = WeakKeyDictionary()
"""Joints of models, and these without the friction of their pins, made once for the same joints."""


@dataclass(frozen=True)
class Pin:
    """The friction of a joint, and the owner of its parameters: 'knee loss', 'knee loss.pin friction'."""

    joint: str
    owner: str
    loss: PinFriction

    def radius(self, changed: Mapping[str, float]) -> float:
        """μ r [m]."""
        mu, r = (float(changed.get(f"{self.owner}.{k}", getattr(self.loss, k))) for k in ("mu", "radius"))
        return mu * r


def without_pins(model: Any) -> tuple[Any, tuple[Pin, ...]]:
    """The model without the friction of its pins, whose joints need not be cut then, and these pins.

    Raises
    ------
    CapabilityError
        for one on a joint of several coordinates.
    """
    joints = getattr(model, "joints", ())
    if not any(loss.needs_reaction for joint in joints for _, _, loss in joint.losses()):
        return model, ()
    known, other, found = KNOWN.get(model, ((), None, ()))
    if len(known) == len(joints) and all(map(is_, known, joints)):
        vars(other).update({**vars(model), "joints": other.joints})  # the rest of the model may have changed since
        return other, found
    pins: list[Pin] = []
    bare: list[Joint] = []
    for joint in joints:
        loss: Any = getattr(joint, "loss", None)
        parts = loss.named(f"{joint.name} loss") if isinstance(loss, LossSum) else [(f"{joint.name} loss", loss)]
        own = [(owner, part) for owner, part in parts if isinstance(part, PinFriction) and part.needs_reaction]
        if not own and any(part.needs_reaction for _, _, part in joint.losses()):
            raise CapabilityError(
                f"inverse dynamics: the friction of '{joint.name}' follows the force in a joint of several "
                f"coordinates; leave it out by model.without('{joint.name} loss')"
            )
        pins += [Pin(joint.name, owner, part) for owner, part in own if isinstance(part, PinFriction)]
        rest = [(owner.removeprefix(f"{joint.name} loss."), part) for owner, part in parts if (owner, part) not in own]
        left = LossSum(tuple(part for _, part in rest), tuple(name for name, _ in rest)) if rest else None
        bare.append(replace(joint, loss=left) if own else joint)
    other = copy.copy(model)
    other.joints = bare
    KNOWN[model] = tuple(joints), other, tuple(pins)
    return other, tuple(pins)


def pin_moments(
    pins: Sequence[Pin], run: Trajectory, names: Sequence[str], changed: Mapping[str, float]
) -> tuple[Matrix, list[str]]:
    """``−μ r N Sgn(v)`` along the velocities (R, n_v) [N m], and what to say of pins at rest.

    N is the resultant of the force in the joint. What turns a joint about its own axis changes nothing of the forces
    that it carries, so that they are those of the motion without friction.

    names : of the velocities
    """
    found, notes = np.zeros((len(run.time), len(names))), []
    for pin in pins:
        if f"{pin.joint}.angle.rate" not in names:
            raise CapabilityError(
                f"inverse dynamics: the friction of '{pin.joint}' follows its force, and the joint closes a loop; cut "
                "another joint of the loop with cut=['…'] of the model"
            )
        k = list(names).index(f"{pin.joint}.angle.rate")
        load = np.linalg.norm(run[f"{pin.joint}.reaction_force"], axis=1)
        rate = run.record.v[:, k]
        found[:, k] -= pin.radius(changed) * load * np.sign(rate)
        still = int(np.sum(rate == 0.0))
        if still:
            notes.append(f"the pin of {pin.joint!r} is at rest in {still} frames, where its friction is taken as none")
    return found, notes
