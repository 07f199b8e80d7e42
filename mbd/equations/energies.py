"""Lagrange's equations of a mechanism that is given by its energies."""

import inspect
from collections.abc import Callable, Sequence
from typing import Any

from mbd.constraints.impulse import Impulse
from mbd.equations import equations as records
from mbd.equations.contacts import laws
from mbd.equations.coordinate_scope import CoordinateScope, identifier
from mbd.equations.dynamics import Work
from mbd.equations.effects import causes, effect_of
from mbd.equations.energy_description import EnergyDescription
from mbd.equations.equations import Effect, Equations, Row
from mbd.equations.gathered import Gathered
from mbd.equations.impulses import impulses_of
from mbd.equations.kinks import kinks
from mbd.equations.laws import Laws
from mbd.equations.machines import declare_machines, machine_guards
from mbd.equations.net_moments import offer_net_moments
from mbd.equations.observations import offer_observations
from mbd.equations.outputs import Outputs
from mbd.equations.results import offer_contacts, offer_effects, offer_rows
from mbd.equations.states import state_balance
from mbd.errors import ModelError, TraceError, nearest
from mbd.tape.derivatives import gradient, jvp, live
from mbd.tape.node import Node, Scalar, Tape
from mbd.tape.tracing import traced_scalar


class Lowering:
    """The expressions of a description on one tape; `faults` tells which could not be read."""

    def __init__(self, system: EnergyDescription) -> None:
        names = [coordinate.name for coordinate in system.coordinates]
        written = {name for controller in system.controllers for name in controller.writes}
        self.scope = CoordinateScope(names, system.own_parameters, {*system.tunable, *written})
        self.tape, self.inputs, self.q, self._known = self.scope.tape, self.scope.inputs, self.scope.q, self.scope.known
        self.faults: list[str] = []
        try:
            declare_machines(self.scope, system.machines, self.scope.offer)
        except ModelError as error:
            self.faults += error.faults
        self.T = self._scalar(system.kinetic, "the kinetic energy")
        self.V = self._scalar(system.potential, "the potential")
        self.D = self._scalar(system.dissipation, "the dissipation")
        self.Q = {name: self._scalar(force, f"the force on {name!r}") for name, force in system.generalized.items()}
        added = {name: self.tape.lift(self.scope.increment(name, "force")) for name in names}
        self.Q |= {name: self.Q.get(name, self.tape.zero) + more for name, more in added.items() if not more.is_zero}
        self.h = {name: self._scalar(value, f"the constraint {name!r}") for name, value in system.rows.items()}
        self.rates = {name: self._scalar(value, f"the row {name!r}") for name, value in system.nonholonomic.items()}
        self._check(system)

    def _scalar(self, expression: Any, what: str) -> Node:
        """One expression on the tape; zero, and a fault, where it cannot be read."""
        try:
            return traced_scalar(expression, self._arguments(expression), what, self.tape, symbols=self._dynamic())
        except TraceError as exc:
            self.faults.append(str(exc))
        except ModelError as exc:
            self.faults += [f"{what}: {fault}" for fault in exc.faults]
        return self.tape.zero

    def _arguments(self, expression: Any) -> list[tuple[str, Scalar]]:
        """What an expression may use, by name; a function gets what its own arguments are named after."""
        if not inspect.isfunction(expression) and not inspect.ismethod(expression):
            return list(self._known.items())
        offered = {identifier(name): value for name, value in self._known.items()}
        wanted = list(inspect.signature(expression).parameters)
        unknown = [name for name in wanted if name not in offered]
        if unknown:
            raise ModelError([nearest(name, offered, "quantity", "Known are") for name in unknown])
        return [(name, offered[name]) for name in wanted]

    def _dynamic(self) -> dict[Any, Scalar]:
        """Coordinates written as functions of time, θ(t) and its derivative."""
        import sys

        sympy = sys.modules.get("sympy")
        if sympy is None:
            return {}
        t = sympy.Symbol("t")
        found: dict[Any, Scalar] = {}
        for name, value in self._known.items():
            if f"{name}_rate" in self._known:
                motion = sympy.Function(name)(t)
                found |= {motion: value, motion.diff(t): self._known[f"{name}_rate"]}
        return found

    def _check(self, system: EnergyDescription) -> None:
        """An energy of the wrong variables is a fault."""
        still = [("the potential", self.V), *((f"the constraint {name!r}", h) for name, h in self.h.items())]
        for what, node in still:
            for coordinate, slope in zip(system.coordinates, gradient(node, self.inputs.v), strict=True):
                if not slope.is_zero:
                    self.faults.append(f"{what} depends on the rate of '{coordinate.name}'; only q and t may enter it")
        for name, h in self.h.items():
            if h.is_constant:
                self.faults.append(f"the constraint {name!r} is the constant {h.data}; it depends on no coordinate")
        for name, rate in self.rates.items():
            slopes = gradient(rate, self.inputs.v)
            if any(other.op == "input" and other.data[0] == "v" for other in live(slopes)):
                self.faults.append(f"the row {name!r} is not linear in rates; give a(q, t) · v + b(q, t)")
            elif all(slope.is_zero for slope in slopes):
                self.faults.append(f"no rate enters the row {name!r}; a row of q and t belongs to constraints")


