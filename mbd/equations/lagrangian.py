"""The second front door: textbook problems given by their energies, without bodies."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from mbd.bodies.domains import ParameterCheck
from mbd.bodies.values import named_number_faults, names_of, number
from mbd.equations import equations as records
from mbd.equations.equations import Effect, Equations, Row
from mbd.equations.inputs import Inputs
from mbd.equations.outputs import Outputs
from mbd.equations.parameters import ParameterTable
from mbd.errors import ModelError, TraceError, UnknownNameError, nearest
from mbd.tape.derivatives import gradient, jvp, live
from mbd.tape.node import Node, Scalar, Tape
from mbd.tape.tracing import traced_scalar

__all__ = ["Coordinate", "Expression", "Lagrangian"]

Expression: TypeAlias = Any
"""A sympy expression, a number, or a plain Python function whose arguments are named after what they mean."""


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate θ and its rate, as sympy symbols `q` and `v` for writing energies.

    >>> theta = Coordinate("theta")
    >>> theta.q, theta.v
    (theta, theta_rate)

    Parameters
    ----------
    name : its name in results: ``run["theta"]``, ``run["theta.rate"]``, ``run["theta.acceleration"]``
    unit : for tables and plots
    default : value where a start does not say otherwise
    """

    name: str
    unit: str = "rad"
    default: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise ModelError(f"Coordinate needs a name, such as Coordinate('theta'); got {self.name!r}")
        if not isinstance(self.unit, str):
            raise ModelError(f"unit of Coordinate {self.name!r} must be a text such as 'rad' or 'm', got {self.unit!r}")
        object.__setattr__(self, "default", number(self.default, f"default of Coordinate {self.name!r}"))

    @property
    def q(self) -> Any:
        """The coordinate as a sympy symbol."""
        import sympy

        return sympy.Symbol(self.name, real=True)

    @property
    def v(self) -> Any:
        """Its rate as a sympy symbol."""
        import sympy

        return sympy.Symbol(f"{self.name}_rate", real=True)


