"""The promise every joint makes: one definition, two uses (tree edge and cut edge)."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mbd.bodies.base import Frame, frames_in_words
from mbd.bodies.domains import Domain, Parameterized
from mbd.bodies.promises import scalar
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import among, name_of, number
from mbd.errors import ModelError, nearest
from mbd.joints.anatomy import ANATOMY
from mbd.joints.losses.base import Loss, loss_of
from mbd.tape.node import Scalar

JointLoss = Loss | Mapping[str, Loss] | None
"""A loss on every coordinate of a joint, or by label of its coordinates."""

NEGATIVE_STIFFNESS = "is negative; give a value ≥ 0, or an mbd.TorsionSpring where it shall drive away from its rest"
"""What is wrong with the stiffness of a joint."""

AWAITED_ATTRIBUTE = "_awaited"
"""Where a joint remembers the names of forces of which at least one is to come with it."""


class Label(NamedTuple):
    """A coordinate of a joint: its name ('angle') and unit ('rad', 'm', '' for a part of a quaternion).

    A velocity of a joint: its name ('angle.rate', 'spin x') and unit ('rad/s' or 'm/s').
    """

    name: str
    unit: str


def row_unit(label: str) -> str:
    """The unit of a row of `Joint.rows`: 'rad' for 'turn …', which hold directions, 'm' for places."""
    return "rad" if label.startswith("turn") else "m"


class Joint(Parameterized, ABC):
    """A joint between a frame of the parent body and a frame of the child body.

    The relative motion is ``child = parent · (R(q), p(q))``. As a tree edge the joint generates its
    coordinates through `transform` and `subspace`; as a cut edge it gives `rows`, and `recover`
    reads the coordinates off the two frames. Both uses describe the same mechanics.

    A joint whose coordinates form no vector (n_q ≥ n_v, such as a unit quaternion) declares `velocity_labels` and
    `defaults`, says so by `is_vector`, and gives its chart: `compose`, `difference`, `normalise`, `coordinate_rates`,
    `increment_rates` and `increment_velocities`, written with functions of scalars that also take arrays (see
    `mbd.configuration`). For all others these have defaults.

    A new joint is a frozen dataclass with the fields below; `stiffness` and `rest` are fields only of joints with one
    coordinate, whose linear spring has the energy ``½ k (q − rest)²``, and `stiffness` of those that are elastic in a
    way of their own (`is_elastic`), `anatomy` of those that may stand for a joint of the body (see
    `mbd.joints.anatomy`). It calls `validate` when it is made.
    """

    parent: Frame
    child: Frame
    loss: JointLoss
    stiffness: float = 0.0
    rest: float = 0.0
    anatomy: str = ""

    @property
    @abstractmethod
    def labels(self) -> tuple[Label, ...]:
        """The coordinates, in order."""

    @abstractmethod
    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """R, p of the child frame in the parent frame."""

    @abstractmethod
    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """For each velocity, (angular, linear) velocity of the child frame per unit of it, in child axes."""

    @abstractmethod
    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """(label, residual) of every constraint that the joint puts on the relative placement R, p of its frames.

        Labels 'x', 'y', 'z', 'across …', 'along' are places [m], 'turn …' directions [rad] (see `row_unit`).
        """

    @abstractmethod
    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The coordinates of a placement that satisfies `rows`; angles between −π and π."""

    @property
    @abstractmethod
    def is_planar(self) -> bool:
        """Whether it turns about z only and shifts in x–y only."""

    @property
    def is_reversed(self) -> bool:
        """Whether it is seen from its child (see `mbd.joints.reversed.Reversed`)."""
        return False

    @property
    def orientation(self) -> int | None:
        """Number of the coordinate w of its unit quaternion, turned by its last three velocities; None: no such."""
        return None

    @property
    def is_elastic(self) -> bool:
        """Whether it may have a spring of its own, with the field `stiffness`."""
        return len(self.labels) == 1

    # the chart of its coordinates ---------------------------------------------------------------------------------
    @property
    def is_vector(self) -> bool:
        """Whether ⊕ is + and the velocities are the rates of the coordinates."""
        return True

    @property
    def adding(self) -> int:
        """How many of its first coordinates add, each with a velocity of its own; all of them where `is_vector`."""
        return len(self.labels) if self.is_vector else 0

    @property
    def velocity_labels(self) -> tuple[Label, ...]:
        """The velocities, in order; the rates of the coordinates for every joint whose coordinates form a vector."""
        return tuple(Label(f"{label.name}.rate", f"{label.unit}/s") for label in self.labels)

    @property
    def freedoms(self) -> tuple[Label, ...]:
        """The degrees of freedom: each velocity's label without '.rate' and '/s', ('angle', 'rad')."""
        found = ((label.name.removesuffix(".rate"), label.unit.removesuffix("/s")) for label in self.velocity_labels)
        return tuple(Label(name, unit) for name, unit in found)

    @property
    def defaults(self) -> tuple[float, ...]:
        """The coordinates at which it is unless told otherwise, (1, 0, 0, 0) of a quaternion."""
        return (0.0,) * len(self.labels)

    def compose(self, q: Sequence[Scalar], x: Sequence[Scalar]) -> Sequence[Scalar]:
        """q ⊕ x (n_q), the coordinates after a local increment x (n_v)."""
        return [a + b for a, b in zip(q, x, strict=True)]

    def difference(self, q: Sequence[Scalar], other: Sequence[Scalar]) -> Sequence[Scalar]:
        """other ⊖ q (n_v), the increment x with q ⊕ x = other."""
        return [b - a for a, b in zip(q, other, strict=True)]

    def normalise(self, q: Sequence[Scalar]) -> Sequence[Scalar]:
        """The nearest coordinates (n_q) that the joint can have: a quaternion of length 1."""
        return list(q)

    def coordinate_rates(self, q: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """q̇ = N(q) v (n_q), which is ∂(q ⊕ x)/∂x · v at x = 0."""
        return list(v)

    def increment_rates(self, x: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """ẋ = D(x)⁻¹ v (n_v) of the motion q ⊕ x(t) with velocities v; D(0) = 1."""
        return list(v)

    def increment_velocities(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Sequence[Scalar]:
        """v = D(x) ẋ (n_v), the inverse of `increment_rates`."""
        return list(rates)

    # effects of the joint itself ---------------------------------------------------------------------------------
    def losses(self) -> list[tuple[int, str, Loss]]:
        """(place of the velocity, owner of the parameters, loss): (0, 'left knee loss', Viscous(0.1))."""
        if isinstance(self.loss, Mapping):
            places = {label.name: place for place, label in enumerate(self.freedoms)}
            return [(places[label], f"{self.name} loss.{label}", loss) for label, loss in self.loss.items()]
        if self.loss is None:
            return []
        return [(place, f"{self.name} loss", self.loss) for place in range(len(self.freedoms))]

    def frictions(self) -> dict[str, Any]:
        """Its loss without each friction that truly sticks: {'left knee friction': Viscous(0.1)}."""
        found: dict[str, Any] = {}
        alone = len(self.freedoms) == 1 or self.is_isotropic
        each = {self.freedoms[place].name: loss for place, _, loss in self.losses()}
        for label, loss in each.items():
            if not loss.sticks:
                continue
            rest = {**each, label: loss.smooth}
            kept = {name: value for name, value in rest.items() if value is not None} or None
            plain = alone and not isinstance(self.loss, Mapping)
            found[f"{self.name}{'' if alone else f'.{label}'} friction"] = loss.smooth if plain else kept
        return found

    @property
    def is_isotropic(self) -> bool:
        """Whether one loss acts against its whole velocity, whatever its direction."""
        return False

    def resistance(self, rates: Sequence[Scalar], scope: Scope) -> list[Scalar]:
        """Generalized force ∂D/∂v of its losses for each velocity, positive on the left-hand side [N m or N]."""
        forces: list[Scalar] = [0.0] * len(self.freedoms)
        for place, owner, loss in self.losses():
            call = f"force(rate, scope, {owner!r})"
            forces[place] = forces[place] + scalar(loss, "force", call, rates[place], scope, owner)
        return forces

    def elastic_energy(self, q: Sequence[Scalar], scope: Scope) -> Scalar:
        """½ k (q − rest)² of its spring [J]; an exact 0 for joints that have none."""
        if len(self.labels) != 1:
            return 0.0
        owner = f"{self.name} spring"
        stretch = q[0] - scope.parameter(owner, "rest", self.rest)
        return 0.5 * scope.parameter(owner, "stiffness", self.stiffness) * stretch * stretch

    def parameters(self) -> dict[str, float]:
        """Run-time parameters by full name: 'left knee loss.coefficient', 'left knee spring.stiffness', …"""
        result: dict[str, float] = {}
        if len(self.labels) == 1:
            result = {f"{self.name} spring.stiffness": self.stiffness, f"{self.name} spring.rest": self.rest}
        for _, owner, loss in self.losses():
            result |= loss.parameters(owner)
        return result

    def domains(self) -> dict[str, Domain]:
        """The stiffness of its spring ≥ 0."""
        domain = Domain(low=0.0, problem=NEGATIVE_STIFFNESS, called="stiffness")
        return {f"{self.name} spring.stiffness": domain} if len(self.labels) == 1 else {}

    @property
    def known_as(self) -> str:
        """ "joint 'left knee'"."""
        return f"joint '{self.name}'"

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """What is wrong with the values of its spring and its losses."""
        faults = [fault for _, owner, loss in self.losses() for fault in loss.value_faults(owner, values)]
        return list(dict.fromkeys(faults + super().value_faults(values)))

    def faults(self) -> list[str]:
        """What is physically impossible about it, one sentence each."""
        faults = [fault for _, owner, loss in self.losses() for fault in loss.faults(owner)]
        faults += super().faults()
        if isinstance(self.loss, Loss) and self.loss.has_states and len(self.freedoms) > 1:
            several = ", ".join(f"'{label.name}': …" for label in self.freedoms)
            faults.append(
                f"'{self.name} loss': {self.loss!r} has a state, which one velocity bends; give one for each "
                f"velocity, loss={{{several}}}"
            )
        for place, owner, loss in self.losses():
            if loss.needs_reaction and self.freedoms[place].unit != "rad":
                name = self.freedoms[place].name
                faults.append(f"'{owner}': friction of a pin on '{name}', which does not turn; use mbd.Coulomb")
        if self.parent.body is self.child.body:
            faults.append(
                f"joint '{self.name}' connects '{self.parent.body.name}' to itself; give a frame of another body"
            )
        return list(dict.fromkeys(faults))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """'left knee.angle', …"""
        return tuple(f"{self.name}.{label.name}" for label in self.labels)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """'left knee.angle.rate', …"""
        return tuple(f"{self.name}.{label.name}" for label in self.velocity_labels)

    def validate(self) -> None:
        """Check the fields at the border; every joint calls this when it is made."""
        kind, put = type(self).__name__, object.__setattr__
        name_of(self.name, kind)
        for side in ("parent", "child"):
            value: Any = getattr(self, side)
            if not isinstance(value, Frame):
                raise ModelError(
                    f"{kind} '{self.name}': its {side} must be a frame such as thigh.end or model.ground.origin, "
                    f"got {value!r}{frames_in_words(value)}"
                )
        if isinstance(self.loss, Mapping) and not self.loss:
            put(self, "loss", None)
        if isinstance(self.loss, Mapping):
            known = [label.name for label in self.freedoms]
            for label in self.loss:
                if label not in known:
                    raise ModelError(f"loss of '{self.name}': " + nearest(label, known, "coordinate", "The joint has"))
            put(self, "loss", {label: loss_of(loss, f"{self.name}.{label}") for label, loss in self.loss.items()})
        elif loss_of(self.loss, self.name) is not None and len({label.unit for label in self.freedoms}) != 1:
            labels = ", ".join(f"'{label.name}' [{label.unit}]" for label in self.freedoms)
            raise ModelError(
                f"{kind} '{self.name}': one loss cannot serve its coordinates ({labels or 'it has none'}); "
                "say on which each acts, such as loss={'angle': mbd.Viscous(0.1)}"
            )
        if not among(self.anatomy, ("", *ANATOMY)):
            raise ModelError(
                f"anatomy of '{self.name}': " + nearest(self.anatomy, ANATOMY, "joint of the body", "There are")
            )
        if "stiffness" in vars(self):
            put(self, "stiffness", number(self.stiffness, f"stiffness of '{self.name}'"))
            if "rest" in vars(self):
                put(self, "rest", number(self.rest, f"rest of '{self.name}'"))
            if not self.is_elastic and (self.stiffness or self.rest):
                raise ModelError(
                    f"{kind} '{self.name}': its stiffness would act on several coordinates "
                    f"({', '.join(label.name for label in self.labels)}); free one only, or apply an mbd.Spring"
                )
            if self.stiffness < 0.0:
                raise ModelError(self.value_faults(self.parameters()))
