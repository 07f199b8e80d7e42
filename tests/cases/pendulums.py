"""One pendulum, a point mass on a massless rod, in every kind of coordinates."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

import mbd

__all__ = ["FORMS", "WITH_EVENTS", "WITH_ROWS", "Pendulum"]


class Pendulum(ABC):
    """A pendulum of some length, mass and gravity; angles from the downward vertical.

    `angle`, `rate` and `tension` read a run, or a moment of one. `across` is the name of the bob's x.
    """

    across = "bob place.x"

    def __init__(self, length: float = 1.0, mass: float = 1.0, gravity: float = 9.81) -> None:
        self.length, self.mass, self.gravity = length, mass, gravity
        self.model = self.build()

    @abstractmethod
    def build(self) -> Any:
        """The model."""

    @abstractmethod
    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        """At an angle with an angular speed."""

    def place(self, values: Any) -> tuple[Any, Any]:
        """x, y of the bob."""
        return values["bob place.x"], values["bob place.y"]

    def velocity(self, values: Any) -> tuple[Any, Any]:
        """Its velocity."""
        return values["bob place.x.rate"], values["bob place.y.rate"]

    def angle(self, values: Any) -> Any:
        """θ between −π and π."""
        x, y = self.place(values)
        return np.arctan2(x, -y)

    def rate(self, values: Any) -> Any:
        """θ˙."""
        (x, y), (u, w) = self.place(values), self.velocity(values)
        return (x * w - y * u) / (x * x + y * y)

    @abstractmethod
    def tension(self, values: Any) -> Any:
        """Pull of the rod."""

    def _cartesian(self, angle: float, rate: float) -> tuple[float, float, float, float]:
        L, s, c = self.length, np.sin(angle), np.cos(angle)
        return L * s, -L * c, L * c * rate, L * s * rate


class Minimal(Pendulum):
    """One revolute joint, one coordinate; the rod's pull is the reaction in the pivot."""

    cut: Any = "auto"
    across = "rod.end.x"

    def build(self) -> Any:
        model = mbd.Model("pendulum", gravity=(0.0, -self.gravity, 0.0), cut=self.cut)
        rod = mbd.Link("rod", mass=self.mass, length=self.length, center=self.length)
        model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
        return model

    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        return mbd.assemble(self.model, position={"pivot.angle": angle}, velocity={"pivot.angle": rate})

    def place(self, values: Any) -> tuple[Any, Any]:
        return values["rod.end.x"], values["rod.end.y"]

    def velocity(self, values: Any) -> tuple[Any, Any]:
        return values["rod.end.vx"], values["rod.end.vy"]

    def tension(self, values: Any) -> Any:
        force = values["pivot.reaction_force"]
        x, y = self.place(values)
        return -(force[..., 0] * x + force[..., 1] * y) / self.length


class Cut(Minimal):
    """Absolute coordinates: the pivot is cut into two rows."""

    cut = "all"

    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        return mbd.assemble(
            self.model, position={"rod floating.angle": angle}, velocity={"rod floating.angle.rate": rate}
        )


class Natural(Pendulum):
    """The bob's place and a rod that holds its distance."""

    def build(self) -> Any:
        model = mbd.Model("pendulum", gravity=(0.0, -self.gravity, 0.0))
        bob = mbd.PointMass("bob", mass=self.mass)
        model.connect(mbd.Translation("bob place", model.ground.origin, bob.origin))
        model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, bob.origin), value=self.length))
        return model

    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        x, y, u, w = self._cartesian(angle, rate)
        return mbd.assemble(
            self.model,
            position={"bob place.x": x, "bob place.y": y},
            velocity={"bob place.x": u, "bob place.y": w},
        )

    def tension(self, values: Any) -> Any:
        return values["rod.tension"]


class LagrangeMinimal(Pendulum):
    """Energies of the angle."""

    def build(self) -> Any:
        import sympy

        theta = mbd.Coordinate("theta")
        m, L, g = sympy.symbols("m L g")
        return mbd.Lagrangian(
            "pendulum",
            [theta],
            kinetic=m * L**2 * theta.v**2 / 2,
            potential=-m * g * L * sympy.cos(theta.q),
            parameters={m: self.mass, L: self.length, g: self.gravity},
        )

    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        return mbd.assemble(self.model, position={"theta": angle}, velocity={"theta": rate})

    def angle(self, values: Any) -> Any:
        return np.arctan2(np.sin(values["theta"]), np.cos(values["theta"]))

    def rate(self, values: Any) -> Any:
        return values["theta.rate"]

    def tension(self, values: Any) -> Any:
        return self.mass * (self.length * values["theta.rate"] ** 2 + self.gravity * np.cos(values["theta"]))


class LagrangeNatural(Pendulum):
    """Energies of the bob's place, and ``½ (x² + y² − L²) = 0``, given as Python functions."""

    def build(self) -> Any:
        return mbd.Lagrangian(
            "pendulum",
            [mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m")],
            kinetic=lambda m, x_rate, y_rate: 0.5 * m * (x_rate**2 + y_rate**2),
            potential=lambda m, g, y: m * g * y,
            constraints={"rod": lambda x, y, L: 0.5 * (x * x + y * y - L * L)},
            parameters={"m": self.mass, "L": self.length, "g": self.gravity},
        )

    def start(self, angle: float, rate: float = 0.0) -> mbd.State:
        x, y, u, w = self._cartesian(angle, rate)
        return mbd.assemble(self.model, position={"x": x, "y": y}, velocity={"x": u, "y": w})

    def place(self, values: Any) -> tuple[Any, Any]:
        return values["x"], values["y"]

    def velocity(self, values: Any) -> tuple[Any, Any]:
        return values["x.rate"], values["y.rate"]

    def tension(self, values: Any) -> Any:
        return values["rod.multiplier"] * self.length


FORMS: dict[str, type[Pendulum]] = {
    "minimal": Minimal,
    "all joints cut": Cut,
    "natural": Natural,
    "Lagrange, minimal": LagrangeMinimal,
    "Lagrange, natural": LagrangeNatural,
}
WITH_ROWS = ("all joints cut", "natural", "Lagrange, natural")
WITH_EVENTS = ("minimal", "all joints cut", "natural")
"""Those made of bodies, to which events can be added."""
