"""A mechanism in energies: textbook problems, without bodies."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Self, TypeAlias, cast

from mbd.bodies.domains import Domain, Parameterized
from mbd.bodies.values import is_several, named_number_faults, names_of, number, printable
from mbd.constraints.base import Constraint
from mbd.constraints.controller import Controller
from mbd.constraints.event import Event
from mbd.constraints.machine import Machine
from mbd.constraints.observation import Observation
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.forces.base import Force
from mbd.topology.description import all_are, served

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
        printable(self.name, "Coordinate")
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


@dataclass(frozen=True)
class _OwnParameters(Parameterized):
    """The parameters of a description itself, apart from those of its forces and constraints."""

    name: str
    values: Mapping[str, float]
    limits: Mapping[str, Domain]

    def parameters(self) -> dict[str, float]:
        return dict(self.values)

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        return [
            fault
            for name, domain in self.limits.items()
            if name in values
            for fault in domain.faults(self.known_as, name, values[name])
        ]


@dataclass(frozen=True, eq=False)
class EnergyDescription:
    """The words of a mechanism that is given by its energies; `Lagrangian` is this with all that follows from it."""

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
    controllers: Sequence[Controller] = ()
    domains: Mapping[Any, Domain] = field(default_factory=dict)
    observations: Sequence[Observation] = ()

    def __post_init__(self) -> None:
        _check_shapes(self)
        put = object.__setattr__
        put(self, "coordinates", tuple(_coordinate(c) for c in self.coordinates))
        put(self, "tunable", names_of(self.tunable, f"tunable of {self.name!r}"))
        put(self, "forces", {_name(key): value for key, value in self.forces.items()})
        put(self, "constraints", _named(self.constraints))
        put(self, "nonholonomic", dict(self.nonholonomic))
        put(self, "controllers", list(self.controllers))
        given = {_name(key): float(value) for key, value in self.parameters.items()}
        put(self, "parameters", given | self._of_words())
        put(self, "domains", {_name(key): domain for key, domain in self.domains.items()})

    # the two verbs ------------------------------------------------------------------------------------------------
    def constrain(self, *constraints: Constraint) -> None:
        """Add constraints and events, as to a `Model`."""
        example = (
            "constrain takes constraints such as mbd.Unilateral('floor', y.q), and events; "
            "forces and controllers go to apply"
        )
        self._add(served(all_are(Constraint, constraints, example)), self.constraints)

    def apply(self, *forces: Force | Controller | Machine) -> None:
        """Add forces on coordinates, such as `mbd.Potential` or a force class of one's own, controllers and modes."""
        example = "apply takes forces such as mbd.Potential('spring', lambda q: 5.0 * q**2, 'theta'), and controllers"
        known = all_are((Force, Controller, Machine), forces, example)
        self.constrain(*[word for word in known if isinstance(word, Machine)])
        self._add([word for word in known if isinstance(word, Force)], self.forces)
        controllers = [*self.controllers, *(word for word in known if isinstance(word, Controller))]
        object.__setattr__(self, "controllers", controllers)

    def observe(self, name: str, function: Any, *arguments: Any, unit: str = "") -> None:
        """Add a result of one's own, as to a `Model`; an expression is of coordinates, rates and parameters."""
        object.__setattr__(self, "observations", (*self.observations, Observation(name, function, arguments, unit)))

    def _add(self, words: Sequence[Any], known: Any) -> None:
        """Put words under their names."""
        for word in words:
            if word.name in known:
                raise ModelError(f"{self.name!r} has a {word.name!r} already; give each its own name")
            known[word.name] = word
        object.__setattr__(self, "parameters", {**self.parameters, **self._of_words()})

    # what it contains ---------------------------------------------------------------------------------------------
    @property
    def words(self) -> list[Constraint]:
        """Its constraints and events that are not bare expressions."""
        return [word for word in self._constraints.values() if isinstance(word, Constraint)]

    @property
    def rows(self) -> dict[str, Expression]:
        """Those that are, by name."""
        return {name: h for name, h in self._constraints.items() if not isinstance(h, Constraint)}

    @property
    def applied(self) -> list[Force]:
        """The forces that `apply` added."""
        return [force for force in self.forces.values() if isinstance(force, Force)]

    @property
    def generalized(self) -> dict[str, Expression]:
        """The generalized forces by coordinate."""
        return {name: force for name, force in self.forces.items() if not isinstance(force, Force)}

    @property
    def contacts(self) -> list[Constraint]:
        """Constraints that open and close, in order."""
        return [word for word in self.words if word.kind in ("unilateral", "penalty")]

    @property
    def machines(self) -> list[Machine]:
        """Modes and sampled laws."""
        return [cast(Machine, word) for word in self.words if word.kind == "machine"]

    @property
    def events(self) -> list[Event]:
        """The user's own events."""
        return [cast(Event, word) for word in self.words if word.kind == "event"]

    @property
    def own_parameters(self) -> dict[str, float]:
        """The parameters without those of its words."""
        others = self._of_words()
        return {name: value for name, value in self.parameters.items() if name not in others}

    def own_word(self) -> _OwnParameters:
        return _OwnParameters(self.name, self.own_parameters, self.domains)

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of what inputs of a linearization may be added to: the force on each coordinate, laws of its words."""
        own = tuple(f"{coordinate.name}.force" for coordinate in self.coordinates)
        return own + tuple(name for word in (*self.applied, *self.words) for name in word.laws())

    @property
    def _constraints(self) -> Mapping[str, Any]:
        assert isinstance(self.constraints, Mapping)
        return self.constraints

    def _of_words(self) -> dict[str, float]:
        """The parameters of its words by full name."""
        return {name: value for word in (*self.applied, *self.words) for name, value in word.parameters().items()}

    def without(self, *names: str) -> Self:
        """A copy that lacks some of its 'potential', 'dissipation', forces ('theta force'), constraints, controllers.

        'box friction' is the dry friction of a contact alone.
        """
        forces = {name if isinstance(force, Force) else f"{name} force": name for name, force in self.forces.items()}
        rubbing = {title: (word.name, bare) for word in self.words for title, bare in word.bare().items()}
        known = {"potential", "dissipation", *forces, *self._constraints, *self.nonholonomic, *rubbing}
        known |= {controller.name for controller in self.controllers}
        for name in names:
            if name not in known:
                raise UnknownNameError("without: " + nearest(name, known, "effect or constraint"))
        smooth = dict(pair for title, pair in rubbing.items() if title in names)
        kept = {**self._constraints, **smooth}
        constraints = {name: h for name, h in kept.items() if name not in names and h is not None}
        bare: dict[str, Any] = {name: 0.0 for name in ("potential", "dissipation") if name in names}
        bare["forces"] = {name: self.forces[name] for title, name in forces.items() if title not in names}
        bare["constraints"] = constraints
        bare["nonholonomic"] = {name: rate for name, rate in self.nonholonomic.items() if name not in names}
        bare["controllers"] = [controller for controller in self.controllers if controller.name not in names]
        bare["parameters"], bare["tunable"] = self.own_parameters, ()
        made = replace(self, **bare)
        return made.with_tunable(*(name for name in self.tunable if name in made.parameters))

    def with_tunable(self, *names: str) -> Self:
        """A copy in which some parameters stay inputs even at an exact 0 or ±1."""
        return replace(self, tunable=(*self.tunable, *names))


# reading the description --------------------------------------------------------------------------------------------
def _coordinate(given: Any) -> Coordinate:
    return given if isinstance(given, Coordinate) else Coordinate(_name(given))


def _name(given: Any) -> str:
    """'theta' of a Coordinate, a name, a symbol, or ``theta(t)``."""
    return given if isinstance(given, str) else str(getattr(given, "name", given))


def _named(constraints: Mapping[str, Expression] | Sequence[Any]) -> dict[str, Expression]:
    """Constraints by name; words have their own."""
    if isinstance(constraints, Mapping):
        return {h.name if isinstance(h, Constraint) else name: h for name, h in constraints.items()}
    numbered = list(enumerate(constraints, start=1))
    pairs = [c if isinstance(c, tuple) else (getattr(c, "name", f"constraint {k}"), c) for k, c in numbered]
    return dict(pairs)


def _check_shapes(system: EnergyDescription) -> None:
    """Arguments of a wrong kind, all of them at once."""
    if not isinstance(system.name, str) or not system.name.strip():
        raise ModelError(f"Lagrangian needs a name as its first argument, got {system.name!r}")
    printable(system.name, "Lagrangian")
    faults = []
    if isinstance(system.coordinates, Mapping) or not is_several(system.coordinates):
        faults.append(f"coordinates must be a list of mbd.Coordinate or names, got {system.coordinates!r}")
    for field_name in ("forces", "parameters", "nonholonomic", "domains"):
        value = getattr(system, field_name)
        if not isinstance(value, Mapping):
            faults.append(f"{field_name} must be a mapping from names, such as {{'theta': …}}, got {value!r}")
    if isinstance(system.parameters, Mapping):
        faults += named_number_faults({_name(key): value for key, value in system.parameters.items()}, "parameters")
    if isinstance(system.domains, Mapping):
        faults += [
            f"domains[{_name(key)!r}] must be an mbd.Domain, such as mbd.Domain(low=0.0), got {domain!r}"
            for key, domain in system.domains.items()
            if not isinstance(domain, Domain)
        ]
    if not is_several(system.constraints):
        faults.append(f"constraints must be a mapping {{name: h}} or a list of expressions, got {system.constraints!r}")
    if not is_several(system.controllers) or not all(isinstance(c, Controller) for c in system.controllers):
        faults.append(f"controllers must be a list of mbd.Controller, got {system.controllers!r}")
    if faults:
        raise ModelError([f"Lagrangian {system.name!r}: {fault}" for fault in faults])
