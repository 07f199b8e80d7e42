"""One double pendulum, two point masses on massless rods, in every kind of coordinates."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbd


@dataclass(frozen=True)
class Sizes:
    """Masses [kg], lengths [m], gravity [m/s²]."""

    m1: float = 1.0
    m2: float = 1.0
    L1: float = 1.0
    L2: float = 1.0
    g: float = 9.81

    @property
    def gravity(self) -> tuple[float, float, float]:
        return (0.0, -self.g, 0.0)


class DoublePendulum(ABC):
    """A double pendulum; angles from the downward vertical.

    `motion` gives θ₁, θ₂ (between −π and π), θ₁˙, θ₂˙ and `tensions` the pulls of the rods, of the last row of a run.
    """

    def __init__(self, **sizes: float) -> None:
        self.sizes = Sizes(**sizes)
        self.model = self.build()

    @abstractmethod
    def build(self) -> Any:
        """The model."""

    @abstractmethod
    def start(self, motion: Sequence[float]) -> mbd.State:
        """At θ₁, θ₂, θ₁˙, θ₂˙."""

    @abstractmethod
    def bobs(self, run: Any) -> tuple[Any, ...]:
        """Place and velocity of both bobs: x₁, y₁, x₂, y₂, u₁, w₁, u₂, w₂."""

    @abstractmethod
    def tensions(self, run: Any) -> tuple[Any, Any]:
        """Pull of the upper and of the lower rod."""

    def motion(self, run: Any) -> tuple[Any, ...]:
        """θ₁, θ₂, θ₁˙, θ₂˙."""
        x1, y1, x2, y2, u1, w1, u2, w2 = self.bobs(run)
        x2, y2, u2, w2 = x2 - x1, y2 - y1, u2 - u1, w2 - w1
        rates = ((x * w - y * u) / (x * x + y * y) for x, y, u, w in ((x1, y1, u1, w1), (x2, y2, u2, w2)))
        return np.arctan2(x1, -y1), np.arctan2(x2, -y2), *rates

    def cartesian(self, motion: Sequence[float]) -> tuple[float, ...]:
        """`bobs` at θ₁, θ₂, θ₁˙, θ₂˙."""
        a, b, w, u = motion
        L1, L2 = self.sizes.L1, self.sizes.L2
        first = np.array([L1 * np.sin(a), -L1 * np.cos(a)])
        second = first + np.array([L2 * np.sin(b), -L2 * np.cos(b)])
        fast = np.array([L1 * np.cos(a) * w, L1 * np.sin(a) * w])
        faster = fast + np.array([L2 * np.cos(b) * u, L2 * np.sin(b) * u])
        return (*first, *second, *fast, *faster)


class Minimal(DoublePendulum):
    """Two revolute joints."""

    cut: Any = "auto"

    def build(self) -> Any:
        s = self.sizes
        model = mbd.Model("double pendulum", gravity=s.gravity, cut=self.cut)
        upper = mbd.Link("upper", mass=s.m1, length=s.L1, center=s.L1)
        lower = mbd.Link("lower", mass=s.m2, length=s.L2, center=s.L2)
        model.connect(
            mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
        )
        return model

    def start(self, motion: Sequence[float]) -> mbd.State:
        a, b, w, u = motion
        return mbd.assemble(
            self.model,
            position={"shoulder.angle": a, "elbow.angle": b - a},
            velocity={"shoulder.angle": w, "elbow.angle": u - w},
        )

    def bobs(self, run: Any) -> tuple[Any, ...]:
        places = [run[f"{body}.end.{part}"] for body in ("upper", "lower") for part in "xy"]
        return (*places, *(run[f"{body}.end.v{part}"] for body in ("upper", "lower") for part in "xy"))

    def tensions(self, run: Any) -> tuple[Any, Any]:
        x1, y1, x2, y2, *_ = self.bobs(run)
        pulls = []
        for joint, x, y in ("shoulder", x1, y1), ("elbow", x2 - x1, y2 - y1):
            force = run[f"{joint}.reaction_force"]
            pulls.append(-(force[..., 0] * x + force[..., 1] * y) / np.hypot(x, y))
        return pulls[0], pulls[1]


class ElbowCut(Minimal):
    """The lower rod floats; two rows close the elbow."""

    cut = ("elbow",)

    def start(self, motion: Sequence[float]) -> mbd.State:
        a, b, w, u = motion
        return mbd.assemble(
            self.model,
            position={"shoulder.angle": a, "lower floating.angle": b},
            velocity={"shoulder.angle": w, "lower floating.angle.rate": u},
        )


class Cut(Minimal):
    """Absolute coordinates of both rods, four rows."""

    cut = "all"

    def start(self, motion: Sequence[float]) -> mbd.State:
        a, b, w, u = motion
        return mbd.assemble(
            self.model,
            position={"upper floating.angle": a, "lower floating.angle": b},
            velocity={"upper floating.angle.rate": w, "lower floating.angle.rate": u},
        )


class Natural(DoublePendulum):
    """Places of the bobs and two rods that hold distances."""

    def build(self) -> Any:
        s = self.sizes
        model = mbd.Model("double pendulum", gravity=s.gravity)
        upper, lower = mbd.PointMass("upper bob", mass=s.m1), mbd.PointMass("lower bob", mass=s.m2)
        model.connect(
            mbd.Translation("upper", model.ground.origin, upper.origin),
            mbd.Translation("lower", model.ground.origin, lower.origin),
        )
        model.constrain(
            mbd.Bilateral("upper rod", mbd.distance(model.ground.origin, upper.origin), value=s.L1),
            mbd.Bilateral("lower rod", mbd.distance(upper.origin, lower.origin), value=s.L2),
        )
        return model

    names = ("upper.x", "upper.y", "lower.x", "lower.y")

    def start(self, motion: Sequence[float]) -> mbd.State:
        values = self.cartesian(motion)
        return mbd.assemble(
            self.model,
            position=dict(zip(self.names, values[:4], strict=True)),
            velocity=dict(zip(self.names, values[4:], strict=True)),
        )

    def bobs(self, run: Any) -> tuple[Any, ...]:
        return (*(run[name] for name in self.names), *(run[f"{name}.rate"] for name in self.names))

    def tensions(self, run: Any) -> tuple[Any, Any]:
        return run["upper rod.tension"], run["lower rod.tension"]


class Lagrange(DoublePendulum):
    """Energies of the absolute angles."""

    def build(self) -> Any:
        import sympy

        s = self.sizes
        a, b = mbd.Coordinate("upper"), mbd.Coordinate("lower")
        m1, m2, L1, L2, g = sympy.symbols("m1 m2 L1 L2 g")
        mixed = L1 * L2 * a.v * b.v * sympy.cos(a.q - b.q)
        height = -(m1 + m2) * L1 * sympy.cos(a.q) - m2 * L2 * sympy.cos(b.q)
        return mbd.Lagrangian(
            "double pendulum",
            [a, b],
            kinetic=(m1 + m2) * L1**2 * a.v**2 / 2 + m2 * L2**2 * b.v**2 / 2 + m2 * mixed,
            potential=g * height,
            parameters={m1: s.m1, m2: s.m2, L1: s.L1, L2: s.L2, g: s.g},
        )

    def start(self, motion: Sequence[float]) -> mbd.State:
        a, b, w, u = motion
        return mbd.assemble(self.model, position={"upper": a, "lower": b}, velocity={"upper": w, "lower": u})

    def bobs(self, run: Any) -> tuple[Any, ...]:
        return self.cartesian([run[name] for name in ("upper", "lower", "upper.rate", "lower.rate")])

    def tensions(self, run: Any) -> tuple[Any, Any]:
        """Newton's law along the rods: the lower bob's, then both bobs'."""
        s = self.sizes
        a, b, w, u = (run[name] for name in ("upper", "lower", "upper.rate", "lower.rate"))
        along = run["upper.acceleration"] * np.sin(a - b) + w * w * np.cos(a - b)  # of the upper bob, in the lower rod
        lower = s.m2 * (s.L2 * u * u + s.L1 * along + s.g * np.cos(b))
        return s.m1 * (s.L1 * w * w + s.g * np.cos(a)) + lower * np.cos(b - a), lower


FORMS: dict[str, type[DoublePendulum]] = {
    "minimal": Minimal,
    "elbow cut": ElbowCut,
    "all joints cut": Cut,
    "natural": Natural,
    "Lagrange": Lagrange,
}
WITH_ROWS = ("elbow cut", "all joints cut", "natural")