# the equations ------------------------------------------------------------------------------------------------------
def assembled(system: EnergyDescription, lowering: Lowering) -> Equations:
    """Lagrange's equations by reverse gradients and one forward sweep in time, with the words that were added."""
    tape, inputs, scope = lowering.tape, lowering.inputs, lowering.scope
    T, V, D = lowering.T, lowering.V, lowering.D
    clock: dict[Node, Scalar] = {inputs.t: 1.0, **dict(zip(inputs.x, inputs.v, strict=True))}
    motion = {**clock, **dict(zip(inputs.v, inputs.a, strict=True))}
    momentum_rates = jvp(gradient(T, inputs.v), motion)
    dT, dV, dD = gradient(T, inputs.x), gradient(V, inputs.x), gradient(D, inputs.v)
    Q = [lowering.Q.get(c.name, tape.zero) for c in system.coordinates]
    balance = [p - t + v + d - f for p, t, v, d, f in zip(momentum_rates, dT, dV, dD, Q, strict=True)]
    own = _effects(system, lowering, dV, dD)
    scope.parameters.expect(system.parameters)
    gathered = Gathered()
    found = causes(scope, (), system.applied, gathered)
    acting = scope.generalized(sum((cause.work + cause.inertia for cause in found), Work()))
    carried = sum((cause.kinetic for cause in found if cause.kinetic is not None), tape.zero)
    found = [cause for cause in found if cause.works]
    balance = [r + f for r, f in zip(balance, acting, strict=True)]
    known = _laws(system, lowering, gathered)
    rates = [*(pair for cause in found for pair in cause.rates), *known.rates]
    with gathered.catch():
        balance += state_balance(scope, rates)
        known.guards += kinks(scope, found, known)
    gathered.raise_all()
    effects = (*own, *(effect_of(cause, scope, scope) for cause in found), *known.effects)
    potential = V
    for effect in effects[len(own) :]:
        potential = potential if effect.potential is None else potential + effect.potential
    kinetic = energy_of_motion(lowering) + carried
    outputs = _outputs(system, lowering, known, effects, kinetic, potential)
    offer_observations(outputs, scope, system.observations)
    equations = Equations(
        name=system.name, tape=tape,
        coordinates=tuple(records.Coordinate(c.name, c.unit, c.default) for c in system.coordinates),
        states=tuple(coordinate for coordinate, _ in scope.states), parameters=scope.parameters.found,
        balance=tuple(balance), rows=tuple(known.rows), contacts=tuple(known.contacts), guards=tuple(known.guards),
        effects=effects, kinetic=kinetic, potential=potential, compose=None, output=outputs, output_names=outputs.names,
        velocity_names=tuple(f"{c.name}.rate" for c in system.coordinates), frictions=tuple(known.frictions),
        machines=tuple(known.machines),
        impulses=tuple(known.impulses),
        observations=tuple((each.name, each.unit) for each in system.observations),
    )  # fmt: skip
    offer_net_moments(outputs, equations)
    return equations


