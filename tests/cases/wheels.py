"""The rimless wheel as a model of bodies, and by hand."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import mbd
from tests.problems import integrated


@dataclass(frozen=True)
class RimlessWheel:
    """Spokes of length L around a mass with the moment of inertia I m L², rolling down a slope.

    θ is the angle of the stance spoke from the slope's normal, positive downhill, ω = θ˙. From one impact to the next
    θ goes from −π/n to π/n, ``(1 + I) θ¨ = (g/L) sin(θ + slope)``; the impact keeps the moment of momentum about the
    new foot: ω⁺ = η ω⁻ with η = (cos 2π/n + I)/(1 + I) (McGeer 1990; Coleman 1998).
    """

    spokes: int = 8
    length: float = 1.0
    gravity: float = 9.81
    slope: float = 0.1
    inertia: float = 0.0
    mass: float = 1.0

    @property
    def half(self) -> float:
        """π/n."""
        return math.pi / self.spokes

    @property
    def eta(self) -> float:
        """ω⁺/ω⁻."""
        return (math.cos(2 * self.half) + self.inertia) / (1.0 + self.inertia)

    def model(self) -> mbd.Model:
        """A planar body with a foot at the end of each spoke; it rolls forward by a negative angle."""
        model = mbd.Model("rimless wheel", gravity=mbd.on_slope(self.slope, self.gravity))
        about_z = self.inertia * self.mass * self.length**2
        wheel = mbd.RigidBody("wheel", self.mass, inertia=(0.5 * about_z, 0.5 * about_z, about_z))
        model.connect(mbd.Planar("roll", model.ground.origin, wheel.origin))
        for k in range(self.spokes):
            turn = 2 * self.half * k
            tip = wheel.point(self.length * math.sin(turn), -self.length * math.cos(turn), name=f"tip {k}")
            model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(tip)))
        return model

    def start(self, model: mbd.Model, speed: float, angle: float | None = None) -> mbd.State:
        """On spoke 0 with ω = speed; by default just after the impact that brought it down."""
        theta = -self.half if angle is None else angle
        return mbd.assemble(model, closed=["spoke 0"], position={"roll.angle": -theta}, velocity={"roll.angle": -speed})

    def energy(self, theta: float) -> float:
        """½ ω² that the fall from the top of the stance has given at θ."""
        return self.gravity / self.length / (1.0 + self.inertia) * (1.0 - math.cos(theta + self.slope))

    def fall(self, theta: float, speed: float, until: float) -> NDArray[np.float64]:
        """θ, ω at a time, on one spoke, by DOP853."""
        rate = self.gravity / self.length / (1.0 + self.inertia)
        return integrated(lambda t, y: [y[1], rate * math.sin(y[0] + self.slope)], [theta, speed], until)

    def next_impact(self, speed: float) -> tuple[float, float]:
        """Time and ω⁻ of the next impact downhill, from just after one, by energy and a quadrature."""
        from scipy.integrate import quad

        begin = self.energy(-self.half)

        def slowness(theta: float) -> float:
            return 1.0 / math.sqrt(speed**2 + 2.0 * (self.energy(theta) - begin))

        time = quad(slowness, -self.half, self.half, epsabs=1e-13, epsrel=1e-12)[0]
        return time, math.sqrt(speed**2 + 2.0 * (self.energy(self.half) - begin))
