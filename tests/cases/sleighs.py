"""Mechanisms that are held by their velocities: a sleigh, a sleigh with a trailer, a rolling wheel."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mbd
from tests.problems import integrated


def blade_row(vx: Any, vy: Any, angle: Any) -> Any:
    """Velocity to the right of a blade, ``v_x sin θ − v_y cos θ``."""
    return vx * mbd.sin(angle) - vy * mbd.cos(angle)


@dataclass(frozen=True)
class Sleigh:
    """A body on a blade at P, its mass center a ahead, on a plane on which a weight m g_x pulls along x.

    With v the speed along the blade and ω = θ˙ (Neimark & Fufaev 1972; the weight by virtual work)
    ``v˙ = a ω² + g_x cos θ``, ``(I + m a²) ω˙ = −m a (v ω + g_x sin θ)``;
    the side force, to the left of the blade, is ``m (v ω + a ω˙ + g_x sin θ)``.
    """

    mass: float = 1.0
    inertia: float = 0.5
    ahead: float = 0.4
    pull: float = 0.0

    def model(self, by_hand: bool = False) -> mbd.Model:
        """Planar body with a `KnifeEdge`, or with the same row by hand, to the left."""
        model = mbd.Model("sleigh", gravity=(self.pull, 0.0, 0.0))
        body = mbd.RigidBody("sleigh", self.mass, (self.inertia, self.inertia, self.inertia), center=(self.ahead, 0, 0))
        model.connect(mbd.Planar("body", model.ground.origin, body.origin))
        names = ("body.x.rate", "body.y.rate", "body.angle")
        blade = mbd.Nonholonomic("blade", lambda *a: -blade_row(*a), arguments=names)
        model.constrain(blade if by_hand else mbd.KnifeEdge("blade", body.origin))
        return model

    def energies(self) -> mbd.Lagrangian:
        """The same by its energies, with the row to the left."""
        return mbd.Lagrangian(
            "sleigh",
            ["x", "y", "angle"],
            kinetic=lambda x_rate, y_rate, angle, angle_rate, m, J, a: (
                0.5 * m * (x_rate - a * mbd.sin(angle) * angle_rate) ** 2
                + 0.5 * m * (y_rate + a * mbd.cos(angle) * angle_rate) ** 2
                + 0.5 * J * angle_rate**2
            ),
            potential=lambda x, angle, m, a, g: -m * g * (x + a * mbd.cos(angle)),
            nonholonomic={"blade": lambda x_rate, y_rate, angle: -blade_row(x_rate, y_rate, angle)},
            parameters={"m": self.mass, "J": self.inertia, "a": self.ahead, "g": self.pull},
        )

    def start(self, model: Any, angle: float, speed: float, turning: float) -> mbd.State:
        """P at the ground's origin, the speed along the blade."""
        velocity = {"body.x": speed * np.cos(angle), "body.y": speed * np.sin(angle), "body.angle": turning}
        return mbd.assemble(model, position={"body.angle": angle}, velocity=velocity)

    def motion(self, angle: float, speed: float, turning: float, times: Any) -> NDArray[np.float64]:
        """x, y, θ, v, ω and the side force at each time, by DOP853."""
        m, a, g = self.mass, self.ahead, self.pull
        J = self.inertia + m * a * a

        def turned(y: Any) -> Any:
            return -m * a * (y[3] * y[4] + g * np.sin(y[2])) / J

        def slide(t: float, y: Any) -> list[float]:
            return [y[3] * np.cos(y[2]), y[3] * np.sin(y[2]), y[4], a * y[4] ** 2 + g * np.cos(y[2]), turned(y)]

        found = integrated(slide, [0.0, 0.0, angle, speed, turning], times)
        y = found.T
        return np.column_stack([found, m * (y[3] * y[4] + a * turned(y) + g * np.sin(y[2]))])


def tractor(cut: Any = "auto") -> mbd.Model:
    """A sleigh that pulls another at a hitch; a weight along x, a spring between them."""
    model = mbd.Model("tractor", gravity=(1.3, -0.4, 0.0), cut=cut)
    front = mbd.RigidBody("front", 1.2, (0.3, 0.3, 0.3), center=(0.3, 0.05))
    back = mbd.RigidBody("back", 0.7, (0.1, 0.1, 0.1), center=(-0.3, 0.0))
    hitch = mbd.Revolute("hitch", front.point(-0.4, 0.0, name="hook"), back.origin, stiffness=0.5)
    model.connect(mbd.Planar("body", model.ground.origin, front.origin), hitch)
    model.constrain(
        mbd.KnifeEdge("front blade", front.origin),
        mbd.KnifeEdge("back blade", back.point(-0.6, 0.0, name="heel").turned(0.2)),
    )
    return model


def rolling_wheel(mass: float, radius: float, inertia: float, slope: float, g: float, held: str = "row") -> mbd.Model:
    """A wheel on a slope, held on it by a row, by a contact that could open, or by its joint."""
    model = mbd.Model("wheel", gravity=mbd.on_slope(slope, g))
    wheel = mbd.RigidBody("wheel", mass, (0.5 * inertia, 0.5 * inertia, inertia))
    if held == "joint":
        hub = mbd.PointMass("hub", mass=0.0)
        model.connect(mbd.Prismatic("slide", model.ground.point(0.0, radius), hub.origin))
        model.connect(mbd.Revolute("axle", hub.origin, wheel.origin))
    else:
        model.connect(mbd.Planar("roll", model.ground.origin, wheel.origin))
        height = mbd.touchdown(wheel.origin, mbd.Plane(offset=radius))
        on = mbd.Bilateral("road", height) if held == "row" else mbd.Unilateral("road", height, friction=0)
        model.constrain(on)
    model.constrain(mbd.Rolling("tyre", wheel.origin, radius))
    return model
