"""The promise every loss makes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any, TypeAlias

from mbd.bodies.algebra import derivatives_at
from mbd.bodies.domains import Domain, at_least_zero
from mbd.bodies.promises import called, scalar, title_of
from mbd.bodies.scope import Scope
from mbd.bodies.values import is_number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.tape.node import Node, Scalar

DISSIPATES = at_least_zero("is negative, so it would feed energy in; give a value ≥ 0")
"""The domain of a coefficient of friction or damping."""


StateRates: TypeAlias = "Sequence[tuple[Node, Scalar]]"
"""(z, ż) of first-order states."""


class Loss(ABC):
    """Friction or damping of one rate v, a force F(v) with ``F(v) v ≥ 0`` that opposes the motion.

    F is positive on the left-hand side of ``M a + f + Bᵀλ = 0``: the mechanism feels −F. Losses add with ``+``.
    A new loss is a frozen dataclass that gives `force`, or a `DissipationFunction` that gives D(v).

    A loss with memory has first-order states z, asked for by ``scope.state(owner, field, initial)``: `force` may
    depend on them, `rates` gives ż, and `elastic` the energy U(z) that they store, with ``F v ≥ U̇``.
    """

    @abstractmethod
    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """F(v) [N or N m] at a rate v [m/s or rad/s]; parameters are named 'owner.field'."""

    @abstractmethod
    def fields(self) -> dict[str, float]:
        """Its physical quantities by field; each is a run-time parameter 'owner.field'."""

    @property
    def kind(self) -> str:
        """What names its parameters in a sum of losses."""
        return type(self).__name__.lower()

    @property
    def needs_reaction(self) -> bool:
        """Whether its friction follows the force in the joint, which is cut then, so that rows carry that force."""
        return False

    def dry(self, load: Scalar, scope: Scope, owner: str) -> Scalar:
        """Largest friction that truly sticks, ``|F| ≤ dry`` at rest and ``F = dry · sign v`` in motion, beside `force`.

        Parameters
        ----------
        load : resultant force in the joint [N], where it `needs_reaction`
        """
        return 0.0

    def sliding(self, load: Scalar, speed: Scalar, scope: Scope, owner: str) -> Scalar:
        """What `dry` becomes at a speed ≥ 0 [m/s or rad/s] of sliding; it tends to `dry` as that falls to zero."""
        return self.dry(load, scope, owner)

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """(z, ż) of its first-order states at a rate v [m/s or rad/s]; none for a loss without memory."""
        return ()

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """Energy U(z) that its states store and that it can give back [J]."""
        return 0.0

    @property
    def has_states(self) -> bool:
        """Whether it has first-order states."""
        return type(self).rates is not Loss.rates

    @property
    def smooth(self) -> Loss | None:
        """What is left of it without friction that truly sticks; None where that is all of it."""
        return self if type(self).dry is Loss.dry else None

    @property
    def sticks(self) -> bool:
        """Whether a part of it truly sticks."""
        return self.smooth is not self

    @property
    def is_directed(self) -> bool:
        """Whether ``F(−v) = −F(v)`` does not hold, so that it needs a direction that is positive."""
        return False

    def domains(self) -> dict[str, Domain]:
        """Domains of its fields: all of them ≥ 0, unless a loss says otherwise."""
        return dict.fromkeys(self.fields(), DISSIPATES)

    def value_faults(self, owner: str, values: Mapping[str, float]) -> list[str]:
        """Why it would not dissipate at some values of its parameters, given by full name, one sentence each."""
        named = ((field, domain, f"{owner}.{field}") for field, domain in self.domains().items())
        return [
            fault
            for field, domain, name in named
            if name in values
            for fault in domain.faults(f"'{owner}'", field, values[name])
        ]

    def faults(self, owner: str) -> list[str]:
        """Why it would not dissipate, one sentence each."""
        return self.value_faults(owner, self.parameters(owner))

    def parameters(self, owner: str) -> dict[str, float]:
        """Run-time parameters by full name: {'left knee loss.coefficient': 0.1}."""
        return {f"{owner}.{field}": value for field, value in self.fields().items()}

    def __add__(self, other: Loss) -> Loss:
        if not isinstance(other, Loss):
            return NotImplemented
        return LossSum((*_parts(self), *_parts(other)))


class DissipationFunction(Loss):
    """A loss given by Rayleigh's function D(v): ``F = ∂D/∂v``, dissipated power ``F v``."""

    @abstractmethod
    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """D(v) [W], smallest at v = 0."""

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """``F = ∂D/∂v``."""
        call = f"dissipation(rate, scope, {owner!r})"
        _, (slope,) = derivatives_at(lambda v: scalar(self, "dissipation", call, v, scope, owner), [rate], scope.tape)
        return slope


