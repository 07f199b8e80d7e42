"""Friction of a soft contact that sticks elastically: bristles of a fixed stiffness which slide at μ p."""

from collections.abc import Sequence

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.constraints.law import Drag
from mbd.dataclass import dataclass
from mbd.equal import MIN_DIVISOR
from mbd.errors import ModelError
from mbd.joints.losses.base import StateRates
from mbd.tape.functions import maximum, minimum, sqrt, where
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Bristles:
    """Friction of a `Penalty` contact that sticks: a spring σ₀ beside a damper σ₁, in series with dry friction.

    With the slip velocity γ, the deflection z of the surface and the normal force p::

        f = s min(1, μ p/‖s‖),   s = σ₀ z + σ₁ γ,   σ₁ ż = f − σ₀ z

    and −f acts on the foot. While ``‖s‖ ≤ μ p`` it sticks: ż = γ, a damped spring that does not creep. Beyond it slides
    with ‖f‖ = μ p. It takes energy along every motion and whatever p does: ``f·γ = d/dt ½ σ₀ ‖z‖² + σ₁ ‖ż‖² +
    f·(γ − ż)``, where the slip γ − ż has the direction of f. Open, z returns with the time σ₁/σ₀. M. Azad &
    R. Featherstone, Modeling the contact between a rolling sphere and a compliant ground plane, ACRA 2010.

    Parameters
    ----------
    mu : μ > 0 [-]
    stiffness : σ₀ > 0 [N/m]
    damping : σ₁ > 0 [N s/m], such as ``2 √(σ₀ m)``, with which a foot of mass m comes to rest without overshoot

    The states are 'name.bristle' [m], in space 'name.bristle.forward' and 'name.bristle.sideways'; μ, σ₀ and σ₁ are the
    parameters 'name.mu', 'name.bristle_stiffness' and 'name.bristle_damping' of the contact.
    """

    mu: float
    stiffness: float
    damping: float

    def __post_init__(self) -> None:
        for field in ("mu", "stiffness", "damping"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of Bristles"))
        faults = [fault for field, domain in self.domains().items()
                  for fault in domain.faults("Bristles", field, self.fields()[field])]  # fmt: skip
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`mu`, `bristle_stiffness`, `bristle_damping`."""
        return {"mu": self.mu, "bristle_stiffness": self.stiffness, "bristle_damping": self.damping}

    def domains(self) -> dict[str, Domain]:
        """All > 0."""
        return {
            "mu": positive("is not positive; give a Penalty friction=0 for none"),
            "bristle_stiffness": positive("does not hold; give a positive one, or a Penalty friction=μ, which creeps"),
            "bristle_damping": positive("would let it swing without end; give a positive one, such as 2 √(σ₀ m)"),
        }

    def act(
        self, slips: Sequence[tuple[str, Scalar]], push: Scalar, scope: Scope, owner: str
    ) -> tuple[list[Drag], StateRates, Sequence[Scalar]]:
        """Its forces along the slips, and the rates of its states while the contact is closed and while it is open."""
        mu, stiffness, damping = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        single = len(slips) == 1
        z: list[Node] = [scope.state(owner, "bristle" if single else f"bristle.{part}", 0.0) for part, _ in slips]
        pulls = [stiffness * own + damping * speed for own, (_, speed) in zip(z, slips, strict=True)]
        limit = mu * maximum(push, 0.0)
        if single:
            forces = [maximum(minimum(pulls[0], limit), -limit)]
        else:
            square = pulls[0] * pulls[0] + pulls[1] * pulls[1]
            share = where(square <= limit * limit, 1.0, limit / sqrt(square + MIN_DIVISOR))
            forces = [share * pull for pull in pulls]
        drags = [
            Drag(speed, -force) if single else Drag(speed, -force, f"friction.{part}", True)
            for force, (part, speed) in zip(forces, slips, strict=True)
        ]
        rates = [(own, (force - stiffness * own) / damping) for own, force in zip(z, forces, strict=True)]
        return drags, rates, [-stiffness / damping * own for own in z]