@dataclass(frozen=True, eq=False)
class Lagrangian:
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
    constraints : h by name, or (name, h) pairs, or bare expressions called 'constraint 1', …
    nonholonomic : ``a(q, t) · v + b(q, t) = 0`` by name, rows on velocities whose B is a
    parameters : values by sympy symbol or by name; run-time inputs, where exact 0 and ±1 fold unless `tunable`
    tunable : names of parameters that stay inputs even at 0 or ±1
    """

    name: str
    coordinates: Sequence[Coordinate | Any]
    kinetic: Expression
    potential: Expression = 0.0
    dissipation: Expression = 0.0
    forces: Mapping[Any, Expression] = field(default_factory=dict)
    constraints: Mapping[str, Expression] | Sequence[Any] = ()
    parameters: Mapping[Any, float] = field(default_factory=dict)
    tunable: Collection[str] = ()
    nonholonomic: Mapping[str, Expression] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_shapes(self)
        object.__setattr__(self, "coordinates", tuple(_coordinate(c) for c in self.coordinates))
        object.__setattr__(self, "parameters", {_name(key): float(value) for key, value in self.parameters.items()})
        object.__setattr__(self, "tunable", names_of(self.tunable, f"tunable of {self.name!r}"))
        object.__setattr__(self, "forces", {_name(key): value for key, value in self.forces.items()})
        object.__setattr__(self, "constraints", _named(self.constraints))
        object.__setattr__(self, "nonholonomic", dict(self.nonholonomic))

    def check(self) -> list[str]:
        """Every fault of the description, one sentence each."""
        faults = _name_faults(self)
        return faults or _Lowering(self).faults

    def parameter_check(self) -> ParameterCheck:
        """The judgement of values that differ from those of the description; any finite one may be given."""
        return ParameterCheck((), self.parameters)

    def equations_of_motion(self) -> Equations:
        """The same equations that a model of bodies gives; faults are raised together as a `ModelError`."""
        faults = _name_faults(self)
        if faults:
            raise ModelError(faults)
        lowering = _Lowering(self)
        if lowering.faults:
            raise ModelError(lowering.faults)
        return _assembled(self, lowering)

    def equations(self, *, latex: bool = False) -> str:
        """M, f, B and h as text, or as LaTeX."""
        from mbd.equations.printing import report

        return report(self.equations_of_motion(), latex=latex)

    def cost(self) -> Any:
        """Operations of the equations, and of each effect."""
        from mbd.equations.cost import cost

        return cost(self)

    def without(self, *names: str) -> Lagrangian:
        """A copy that lacks some of its 'potential', 'dissipation', forces ('theta force') and constraints."""
        forces = {f"{name} force": name for name in self.forces}
        known = {"potential", "dissipation", *forces, *self.constraints, *self.nonholonomic}
        for name in names:
            if name not in known:
                raise UnknownNameError("without: " + nearest(name, known, "effect or constraint"))
        bare: dict[str, Any] = {name: 0.0 for name in ("potential", "dissipation") if name in names}
        bare["forces"] = {name: self.forces[name] for title, name in forces.items() if title not in names}
        bare["constraints"] = {name: h for name, h in self._rows.items() if name not in names}
        bare["nonholonomic"] = {name: rate for name, rate in self.nonholonomic.items() if name not in names}
        return replace(self, **bare)

    def with_tunable(self, *names: str) -> Lagrangian:
        """A copy in which some parameters stay inputs even at an exact 0 or ±1."""
        return replace(self, tunable=(*self.tunable, *names))

    @property
    def _rows(self) -> Mapping[str, Expression]:
        """The constraints by name."""
        rows = self.constraints
        assert isinstance(rows, Mapping)
        return rows


# reading the description --------------------------------------------------------------------------------------------
def _coordinate(given: Any) -> Coordinate:
    return given if isinstance(given, Coordinate) else Coordinate(_name(given))


def _name(given: Any) -> str:
    """'theta' of a Coordinate, a name, a symbol, or ``theta(t)``."""
    return given if isinstance(given, str) else str(getattr(given, "name", given))


def _named(constraints: Mapping[str, Expression] | Sequence[Any]) -> dict[str, Expression]:
    if isinstance(constraints, Mapping):
        return dict(constraints)
    pairs = [c if isinstance(c, tuple) else (f"constraint {k}", c) for k, c in enumerate(constraints, start=1)]
    return dict(pairs)


def _check_shapes(system: Lagrangian) -> None:
    """Arguments of a wrong kind, all of them at once."""
    if not isinstance(system.name, str) or not system.name.strip():
        raise ModelError(f"Lagrangian needs a name as its first argument, got {system.name!r}")
    faults = []
    if isinstance(system.coordinates, str | Mapping) or not isinstance(system.coordinates, Iterable):
        faults.append(f"coordinates must be a list of mbd.Coordinate or names, got {system.coordinates!r}")
    for field_name in ("forces", "parameters", "nonholonomic"):
        value = getattr(system, field_name)
        if not isinstance(value, Mapping):
            faults.append(f"{field_name} must be a mapping from names, such as {{'theta': …}}, got {value!r}")
    if isinstance(system.parameters, Mapping):
        faults += named_number_faults({_name(key): value for key, value in system.parameters.items()}, "parameters")
    if isinstance(system.constraints, str) or not isinstance(system.constraints, Iterable):
        faults.append(f"constraints must be a mapping {{name: h}} or a list of expressions, got {system.constraints!r}")
    if faults:
        raise ModelError([f"Lagrangian {system.name!r}: {fault}" for fault in faults])


def _name_faults(system: Lagrangian) -> list[str]:
    names = [coordinate.name for coordinate in system.coordinates]
    faults = [] if names else [f"{system.name!r} has no coordinates; give at least one mbd.Coordinate"]
    taken: set[str] = set()
    for name in (*names, *system.parameters):
        if name in taken:
            faults.append(f"the name {name!r} is given twice among the coordinates and parameters of {system.name!r}")
        taken.add(name)
    faults += [
        f"two constraints of {system.name!r} are named {name!r}; give each its own name"
        for name in system._rows
        if name in system.nonholonomic
    ]
    faults += [nearest(name, names, "coordinate") for name in system.forces if name not in names]
    faults += [
        nearest(name, system.parameters, "parameter", "There are")
        for name in system.tunable
        if name not in system.parameters
    ]
    return faults


def _identifier(name: str) -> str:
    """The name as a Python argument: 'hip.angle' → 'hip_angle'."""
    return re.sub(r"\W", "_", name)


class _Lowering:
    """The expressions of a description on one tape; `faults` tells which could not be read."""

    def __init__(self, system: Lagrangian) -> None:
        self.tape = tape = Tape()
        n = len(system.coordinates)
        self.inputs = Inputs.sized(tape, n, n, 0, len(system.constraints) + len(system.nonholonomic))
        self.table = ParameterTable(tape, system.tunable)
        self.faults: list[str] = []
        self.q = [q + x for q, x in zip(self.inputs.q, self.inputs.x, strict=True)]
        self._known: dict[str, Scalar] = {"t": self.inputs.t}
        for coordinate, q, v in zip(system.coordinates, self.q, self.inputs.v, strict=True):
            self._known |= {coordinate.name: q, f"{coordinate.name}_rate": v}
        self._known |= {name: self.table.node(name, value) for name, value in system.parameters.items()}
        self.T = self._scalar(system.kinetic, "the kinetic energy")
        self.V = self._scalar(system.potential, "the potential")
        self.D = self._scalar(system.dissipation, "the dissipation")
        self.Q = {name: self._scalar(force, f"the force on {name!r}") for name, force in system.forces.items()}
        self.h = {name: self._scalar(value, f"the constraint {name!r}") for name, value in system._rows.items()}
        self.rates = {name: self._scalar(value, f"the row {name!r}") for name, value in system.nonholonomic.items()}
        self._check(system)

    def _scalar(self, expression: Expression, what: str) -> Node:
        """One expression on the tape; zero, and a fault, where it cannot be read."""
        try:
            return traced_scalar(expression, self._arguments(expression), what, self.tape, symbols=self._dynamic())
        except TraceError as exc:
            self.faults.append(str(exc))
        except ModelError as exc:
            self.faults += [f"{what}: {fault}" for fault in exc.faults]
        return self.tape.zero

    def _arguments(self, expression: Expression) -> list[tuple[str, Scalar]]:
        """What an expression may use, by name; a function gets what its own arguments are named after."""
        if not inspect.isfunction(expression) and not inspect.ismethod(expression):
            return list(self._known.items())
        offered = {_identifier(name): value for name, value in self._known.items()}
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

    def _check(self, system: Lagrangian) -> None:
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
def _assembled(system: Lagrangian, lowering: _Lowering) -> Equations:
    """Lagrange's equations by reverse gradients and one forward sweep in time."""
    tape, inputs = lowering.tape, lowering.inputs
    T, V, D = lowering.T, lowering.V, lowering.D
    clock: dict[Node, Scalar] = {inputs.t: 1.0, **dict(zip(inputs.x, inputs.v, strict=True))}
    motion = {**clock, **dict(zip(inputs.v, inputs.a, strict=True))}
    momentum_rates = jvp(gradient(T, inputs.v), motion)
    dT, dV, dD = gradient(T, inputs.x), gradient(V, inputs.x), gradient(D, inputs.v)
    Q = [lowering.Q.get(c.name, tape.zero) for c in system.coordinates]
    balance = [p - t + v + d - f for p, t, v, d, f in zip(momentum_rates, dT, dV, dD, Q, strict=True)]
    rates = jvp(list(lowering.h.values()), clock)
    rows = [Row(name, "", h, rate, unit="") for (name, h), rate in zip(lowering.h.items(), rates, strict=True)]
    rows += [Row(name, "", tape.zero, rate, unit="", kind="velocity") for name, rate in lowering.rates.items()]
    effects = _effects(system, lowering, dV, dD)
    outputs = _outputs(system, lowering, rows, effects)
    return Equations(
        name=system.name, tape=tape,
        coordinates=tuple(records.Coordinate(c.name, c.unit, c.default) for c in system.coordinates), states=(),
        parameters=lowering.table.found, balance=tuple(balance), rows=tuple(rows), contacts=(), guards=(),
        effects=effects, kinetic=T, potential=V, compose=None, output=outputs, output_names=outputs.names,
        velocity_names=tuple(f"{c.name}.rate" for c in system.coordinates),
    )  # fmt: skip


