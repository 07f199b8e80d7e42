"""Benches on which parts of a leg are tried: a foot that falls, a leg that swings, in any system of units."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

import mbd


@dataclass(frozen=True)
class Units:
    """How many of some units a meter, a kilogram, a second are; volts and ohms follow for the same ampere."""

    m: float = 1.0
    kg: float = 1.0
    s: float = 1.0

    @property
    def N(self) -> float:
        return self.kg * self.m / self.s**2

    @property
    def Nm(self) -> float:
        return self.N * self.m

    @property
    def inertia(self) -> float:
        return self.kg * self.m**2

    @property
    def V(self) -> float:
        return self.Nm / self.s


SI = Units()
ODD = Units(m=2.0, kg=0.5, s=1.25)


def solid(name: str, mass: float, u: Units) -> mbd.Link:
    return mbd.Link(name, mass=mass * u.kg, length=0.4 * u.m, center=0.2 * u.m, inertia=0.03 * u.inertia)


def foot_bench(add: Callable[..., Any], u: Units) -> mbd.Model:
    """A body that falls on its foot."""
    model = mbd.Model("foot", gravity=(0.0, -9.81 * u.m / u.s**2, 0.0))
    body = mbd.RigidBody("body", 5.0 * u.kg, 0.2 * u.inertia)
    model.connect(mbd.Planar("float", model.ground.origin, body.origin))
    add(model, body, u)
    return model


def knee_bench(add: Callable[..., Any], u: Units) -> mbd.Model:
    """Thigh and shank that hang from a hip."""
    model = mbd.Model("leg", gravity=(0.0, -9.81 * u.m / u.s**2, 0.0))
    thigh, shank = solid("thigh", 7.0, u), solid("shank", 3.0, u)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start))
    add(model, thigh, shank, u)
    return model


def ankle_bench(add: Callable[..., Any], u: Units) -> mbd.Model:
    """Shank and foot that hang from a knee."""
    model = mbd.Model("leg", gravity=(0.0, -9.81 * u.m / u.s**2, 0.0))
    shank = solid("shank", 3.0, u)
    foot = mbd.RigidBody("foot", 1.0 * u.kg, 0.006 * u.inertia, center=(0.06 * u.m, -0.04 * u.m, 0.0))
    model.connect(mbd.Revolute("hip", model.ground.origin, shank.start))
    add(model, shank, foot, u)
    return model


BENCHES = {"foot": foot_bench, "knee": knee_bench, "ankle": ankle_bench}

STARTS: dict[str, dict[str, tuple[float, float, str]]] = {
    "foot": {
        "float.x.rate": (-1.0, 1.0, "m/s"), "float.y": (0.3, 0.4, "m"), "float.y.rate": (-1.0, 0.0, "m/s"),
        "float.angle": (-0.4, 0.4, ""), "float.angle.rate": (-3.0, 3.0, "1/s"),
    },
    "knee": {"hip.angle": (-1.0, 1.0, ""), "hip.angle.rate": (-5.0, 5.0, "1/s")},
    "ankle": {"hip.angle": (-1.0, 1.0, ""), "hip.angle.rate": (-5.0, 5.0, "1/s")},
}  # fmt: skip
"""Ranges of the bench's own coordinates and rates; a part adds those of its joint."""


@dataclass(frozen=True)
class Part:
    """How a part is tried: its bench, what adds it, ranges of its own coordinates; `unscaled`: its table is in SI."""

    bench: str
    add: Callable[..., Any]
    start: Mapping[str, tuple[float, float, str]]
    unscaled: bool = False

    def __hash__(self) -> int:
        return id(self)


@cache
def model_of(part: Part, u: Units = SI) -> mbd.Model:
    return BENCHES[part.bench](part.add, u)


def run_of(part: Part, draws: list[float], u: Units = SI, until: float = 0.4, dt: float = 1e-3) -> mbd.Trajectory:
    """A motion from a start within the ranges, at shares of them from 0 to 1."""
    ranges = {**STARTS[part.bench], **part.start}
    factor = {"m/s": u.m / u.s, "m": u.m, "": 1.0, "1/s": 1.0 / u.s}
    named = {
        name: (low + share * (high - low)) * factor[unit]
        for (name, (low, high, unit)), share in zip(ranges.items(), draws, strict=False)
    }
    position = {name: value for name, value in named.items() if not name.endswith(".rate")}
    velocity = {name.removesuffix(".rate"): value for name, value in named.items() if name.endswith(".rate")}
    model = model_of(part, u)
    start = mbd.assemble(model, position=position, velocity=velocity)
    return mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=dt * u.s, until=until * u.s)


def given_by_all_causes(run: mbd.Trajectory) -> np.ndarray:
    """Energy that all causes but the scheme have given since the start [J]."""
    return np.sum([part.energy for part in run.energy.parts], axis=0) if run.energy.parts else np.zeros(len(run.time))
