"""The second front door: textbook problems given by their energies, without bodies."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from mbd.bodies.domains import ParameterCheck
from mbd.constraints.expressions import quantities_in
from mbd.dataclass import dataclass
from mbd.equations.coordinate_scope import CoordinateScope, identifier
from mbd.equations.cost import Cost
from mbd.equations.derivation import derivation_faults
from mbd.equations.energies import Lowering, assembled
from mbd.equations.energy_description import EnergyDescription
from mbd.equations.equations import Equations
from mbd.errors import ModelError, nearest
from mbd.forces.quantities import INCREMENT_PREFIX
from mbd.notebook import Faults, Text
from mbd.topology.check import machine_faults, rule_faults
from mbd.topology.describe import described_constraint, in_html, listed

if TYPE_CHECKING:
    from mbd.constraints.base import Constraint
    from mbd.forces.base import Force


@dataclass(frozen=True, eq=False)
class Lagrangian(EnergyDescription):
    """A mechanism given by its energies in generalized coordinates q, with v = q̇.

    ``d/dt ∂T/∂v − ∂T/∂q + ∂V/∂q + ∂D/∂v − Q + (∂h/∂q)ᵀ λ = 0``, ``h(q, t) = 0``

    Every expression is sympy in the coordinates' symbols, the parameters' symbols and ``t``, or a plain Python
    function whose arguments are named 'theta', 'theta_rate', 't' or after a parameter (other characters than letters
    and digits become '_').

    Parameters
    ----------
    name : of the mechanism
    coordinates : `Coordinate` objects, names, or sympy's ``dynamicsymbols``
    kinetic : T(q, v, t) [J]
    potential : V(q, t) [J]
    dissipation : D(v, q, t) [W]; its gradient ∂D/∂v resists the motion
    forces : generalized forces Q(t, q, v) by coordinate (or its name)
    constraints : h by name, or (name, h) pairs, or bare expressions called 'constraint 1', …; and words, as `constrain`
        takes them
    nonholonomic : ``a(q, t) · v + b(q, t) = 0`` by name, rows on velocities whose B is a
    parameters : values by sympy symbol or by name; run-time inputs, where exact 0 and ±1 fold unless `tunable`
    tunable : names of parameters that stay inputs even at 0 or ±1
    controllers : as `apply` takes them
    domains : what its parameters may be, by sympy symbol or by name: ``{m: mbd.Domain(low=0.0, unit="kg")}``; others
        may have any finite value

    `constrain` and `apply` add contacts, friction, events and controllers, as to a `Model`; gaps, guards and rows are
    sympy expressions of the coordinates, the parameters and ``t``, or measures of them:

    >>> import sympy, mbd
    >>> y = mbd.Coordinate("y", unit="m")
    >>> m, g = sympy.symbols("m g")
    >>> ball = mbd.Lagrangian("ball", [y], m * y.v**2 / 2, m * g * y.q, parameters={m: 0.2, g: 9.81})
    >>> ball.constrain(mbd.Unilateral("floor", y.q, restitution=0.5))
    >>> ball.check()
    []
    """

    def check(self) -> list[str]:
        """Every fault of the description, one sentence each; expressions and functions are traced."""
        return Faults(self._own_faults() or derivation_faults(self))

    def _own_faults(self) -> list[str]:
        """The faults that show without the equations."""
        faults = _name_faults(self) + self.own_word().faults()
        if faults:
            return faults
        lowering = Lowering(self)
        found = lowering.faults or _word_faults(self, lowering.scope)
        return found or machine_faults(self, Lagrangian.parameter_check)

    def require_valid(self) -> None:
        """Raise a `ModelError` with every fault, if there is one."""
        faults = self.check()
        if faults:
            raise ModelError(faults)

    def parameter_check(self) -> ParameterCheck:
        """The judgement of values that differ from those of the description."""
        return ParameterCheck([self.own_word(), *self.applied, *self.words], self.parameters)

    def equations_of_motion(self) -> Equations:
        """The same equations that a model of bodies gives; faults are raised together as a `ModelError`."""
        if faults := self._own_faults():
            raise ModelError(faults)
        return assembled(self, Lowering(self))

    def equations(self, *, latex: bool = False) -> str:
        """M, f, B and h as text, or as LaTeX; a notebook shows them as formulas."""
        from mbd.equations.printing import report

        return report(self.equations_of_motion(), latex=latex)

    def describe(self, mobility: bool = False) -> str:
        """The mechanism in a page of text; with `mobility` the degrees of freedom too, see `mbd.mobility`."""
        text = _described(self, self.check())
        if mobility and not self.check():
            from mbd.assembly.mobility import mobility as of

            text += f"\n{of(self)}"
        return Text(text)

    def cost(self) -> Cost:
        """Operations of the equations, and of each effect."""
        from mbd.equations.cost import cost

        return cost(self)

    def _repr_html_(self) -> str:
        return in_html(f"Lagrangian({self.name!r})", _parts(self, self.check()))


def _ambiguous(coordinates: Sequence[str], parameters: Iterable[str]) -> list[str]:
    """Names under which an expression would find two quantities: 't' is the time, 'theta_rate' the rate of 'theta'."""
    quantities = {"the time": "t"}
    quantities |= {f"the coordinate {name!r}": name for name in coordinates}
    quantities |= {f"the rate of {name!r}": f"{name}_rate" for name in coordinates}
    quantities |= {f"the parameter {name!r}": name for name in parameters}
    found: dict[str, str] = {}
    faults = []
    for what, name in quantities.items():
        other = found.setdefault(identifier(name), what)
        twice = what == f"the parameter {name!r}" and other == f"the coordinate {name!r}"  # told already
        if other != what and not twice:
            faults.append(f"{what} is written {identifier(name)!r} in expressions, as is {other}; give it another name")
    return faults


def _name_faults(system: EnergyDescription) -> list[str]:
    names = [coordinate.name for coordinate in system.coordinates]
    faults = [] if names else [f"{system.name!r} has no coordinates; give at least one mbd.Coordinate"]
    taken: set[str] = set()
    for name in (*names, *system.own_parameters):
        if name in taken:
            faults.append(f"the name {name!r} is given twice among the coordinates and parameters of {system.name!r}")
        taken.add(name)
    faults += _ambiguous(names, system.own_parameters)
    faults += [
        "domains: " + nearest(name, system.own_parameters, "parameter", "There are")
        for name in system.domains
        if name not in system.own_parameters
    ]
    faults += [
        f"two constraints of {system.name!r} are named {name!r}; give each its own name"
        for name in system.constraints
        if name in system.nonholonomic
    ]
    faults += [nearest(name, names, "coordinate") for name in system.generalized if name not in names]
    faults += [
        nearest(name, system.parameters, "parameter", "There are")
        for name in system.tunable
        if name not in system.parameters and not name.startswith(INCREMENT_PREFIX)
    ]
    return faults


def _word_faults(system: EnergyDescription, scope: CoordinateScope) -> list[str]:
    """What is wrong with its words, one sentence each."""
    words: list[Force | Constraint] = [*system.applied, *system.words]
    found = [fault for word in words for fault in (*word.faults(), *word.value_faults(word.parameters()))]
    names = [word.name for word in (*words, *system.controllers, *system.observations)]
    names += [*system.rows, *system.nonholonomic, *(coordinate.name for coordinate in system.coordinates)]
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        found.append(f"the name {name!r} is used {names.count(name)} times; give each its own name")
    owners = {force.name for force in system.applied}
    for word in words:
        for mention in word.mentions():
            if not isinstance(mention, str):
                found.append(
                    f"{word.name!r} refers to {mention.name!r} of a body or joint, which a Lagrangian has not; give an "
                    "expression of its coordinates"
                )
            elif not scope.knows(mention) and mention.rpartition(".")[0] not in owners:
                found.append(f"{word.name!r}: " + nearest(mention, scope.known, "quantity", "Known are"))
    for event in system.events:
        values = event.reset.values() if isinstance(event.reset, dict) else ()
        unknown = [
            name for name in quantities_in([v for v in values if hasattr(v, "free_symbols")]) if not scope.knows(name)
        ]
        found += [
            f"the reset of {event.name!r}: " + nearest(name, scope.known, "quantity", "Known are") for name in unknown
        ]
    return list(dict.fromkeys(found + rule_faults(system)))


def _described(system: EnergyDescription, faults: Sequence[str]) -> str:
    """Coordinates, energies, parameters, forces, constraints and faults."""
    return listed(f"{system.name}: given by its energies", _parts(system, faults))


def _parts(system: EnergyDescription, faults: Sequence[str]) -> dict[str, list[str]]:
    """The same by title, an entry a line."""
    energies = {"T": system.kinetic, "V": system.potential, "D": system.dissipation}
    forces = [f"{name} force: {_said(force)}" for name, force in system.generalized.items()]
    forces += [f"{force.name}: {type(force).__name__}, {force.kind}" for force in system.applied]
    rows = [f"{name}: {_said(h)} = 0" for name, h in (*system.rows.items(), *system.nonholonomic.items())]
    return {
        "coordinates": [f"{c.name} [{c.unit}]" for c in system.coordinates],
        "energies": [f"{letter} = {_said(value)}" for letter, value in energies.items()],
        "parameters": [f"{name} = {value:.6g}" for name, value in system.own_parameters.items()],
        "forces": forces,
        "constraints": [*rows, *(described_constraint(word) for word in system.words)],
        "controllers": [controller.name for controller in system.controllers],
        "observations": [f"{each.name} [{each.unit or '-'}]" for each in system.observations],
        "faults": list(faults),
    }


def _said(expression: object) -> str:
    """An expression, or the name of a function."""
    return str(getattr(expression, "__name__", expression)) if callable(expression) else str(expression)
