"""Curves over the stride, 0 to 100 %: joints and the reaction of the ground."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mbd.analysis.gait_report.strides import Side, base_name, of_side
from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.results.columns import ModelColumns
from mbd.results.interpolation import Side as When
from mbd.results.trajectory import Trajectory
from mbd.tape.node import Node

PERCENT = np.linspace(0.0, 100.0, 101)
"""Share of the stride [%]."""


KNEE = re.compile(r"\bknee\b(?!.*\b(?:rotation|abduction|adduction)\b)", re.IGNORECASE)
"""Subjects whose angle is flexion, which clinicians show as positive."""


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
    angles = {side.name: angles_of(run, side.name) for side in sides}
    joints = [angle.coordinate for own in angles.values() for angle in own if angle.coordinate]
    moments = _Moments(run, joints)
    per = "" if mass is None else "/kg"
    scale = 1.0 if mass is None else 1.0 / mass
    found = []
    for side in sides:
        samples = _sampled(run, side, angles[side.name], moments)
        for angle in angles[side.name]:
            name, subject = angle.name, angle.subject
            found.append(_curve(samples, side, subject, "angle", "°", f"{name}", np.rad2deg(1.0)))
            if angle.coordinate in moments.known:
                found.append(_curve(samples, side, subject, "moment", f"N m{per}", f"{name} moment", scale))
                found.append(_curve(samples, side, subject, "power", f"W{per}", f"{name} power", scale))
        for quantity in ("normal force", "forward force"):
            found.append(_curve(samples, side, "ground", quantity, f"N{per}", quantity, scale))
    return found


class _Angle(NamedTuple):
    """An angle of a side: its name, what it is the angle of, and the coordinate that it is or is the opposite of.

    shown : −1 where the report has the opposite of the named angle, so that flexion of a knee is positive
    """

    name: str
    subject: str
    coordinate: str = ""
    sign: float = 1.0
    shown: float = 1.0


def angles_of(run: Trajectory, side: str) -> list[_Angle]:
    """Angles of the joints of a side, and observed ones; of joints of the body those of ISB that move.

    An angle of ISB that is a coordinate, or its opposite, stands for it. The three of a raised arm are left out: their
    first and third are undetermined while it hangs.
    """
    facts = run.facts
    known = [name for name, unit in facts.coordinates[: facts.coordinate_count] if unit == "rad"]
    found = {name: _Angle(name, base_name(name.removesuffix(".angle"), side), name) for name in known}
    for name, angle in facts.angles.items():
        if angle.sequence != "zxy" or not of_side(name, side) or float(np.ptp(run[name])) < EQUAL_RTOL:
            continue
        joint, _, last = name.rpartition(".")
        subject = f"{base_name(joint, side)} {last.replace('_', ' ')}"
        own = [(each, sign) for each in known if each.rpartition(".")[0] == joint for sign in (1.0, -1.0)]
        match = next(((c, s) for c, s in own if np.max(np.abs(run[name] - s * run[c])) < EQUAL_RTOL), None)
        if match is not None:
            found.pop(match[0], None)
        found[name] = _Angle(name, subject, *(match or ()))
    observed = [name for name, unit in facts.observations if unit == "rad"]
    found |= {name: _Angle(name, base_name(name.removesuffix(".angle"), side)) for name in observed}
    return [_as_in_the_clinic(run, angle) for angle in found.values() if of_side(angle.name, side)]


def _as_in_the_clinic(run: Trajectory, angle: _Angle) -> _Angle:
    """A knee bends one way only: where the angle of one is farthest from straight below zero, its opposite is shown."""
    values = run[angle.name]
    bends = KNEE.search(angle.subject) is not None and -float(np.min(values)) > max(float(np.max(values)), EQUAL_RTOL)
    return angle._replace(shown=-1.0) if bends else angle


def _sampled(run: Trajectory, side: Side, angles: Sequence[_Angle], moments: _Moments) -> list[dict[str, Vector]]:
    """What the curves of a side are made of, over each of its strides."""
    # every stride ends just before the strike that ends it
    shares = np.append(PERCENT[:-1] / 100.0, 1.0 - 1e-9)
    times = np.concatenate([stride.begin + shares * stride.duration for stride in side.strides])
    named = run.at(times)
    found = {angle.name: angle.shown * np.asarray(named[angle.name]) for angle in angles}
    known = moments.at(run, times)
    for angle in angles:
        if angle.coordinate in known:
            found[f"{angle.name} moment"] = angle.shown * angle.sign * known[angle.coordinate]
            found[f"{angle.name} power"] = known[angle.coordinate] * np.asarray(named[f"{angle.coordinate}.rate"])
    found |= forces_at(run, side, times)
    columns = {name: np.split(values, len(side.strides)) for name, values in found.items()}
    return [{name: column[k] for name, column in columns.items()} for k in range(len(side.strides))]


def grips_of(run: Trajectory, side: Side) -> list[str]:
    """Names of the `Rolling` by which the feet of a side grip."""
    grips = [shape.name for shape in run.facts.shapes if (shape.kind, shape.form) == ("held", "grip")]
    return [name for name in grips if of_side(name, side.name)]


def forces_at(run: Trajectory, side: Side, times: Vector, at: When = "right") -> dict[str, Vector]:
    """Normal and forward force of the ground on a foot, whose grip may be a `Rolling` of its side [N].

    at : 'after' or 'before' what happens at the times
    """
    named = run.at(times, side=at)
    normal, forward = np.zeros(len(times)), np.zeros(len(times))
    for name in side.contacts:
        normal = normal + np.nan_to_num(named[f"{name}.force"])
        for along in ("friction.forward", "thrust"):  # of a foot, of a spring leg
            if f"{name}.{along}" in run:
                forward = forward + np.nan_to_num(named[f"{name}.{along}"])
    for grip in grips_of(run, side):
        forward = forward + np.nan_to_num(named[f"{grip}{'.forward' * (f'{grip}.forward.force' in run)}.force"])
    return {"normal force": normal, "forward force": forward}


def _curve(
    samples: Sequence[dict[str, Vector]], side: Side, subject: str, quantity: str, unit: str, key: str, scale: float
) -> Curve:
    values: Matrix = scale * np.array([each[key] for each in samples])
    return Curve(side.name, subject, quantity, unit, np.mean(values, axis=0), np.std(values, axis=0))


class _Moments:
    """``τ_k = −Σ f_k − Σ λ ∂h/∂q_k`` over losses, springs, motors, stops and locks: what muscles would do in a body.

    This is what inverse dynamics finds from motion and ground reaction. Impacts, whose moments are without bound, are
    not in it. Joints that close a loop have no coordinate, and so no moment here.

    Parameters
    ----------
    run : a trajectory with its model
    coordinates : names of the joints' coordinates, such as 'left knee.angle'
    """

    def __init__(self, run: Trajectory, coordinates: Sequence[str]) -> None:
        self._columns: ModelColumns | None = run.columns.between_rows
        self._nodes: dict[str, Node] = {}
        if self._columns is None:
            return
        known = [name for name in coordinates if self._columns.knows(f"{name}.net_moment")]
        self._nodes = {name: self._columns.node(f"{name}.net_moment") for name in known}

    @property
    def known(self) -> tuple[str, ...]:
        """The coordinates that have one."""
        return tuple(self._nodes)

    def at(self, run: Trajectory, times: Vector) -> Mapping[str, Vector]:
        """τ at some times, just after events [N m]."""
        if self._columns is None or not self._nodes:
            return {}
        columns = self._columns
        rows = columns.between(columns.grid.places(times, "right"))
        return dict(zip(self._nodes, columns.evaluate(list(self._nodes.values()), rows), strict=True))