def energy_of_motion(lowering: Lowering) -> Node:
    """T; where T is not quadratic in rates, the energy v · ∂T/∂v − T that takes its place in the balance of energy."""
    T, v = lowering.T, lowering.inputs.v
    momenta = gradient(T, v)
    masses = [mass for momentum in momenta for mass in gradient(momentum, v)]
    if not any(node.op == "input" and node.data[0] == "v" for node in live(masses)):
        return T
    return _sum(lowering.tape, [momentum * rate for momentum, rate in zip(momenta, v, strict=True)]) - T


def _laws(system: EnergyDescription, lowering: Lowering, gathered: Gathered) -> Laws:
    """Constraints given as expressions, then those given as words; errors are `gathered`."""
    scope, tape = lowering.scope, lowering.tape
    rates = scope.rates(list(lowering.h.values()))
    known = Laws(viewed=[*lowering.h.values(), *lowering.rates.values()])
    known.rows += [Row(name, "", h, rate, unit="") for (name, h), rate in zip(lowering.h.items(), rates, strict=True)]
    known.rows += [Row(name, "", tape.zero, rate, unit="", kind="velocity") for name, rate in lowering.rates.items()]
    always = [word for word in system.words if word.kind in ("bilateral", "nonholonomic")]
    written = {name for controller in system.controllers for name in controller.writes}
    laws(scope, scope, (), always, system.contacts, system.events, gathered, before=known, written=written)
    with gathered.catch():
        known.take_machines(*machine_guards(scope, system.machines, system.contacts, system.events, system.parameters))
    words = [word for word in system.words if isinstance(word, Impulse)]
    known.impulses += impulses_of(scope, scope, words, system.contacts, gathered)
    return known


def _effects(
    system: EnergyDescription, lowering: Lowering, dV: Sequence[Node], dD: Sequence[Node]
) -> tuple[Effect, ...]:
    """The causes of forces: potential, dissipation, and each generalized force."""
    tape, v = lowering.tape, lowering.inputs.v
    found = []
    if any(not node.is_zero for node in dV):
        found.append(Effect("potential", "potential", lambda: tuple(dV), potential=lowering.V))
    if any(not node.is_zero for node in dD):
        power = -_sum(tape, [d * rate for d, rate in zip(dD, v, strict=True)])
        found.append(Effect("dissipation", "loss", lambda: tuple(dD), power=power))
    for k, coordinate in enumerate(system.coordinates):
        force = lowering.Q.get(coordinate.name, tape.zero)
        if not force.is_zero:
            found.append(Effect(f"{coordinate.name} force", "applied", _alone(tape, len(v), k, -force), force * v[k]))
    return tuple(found)


def _alone(tape: Tape, size: int, place: int, value: Node) -> Callable[[], Sequence[Node]]:
    return lambda: tuple(value if k == place else tape.zero for k in range(size))


def _sum(tape: Tape, terms: Sequence[Node]) -> Node:
    total = tape.zero
    for term in terms:
        total = total + term
    return total


def _outputs(
    system: EnergyDescription,
    lowering: Lowering,
    known: Laws,
    effects: Sequence[Effect],
    kinetic: Node,
    potential: Node,
) -> Outputs:
    """θ, its rate and acceleration, forces, multipliers, contacts, energies and powers."""
    tape, inputs, scope = lowering.tape, lowering.inputs, lowering.scope
    outputs = Outputs(tape)
    outputs.value("t", inputs.t)
    for k, coordinate in enumerate(system.coordinates):
        outputs.value(coordinate.name, lowering.q[k])
        outputs.value(f"{coordinate.name}.rate", inputs.v[k])
        outputs.value(f"{coordinate.name}.acceleration", inputs.a[k])
        outputs.alias(f"{coordinate.name}_rate", f"{coordinate.name}.rate")
    for state, node in scope.states:
        outputs.value(state.name, node)
    for name in (name for machine in system.machines for name in machine.quantity_names):
        outputs.value(name, scope.known[name])
    for name, force in lowering.Q.items():
        outputs.value(f"{name}.force", force)
    offer_rows(outputs, tape, known.rows)
    offer_contacts(outputs, tape, known.rows, known.contacts)
    offer_effects(outputs, tape, effects)
    outputs.value("kinetic_energy", kinetic)
    outputs.value("potential_energy", potential)
    return outputs
