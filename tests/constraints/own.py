"""Laws of constraints as a user writes them in a script: a sole that slides, a clutch that slips, a one-way bearing."""

from dataclasses import dataclass

import mbd
from mbd.bodies.base import Frame
from mbd.constraints import Closing, Constraint, Drag, Equation, Law
from mbd.joints.base import Joint


@dataclass(frozen=True)
class Sole(Constraint):
    """Hunt & Crossley's pressure ``p = k δ^{3/2} (1 + c δ̇)`` with Stribeck's friction on level ground.

    ``μ(v) = μ + (μ_s − μ) exp(−(v/v_s)²)``, smoothed by tanh(v/v_c) about rest, where it creeps.
    """

    name: str
    point: Frame
    stiffness: float
    loss: float = 0.3
    friction: float = 0.5
    static: float = 0.7
    stribeck: float = 0.2
    creep: float = 0.02

    kind = "penalty"

    def mentions(self):
        return [self.point]

    def parameters(self):
        return {f"{self.name}.stiffness": self.stiffness, f"{self.name}.mu": self.friction}

    def act(self, scope, hold):
        motion = scope.frame(self.point)
        gap, speed = motion.position[1], motion.velocity[0]
        depth, rate = mbd.maximum(-gap, 0.0), scope.rate(gap)
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        mu = scope.parameter(self.name, "mu", self.friction)
        push = k * depth**1.5 * mbd.maximum(1.0 - self.loss * rate, 0.0)
        grip = mu + (self.static - mu) * mbd.exp(-(speed * speed) / self.stribeck**2)
        drag = Drag(speed, -grip * push * mbd.tanh(speed / self.creep))
        return Law(contact=Closing(gap, opens_on="gap"), push=push, drags=[drag], elastic=k * depth**2.5 / 2.5)


@dataclass(frozen=True)
class Clutch(Constraint):
    """``ω₁ − ω₂ = 0`` while the torque it carries stays below a limit, which it keeps while it slips."""

    name: str
    input: Joint
    output: Joint
    torque: float

    kind = "nonholonomic"

    def mentions(self):
        return [self.input, self.output]

    def parameters(self):
        return {f"{self.name}.torque": self.torque}

    def act(self, scope, hold):
        (one,), (other,) = (scope.joint(joint.name).rates for joint in (self.input, self.output))
        limit = scope.parameter(self.name, "torque", self.torque)
        return Law([Equation(one - other, unit="rad", level="velocity", limit=limit)])


@dataclass(frozen=True)
class OneWayBearing(Constraint):
    """A sprag clutch: as the rate falls through zero it grips, winds up like a spring, and lets go as this relaxes."""

    name: str
    joint: Joint
    stiffness: float
    damping: float = 0.0

    kind = "penalty"

    def mentions(self):
        return [self.joint]

    def parameters(self):
        return {f"{self.name}.stiffness": self.stiffness}

    def act(self, scope, hold):
        motion = scope.joint(self.joint.name)
        (angle,), (rate,) = motion.coordinates, motion.rates
        (grip,) = hold([angle])
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        push = k * (grip - angle) - self.damping * rate
        return Law(contact=Closing(rate, "rad"), push=push, elastic=0.5 * k * (grip - angle) ** 2)


@dataclass(frozen=True)
class Foot(Constraint):
    """A point that comes down on level ground with restitution e and Coulomb friction: `mbd.Unilateral` once more."""

    name: str
    point: Frame
    restitution: float
    friction: float

    kind = "unilateral"

    def mentions(self):
        return [self.point]

    def parameters(self):
        return {f"{self.name}.mu": self.friction}

    def act(self, scope, hold):
        x, y, _ = scope.frame(self.point).position
        (place,) = hold([x])
        mu = scope.parameter(self.name, "mu", self.friction)
        rows = [Equation(y, "normal"), Equation(x - place, "forward", limit=lambda push: mu * push)]
        return Law(rows, Closing(y, restitution=self.restitution))
