"""Curves over the stride, 0 to 100 %: joints and the reaction of the ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbd.analysis.gait_report.moments import Moments
from mbd.analysis.gait_report.strides import Side, Stride, base_name, of_side
from mbd.arrays import Matrix, Vector

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["PERCENT", "Curve", "curves_of"]

PERCENT = np.linspace(0.0, 100.0, 101)
"""Share of the stride [%]."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A quantity over the stride of one side.

    subject : 'knee' or 'ground'; quantity : 'angle', 'moment', 'power', 'normal force', 'forward force'; unit
    mean, spread : (101,) over the strides, the spread being their standard deviation
    """

    side: str
    subject: str
    quantity: str
    unit: str
    mean: Vector
    spread: Vector

    @property
    def title(self) -> str:
        """'knee angle'."""
        return f"{self.subject} {self.quantity}"


def curves_of(run: Trajectory, sides: Sequence[Side], mass: float | None) -> list[Curve]:
    """All curves of all sides; moments, powers and forces over the mass where it is given."""
    angles = {side.name: _angles(run, side.name) for side in sides}
    joints = [name for own in angles.values() for name in own]
    moments = Moments(run, joints)
    per = "" if mass is None else "/kg"
    scale = 1.0 if mass is None else 1.0 / mass
    found = []
    for side in sides:
        samples = [_sampled(run, side, stride, list(angles[side.name]), moments) for stride in side.strides]
        for name, subject in angles[side.name].items():
            found.append(_curve(samples, side, subject, "angle", "°", f"{name}", np.rad2deg(1.0)))
            if name in moments.known:
                found.append(_curve(samples, side, subject, "moment", f"N m{per}", f"{name} moment", scale))
                found.append(_curve(samples, side, subject, "power", f"W{per}", f"{name} power", scale))
        for quantity in ("normal force", "forward force"):
            found.append(_curve(samples, side, "ground", quantity, f"N{per}", quantity, scale))
    return found


def _angles(run: Trajectory, side: str) -> dict[str, str]:
    """Angles of the joints of a side, and observed ones, each with what it is the angle of."""
    facts = run.facts
    known = [name for name, unit in facts.coordinates[: facts.coordinate_count] if unit == "rad"]
    known += [name for name, unit in facts.observations if unit == "rad"]
    return {name: base_name(name.removesuffix(".angle"), side) for name in known if of_side(name, side)}


def _sampled(run: Trajectory, side: Side, stride: Stride, angles: Sequence[str], moments: Moments) -> dict[str, Vector]:
    """What the curves of a side are made of, over one stride."""
    times = stride.begin + PERCENT / 100.0 * stride.duration
    times[-1] = stride.end - 1e-9 * stride.duration  # before the strike that ends it
    named = run.at(times)
    found = {name: np.asarray(named[name]) for name in angles}
    for name, moment in moments.at(run, times).items():
        if name in found:
            found[f"{name} moment"] = moment
            found[f"{name} power"] = moment * np.asarray(named[f"{name}.rate"])
    return found | forces_at(run, side, times)


def forces_at(run: Trajectory, side: Side, times: Vector) -> dict[str, Vector]:
    """Normal and forward force of the ground on a foot [N]."""
    named = run.at(times)
    normal, forward = np.zeros(len(times)), np.zeros(len(times))
    for name in side.contacts:
        normal = normal + np.nan_to_num(named[f"{name}.force"])
        if f"{name}.friction.forward" in run:
            forward = forward + np.nan_to_num(named[f"{name}.friction.forward"])
    return {"normal force": normal, "forward force": forward}


def _curve(
    samples: Sequence[dict[str, Vector]], side: Side, subject: str, quantity: str, unit: str, key: str, scale: float
) -> Curve:
    values: Matrix = scale * np.array([each[key] for each in samples])
    return Curve(side.name, subject, quantity, unit, np.mean(values, axis=0), np.std(values, axis=0))
