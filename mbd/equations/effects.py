"""The causes of forces, each with its own virtual work: weight, joint springs and losses, and forces."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from functools import partial

from mbd.bodies.promises import called, title_of
from mbd.dataclass import dataclass
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Dynamics, Work
from mbd.equations.equations import Effect
from mbd.equations.gathered import Gathered
from mbd.equations.states import has_pairs, with_states
from mbd.errors import ModelError
from mbd.forces.base import Action, Force
from mbd.joints.base import Joint
from mbd.joints.losses.base import rates_of
from mbd.tape.derivatives import jvp, live
from mbd.tape.node import Node, Scalar

NO_POTENTIAL = {"v": "velocities", "a": "accelerations", "s": "rates of states", "lam": "forces of constraints"}
"""Inputs on which no potential depends."""


@dataclass
class Cause:
    """What one effect does.

    column : its kind in the energy ledger, '' for the usual one of its kind
    work : its virtual work, positive on the left-hand side; power : what it gives to the mechanism [W], None if nothing
    potential : stored energy [J]; rates : ż of its first-order states
    inertia : virtual work of what it moves besides the bodies; kinetic : the energy of that [J]
    """

    name: str
    kind: str
    column: str = ""
    work: Work = field(default_factory=Work)
    power: Node | None = None
    potential: Node | None = None
    rates: tuple[tuple[Node, Scalar], ...] = ()
    inertia: Work = field(default_factory=Work)
    kinetic: Node | None = None

    @property
    def acts(self) -> bool:
        """Whether anything of it is left after folding."""
        return self.works or self.kinetic is not None

    @property
    def works(self) -> bool:
        """Whether it is more than inertia: an effect."""
        parts = [*self.work.multipliers, *self.work.forces]
        return bool(self.rates) or any(not isinstance(part, float) and not part.is_zero for part in parts)


def causes(scope: DerivationScope, joints: Iterable[Joint], forces: Iterable[Force], gathered: Gathered) -> list[Cause]:
    """Springs and losses of all joints, then the forces, without what folds away; errors are `gathered`.

    A force may be named like the spring that a joint could have: then the parameters of that name are the force's.
    """
    found: list[Cause] = []
    forces = list(forces)
    taken = {force.name for force in forces}
    for joint in joints:
        with gathered.catch(joint.name):
            if f"{joint.name} spring" not in taken:
                found.append(_joint_spring(joint, scope))
            found.append(_joint_loss(joint, scope))
    for force in forces:
        with gathered.catch(force.name):
            found.append(_force(force, scope))
    return [cause for cause in found if cause.acts]


def _joint_spring(joint: Joint, scope: DerivationScope) -> Cause:
    """``½ k (q − rest)²``, or what else the joint stores; nothing for a stiffness that folds."""
    cause = Cause(f"{joint.name} spring", "potential")
    if joint.is_elastic and not scope.parameter(cause.name, "stiffness", joint.stiffness).is_zero:
        _store(cause, joint.elastic_energy(scope.joint(joint.name).coordinates, scope), scope)
    return cause


def _joint_loss(joint: Joint, scope: DerivationScope) -> Cause:
    """``∂D/∂q̇`` on each rate, the states of losses and what these store."""
    cause = Cause(f"{joint.name} loss", "loss", "joint loss")
    if joint.losses():
        rates = scope.joint(joint.name).rates
        pairs = list(zip(rates, joint.resistance(rates, scope), strict=True))
        _apply(cause, [(rate, -scope.tape.lift(force)) for rate, force in pairs], scope)
        with_state = [each for each in joint.losses() if each[2].has_states]
        cause.rates = tuple(
            pair for place, owner, loss in with_state for pair in rates_of(loss, rates[place], scope, owner)
        )
        stored = sum((scope.tape.lift(loss.elastic(scope, owner)) for _, owner, loss in with_state), scope.tape.zero)
        if not stored.is_zero:
            _store(cause, stored, scope)
    return cause


def _force(force: Force, scope: DerivationScope) -> Cause:
    """The action of a force."""
    action = _action(force, scope)
    cause = Cause(force.name, force.kind, force.column, rates=action.rates)
    _apply(cause, action.pairs, scope)
    if action.potential is not None:
        _require_energy(scope.real(action.potential))
        _store(cause, action.potential, scope)
    for velocity, mass in action.inertias:
        _carry(cause, scope.tape.lift(velocity), scope.tape.lift(mass), scope)
    if action.dissipation is not None:
        _dissipate(cause, scope.tape.lift(action.dissipation), scope)
    return cause


def _action(force: Force, scope: DerivationScope) -> Action:
    """What ``force.act`` returns, or a `ModelError` of what that should be."""
    title = title_of(force)
    action = called(force, "act", "act(scope)", scope)
    if not isinstance(action, Action):
        raise ModelError(f"{title}: act(scope) must return an mbd.forces.Action, got {action!r}")
    for field_name, example in (
        ("pairs", "(velocity, force)"),
        ("rates", "(state, its rate)"),
        ("inertias", "(velocity, inertia)"),
    ):
        given = getattr(action, field_name)
        if not has_pairs(given):
            raise ModelError(
                f"{title}: act(scope) returns Action({field_name}={given!r}); give pairs {example}, such as "
                f"{field_name}=({example},)"
            )
    return action


def _require_energy(potential: Node) -> None:
    """Raise a `ModelError` for a potential that forces would not follow from by its slopes alone."""
    asked = {node.data[0] for node in live([potential]) if node.op == "input"}
    if wrong := [what for kind, what in NO_POTENTIAL.items() if kind in asked]:
        raise ModelError(
            f"the potential depends on {' and '.join(wrong)}; it is an energy of positions and time, and what depends "
            "on more is a force: mbd.Applied, mbd.Motor, or a Force of your own"
        )


def _store(cause: Cause, energy: Scalar, scope: DerivationScope) -> None:
    """V: +∂V/∂q on the left-hand side."""
    cause.potential = scope.tape.lift(energy)
    cause.work.on_value(cause.potential, 0.0 if cause.potential.is_constant else scope.tape.one)


def _apply(cause: Cause, pairs: Iterable[tuple[Scalar, Scalar]], scope: DerivationScope) -> None:
    """(velocity, force) pairs: −force on the left-hand side, power force · velocity."""
    lift = scope.tape.lift
    for velocity, force in pairs:
        cause.work.on_velocity(lift(velocity), -lift(force))
        power = lift(force * velocity)
        cause.power = power if cause.power is None else cause.power + power


def _carry(cause: Cause, velocity: Node, mass: Node, scope: DerivationScope) -> None:
    """T = ½ J u² with u = φ̇(q, t): ``d/dt ∂T/∂v − ∂T/∂q`` is J u̇ on u."""
    if mass.is_zero:
        return
    cause.inertia.on_velocity(velocity, mass * scope.change(velocity))
    energy = 0.5 * mass * scope.real(velocity) * scope.real(velocity)
    cause.kinetic = energy if cause.kinetic is None else cause.kinetic + energy


def _dissipate(cause: Cause, D: Node, scope: DerivationScope) -> None:
    """D(v): +∂D/∂v on the left-hand side, power −v · ∂D/∂v."""
    cause.work.on_velocity(D, scope.tape.one)
    own = {view.node: view.node for view in scope.views.inside([D]) if view.motion}  # velocities are linear in v
    loss = -jvp([D], {**{rate: rate for rate in scope.inputs.v}, **own})[0]
    cause.power = loss if cause.power is None else cause.power + loss


def weight_of(scope: DerivationContext, dynamics: Dynamics) -> Cause:
    """Gravity, which enters the balance as an acceleration of the ground, as an effect of its own."""
    cause = Cause("gravity", "gravity")
    x, y, z = scope.gravity
    _store(cause, dynamics.weight_energy((x, y, z)), scope)
    return cause


def effect_of(cause: Cause, scope: DerivationScope, dynamics: Generalized) -> Effect:
    """The record of a cause; its generalized forces are made when they are asked for."""
    power = None if cause.power is None or cause.power.is_zero else scope.real(cause.power)
    potential = None if cause.potential is None else scope.real(cause.potential)
    return Effect(cause.name, cause.kind, _lazily(scope, dynamics, cause.work), power, potential, column=cause.column)


def penalty_effect(
    name: str, contact: int, gap: Node, rate: Node, force: Node, generalized: Sequence[Node], scope: DerivationScope,
    elastic: Node | None = None, fast: bool = False,
) -> Effect:  # fmt: skip
    """A force law as an effect; its power on the mechanism is force · (ġ − ∂g/∂t) while it acts.

    It is force · (∂g/∂v · v) of a gap that is a velocity (`fast`).
    """
    speed = _of_motion(gap, scope) if fast else rate - jvp([gap], {scope.time: 1.0})[0]
    forces = partial(with_states, scope, generalized)
    return Effect(name, "penalty", forces, force * speed, contact=contact, elastic=elastic)


def drag_effect(
    name: str, contact: int, drags: Sequence[tuple[Node, Node]], generalized: Sequence[Node], scope: DerivationScope,
    column: str = "friction",
) -> Effect:  # fmt: skip
    """Forces along velocities, (velocity, force), while a contact is closed."""
    power = scope.tape.zero
    for velocity, force in drags:
        power = power + force * _of_motion(velocity, scope)
    forces = partial(with_states, scope, generalized)
    return Effect(name, "loss", forces, power, contact=contact, column=column)


def _of_motion(velocity: Node, scope: DerivationScope) -> Node:
    """∂γ/∂v · v: a velocity without that of surfaces that are moved."""
    return jvp([velocity], {rate: rate for rate in scope.inputs.v})[0]


def _lazily(scope: DerivationScope, dynamics: Generalized, work: Work) -> Callable[[], Sequence[Node]]:
    return lambda: with_states(scope, dynamics.generalized(work))
