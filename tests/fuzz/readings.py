"""What a run reports, as numbers by name: at its rows, or at other times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbd
from mbd.joints.base import Joint
from mbd.topology.plan import plan
from tests.fuzz.geometry import Array, Attitude, Signal

BEFORE = 1e-12
"""How much earlier than a jump its left side is read, over the time and a second [-]."""


@dataclass(frozen=True)
class Readings:
    """Reported quantities, (n,) each.

    time : instants (n,) [s]
    values : reported quantities by name
    closed : by contact, whether it is closed, (n,) booleans
    parameters : values of the parameters, one number or (n,) each
    tree : names of the joints of the tree and of their coordinates, from which bodies are placed; not those of cut
        joints, whose rates and accelerations agree with theirs to the order of the scheme only
    ends : (n,) whether a row is the first of two of one time, or False
    """

    time: Array
    values: Mapping[str, Array]
    closed: Mapping[str, Any]
    parameters: Mapping[str, Any]
    tree: frozenset[str]
    ends: Any = False

    @property
    def instants(self) -> Array:
        """Times at which functions of time have their values: before a jump, at the first of two rows of one time."""
        return np.asarray(self.time - np.where(self.ends, BEFORE * (1.0 + self.time), 0.0))

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, name: str) -> Array:
        return self.values[name]

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def vector(self, name: str) -> Array:
        """The components x, y, z of a reported vector, (n, 3)."""
        return np.stack([self.values[f"{name}.{axis}"] for axis in "xyz"], axis=1)

    def coordinate(self, name: str) -> Signal:
        """A coordinate with its rate and acceleration."""
        return Signal(self.values[name], self.values[f"{name}.rate"], self.values[f"{name}.acceleration"])

    def attitude(self, name: str) -> Attitude:
        """The orientation of a joint that turns freely."""
        quaternion = np.stack([self.values[f"{name}.orientation.{part}"] for part in "wxyz"], axis=1)
        angular, second = (
            np.stack([self.values[f"{name}.angular_velocity.{axis}{suffix}"] for axis in "xyz"], axis=1)
            for suffix in ("", ".acceleration")
        )
        return Attitude(quaternion, angular, second)

    def part(self, chosen: Any) -> Readings:
        """Some of the instants."""
        parameters = {name: value[chosen] if np.ndim(value) else value for name, value in self.parameters.items()}
        return Readings(
            self.time[chosen],
            {name: value[chosen] for name, value in self.values.items()},
            {name: value[chosen] for name, value in self.closed.items()},
            parameters,
            self.tree,
            self.ends[chosen] if np.ndim(self.ends) else self.ends,
        )


def names_for(run: mbd.Trajectory, model: mbd.Model) -> list[str]:
    """The reported quantities that a judge needs, of those that the run has."""
    labels = [name for joint in model.joints for name in joint.coordinate_names]
    labels += [f"{body} floating.{label}" for body in model.bodies for label in ("x", "y", "z", "angle")]
    wanted = [name + suffix for name in labels for suffix in ("", ".rate", ".acceleration")]
    owners = [*(joint.name for joint in model.joints), *(f"{body} floating" for body in model.bodies)]
    wanted += [f"{owner}.orientation.{part}" for owner in owners for part in "wxyz"]
    spins = [f"{owner}.angular_velocity.{axis}" for owner in owners for axis in "xyz"]
    wanted += [name + suffix for name in spins for suffix in ("", ".acceleration", ".friction")]
    vectors = [f"{joint.name}.reaction_{kind}" for joint in model.joints for kind in ("force", "torque")]
    wanted += [f"{vector}.{axis}" for vector in vectors for axis in "xyz"]
    wanted += [f"{frame}.{axis}" for frame in model.frames for axis in ("x", "y", "z", "vx", "vy", "vz")]
    reported = (
        "force",
        "forward.force",
        "sideways.force",
        "gap",
        "gap_rate",
        "friction",
        "friction.forward",
        "friction.sideways",
        "multiplier",
    )
    wanted += [f"{word.name}.{suffix}" for word in model.constraints for suffix in reported]
    wanted += [f"{name}.friction" for name in (*labels, *(joint.name for joint in model.joints))]
    wanted += ["kinetic_energy", "potential_energy"]
    known = set(run.names)
    return [name for name in dict.fromkeys(wanted) if name in known]


def readings(run: mbd.Trajectory, model: mbd.Model, given: Mapping[str, float], times: Array | None = None) -> Readings:
    """What a run reports at its rows, or between them at other times.

    Parameters
    ----------
    given : parameters that differ from the model's
    """
    record, names = run.record, names_for(run, model)
    parameters = {**model.parameters, **given}
    chosen = plan(model)
    tree = frozenset([*chosen.coordinate_names, *(joint.name for joint in chosen.edges)])
    if times is None:
        found = dict(zip(names, run.columns.at_rows(names), strict=True))
        time, source = record.time, np.arange(len(record.time))
    else:
        found = run.at(times).read(*names)
        time, source = times, np.searchsorted(record.time, times, side="right") - 1
    values = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in found.items()}
    contacts = [contact.name for contact in model.contacts]
    closed = {name: record.closed[source, k].astype(bool) for k, name in enumerate(contacts)}
    changed = _changed(run, parameters, source)
    ends = np.append(np.diff(time) == 0.0, False) if times is None and len(time) else False
    return Readings(time, values, closed, changed, tree, ends)


def _changed(run: mbd.Trajectory, parameters: Mapping[str, float], source: Any) -> dict[str, Any]:
    """The parameters with what controllers have written on the way."""
    found: dict[str, Any] = dict(parameters)
    names = list(run.record.parameter_names)
    for row, values in run.record.parameter_changes:
        for name, value in zip(names, values, strict=False):
            known = found.get(name, value)
            if np.any(known != value):
                found[name] = np.where(source >= row, value, known)
    return found


def coordinates(joint: Joint, told: Readings) -> list[Signal] | None:
    """The coordinates of a joint that add, None where the run does not report them."""
    if any(name not in told for name in joint.coordinate_names):
        return None
    return [told.coordinate(name) for name in joint.coordinate_names if ".orientation." not in name]


def known(names: Iterable[str], told: Readings) -> bool:
    """Whether all of these are reported."""
    return all(name in told for name in names)