def _effects(system: Lagrangian, lowering: _Lowering, dV: Sequence[Node], dD: Sequence[Node]) -> tuple[Effect, ...]:
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


def _outputs(system: Lagrangian, lowering: _Lowering, rows: Sequence[Row], effects: Sequence[Effect]) -> Outputs:
    """θ, its rate and acceleration, forces, multipliers, energies and powers."""
    outputs, inputs = Outputs(lowering.tape), lowering.inputs
    for k, coordinate in enumerate(system.coordinates):
        outputs.value(coordinate.name, lowering.q[k])
        outputs.value(f"{coordinate.name}.rate", inputs.v[k])
        outputs.value(f"{coordinate.name}.acceleration", inputs.a[k])
    for name, force in lowering.Q.items():
        outputs.value(f"{name}.force", force)
    for k, row in enumerate(rows):
        outputs.value(f"{row.owner}.multiplier", inputs.lam[k])
        outputs.value(f"{row.owner}.residual", row.rate if row.is_velocity else row.value)
        if row.is_velocity:
            outputs.value(f"{row.owner}.force", -inputs.lam[k])
    for effect in effects:
        if effect.power is not None:
            outputs.value(f"{effect.name}.power", effect.power)
        if effect.potential is not None:
            outputs.value(f"{effect.name}.energy", effect.potential)
    outputs.value("kinetic_energy", lowering.T)
    outputs.value("potential_energy", lowering.V)
    return outputs