@dataclass(frozen=True)
class LossSum(Loss):
    """Several losses on one rate, ``F = Σ F_i``.

    Their parameters are told apart by kind: 'knee loss.viscous.coefficient'.
    """

    losses: tuple[Loss, ...]
    names: tuple[str, ...] = field(default=(), repr=False)

    def named(self, owner: str) -> list[tuple[str, Loss]]:
        """Each part with the owner of its parameters; what is left of a sum has the names that it had there."""
        names = self.names
        if not names:
            kinds = [loss.kind for loss in self.losses]
            counts = [kinds[: k + 1].count(kind) for k, kind in enumerate(kinds)]
            names = tuple(kind if count == 1 else f"{kind} {count}" for kind, count in zip(kinds, counts, strict=True))
        return [(f"{owner}.{name}", loss) for name, loss in zip(names, self.losses, strict=True)]

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """The sum of the forces."""
        return self._sum(owner, lambda name, loss: loss.force(rate, scope, name))

    @property
    def needs_reaction(self) -> bool:
        """Whether one of its parts does."""
        return any(loss.needs_reaction for loss in self.losses)

    def dry(self, load: Scalar, scope: Scope, owner: str) -> Scalar:
        """The sum of what sticks."""
        return self._sum(owner, lambda name, loss: loss.dry(load, scope, name))

    def sliding(self, load: Scalar, speed: Scalar, scope: Scope, owner: str) -> Scalar:
        """The same at a speed."""
        return self._sum(owner, lambda name, loss: loss.sliding(load, speed, scope, name))

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """The states of its parts."""
        return [pair for name, loss in self.named(owner) for pair in loss.rates(rate, scope, name)]

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """What its parts store."""
        return self._sum(owner, lambda name, loss: loss.elastic(scope, name))

    @property
    def has_states(self) -> bool:
        """Whether one of its parts does."""
        return any(loss.has_states for loss in self.losses)

    def _sum(self, owner: str, part: Callable[[str, Loss], Scalar]) -> Scalar:
        result: Scalar = 0.0
        for name, loss in self.named(owner):
            result = result + part(name, loss)
        return result

    @property
    def smooth(self) -> Loss | None:
        """Those of its parts that are smooth, with the names of their parameters."""
        parts = [(name, part) for name, loss in self.named("") if (part := loss.smooth) is not None]
        left = LossSum(tuple(part for _, part in parts))
        if [name for name, _ in left.named("")] != [name for name, _ in parts]:
            left = LossSum(left.losses, tuple(name[1:] for name, _ in parts))
        return left if parts else None

    @property
    def is_directed(self) -> bool:
        """Whether one of its parts is."""
        return any(loss.is_directed for loss in self.losses)

    @property
    def sticks(self) -> bool:
        """Whether one of its parts does."""
        return any(loss.sticks for loss in self.losses)

    def fields(self) -> dict[str, float]:
        """The fields of its parts: 'viscous.coefficient', …"""
        return {f"{name}.{field}"[1:]: value for name, loss in self.named("") for field, value in loss.fields().items()}

    def value_faults(self, owner: str, values: Mapping[str, float]) -> list[str]:
        """What is wrong with the values of its parts."""
        return [fault for name, loss in self.named(owner) for fault in loss.value_faults(name, values)]

    def faults(self, owner: str) -> list[str]:
        """The faults of its parts."""
        return [fault for name, loss in self.named(owner) for fault in loss.faults(name)]


def _parts(loss: Loss) -> tuple[Loss, ...]:
    return loss.losses if isinstance(loss, LossSum) else (loss,)


def rates_of(loss: Loss, rate: Scalar, scope: Scope, owner: str) -> StateRates:
    """What ``loss.rates`` returns, or a `ModelError` of what that should be."""
    call = f"rates(rate, scope, {owner!r})"
    given: StateRates = called(loss, "rates", call, rate, scope, owner)
    several = isinstance(given, Sequence) and not isinstance(given, str)
    if not several or not all(isinstance(pair, Sequence) and len(pair) == 2 for pair in given):
        raise ModelError(f"{title_of(loss)}: {call} must return pairs (state, its rate), got {given!r}")
    return given


def without_states(loss: Loss, what: str, instead: str) -> Loss:
    """The same loss, where its states have no place an error that says what to give `instead`.

    Raises
    ------
    ModelError
        for a loss with first-order states.
    """
    if loss.has_states:
        raise ModelError(f"{what}: {loss!r} has a state of its own, which one velocity bends; {instead}")
    return loss


def loss_of(value: Any, owner: str) -> Loss | None:
    """A loss as given to a joint, checked at the border."""
    if value is None or isinstance(value, Loss):
        return value
    hint = ""
    if is_number(value):
        hint = f"; viscous damping is mbd.Viscous({value:g})"
    elif isinstance(value, type) and issubclass(value, Loss):
        hint = f"; give the class its numbers: mbd.{value.__name__}(…)"
    elif isinstance(value, list | tuple) and value and all(isinstance(each, Loss) for each in value):
        hint = "; losses that act together are a sum, one + other"
    raise ModelError(f"loss of '{owner}' must be a loss such as mbd.Viscous(0.1), got {value!r}{hint}")
