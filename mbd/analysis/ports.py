"""Inputs and outputs of a linearization by name: what an input is, and where it acts."""

from collections.abc import Iterable, Sequence
from typing import Any

from mbd.bodies.values import names_of
from mbd.compile.python import scalar_function
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations, Row
from mbd.equations.ports import PortTerms, enters, ports
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.forces.motor import Motor
from mbd.forces.quantities import INCREMENT_PREFIX
from mbd.notes import doubt
from mbd.results.facts import Facts
from mbd.results.names import AXES
from mbd.results.units import unit
from mbd.tape.node import Node

ORDERS = {"": 0, ".rate": 1, ".acceleration": 2}
"""Derivatives of a parameter that may be an input, by the ending of its name."""


@dataclass(frozen=True)
class InputNames:
    """An input as it was asked for: of the parameter or law `base` its derivative number `order`."""

    name: str
    base: str
    parameter: str
    order: int


@dataclass(frozen=True)
class Input:
    """An input with its place among the equations; `node` is None for a parameter that is in no equation."""

    name: str
    base: str
    order: int
    unit: str
    node: Node | None

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states that it brings along: what is prescribed, and its rate."""
        return tuple(f"{self.base}{ending}" for ending, order in ORDERS.items() if order < self.order)

    def state_unit(self, order: int) -> str:
        """Unit of the derivative number `order` of what is prescribed."""
        return per_second(self.unit, order - self.order)


@dataclass(frozen=True)
class Output:
    """A named result on the tape."""

    name: str
    unit: str
    node: Node


def input_names(model: Any, names: Any) -> tuple[InputNames, ...]:
    """What the names of inputs stand for: run-time parameters, and laws that are functions, expressions or samples.

    Raises
    ------
    UnknownNameError
        with the nearest names.
    """
    names = names_of(names, "inputs")
    _twice(names, "inputs")
    parameters, laws = set(model.parameters), set(model.laws)
    found, faults = [], []
    for name in names:
        for ending, order in ORDERS.items():
            base = name.removesuffix(ending)
            if name.endswith(ending) and base in parameters | laws:
                inner = base if base in parameters else f"{INCREMENT_PREFIX}{base}"
                found.append(InputNames(name, base, inner, order))
                break
        else:
            faults.append(nearest(name, parameters | laws, "input", "There are"))
    if faults:
        raise UnknownNameError(faults)
    return tuple(found)


def acting(model: Any, equations: Equations, rows: Sequence[Row], wanted: Iterable[InputNames]) -> tuple[Input, ...]:
    """The inputs with their nodes, each judged by the active rows that it is in.

    What a row on positions prescribes acts by its acceleration, what one on velocities does by its rate; a parameter of
    forces by its value.

    Raises
    ------
    ModelError
        for another derivative, and for a parameter of rows that is a part of the mechanism, such as a length.
    """
    places = {parameter.name: k for k, parameter in enumerate(equations.parameters)}
    prescribed = _prescribed(model, equations)
    found, faults = [], []
    for each in wanted:
        if each.parameter not in places:
            found.append(Input(each.name, each.base, each.order, "", None))
            continue
        node = equations.tape.input("p", places[each.parameter])
        inside = [row for row in rows if enters(node, [row.value, row.rate])]
        fault = _order_fault(each, inside, prescribed(each, node))
        faults += [fault] if fault else []
        title = per_second(_unit(model, equations, each.base, inside), each.order)
        found.append(Input(each.name, each.base, each.order, title, node))
    if faults:
        raise ModelError(faults)
    return tuple(found)


def _prescribed(model: Any, equations: Equations) -> Any:
    """Judges whether a parameter may change with time in rows: it belongs to a constraint, and moves no mass."""
    words = getattr(model, "words", None)
    if words is None:
        words = model.constraints
    always = [word for word in words if word.kind in ("bilateral", "nonholonomic")]
    owned = {name for word in always for name in (*word.parameters(), *word.laws())}
    own = set(getattr(model, "own_parameters", ()))

    def judge(each: InputNames, node: Node) -> bool:
        return each.base in owned or (each.base in own and not enters(node, [equations.kinetic]))

    return judge


def _order_fault(each: InputNames, inside: Sequence[Row], prescribed: bool) -> str:
    """What is wrong with the derivative that is asked for, '' if nothing."""
    need = 0 if not inside else 1 if all(row.is_velocity for row in inside) else 2
    titles = ", ".join(dict.fromkeys(row.title for row in inside))
    if need and not prescribed:
        return (
            f"{each.base!r} is a part of the mechanism that its rows hold together ({titles}), and can be no input; "
            "differentiate over states that are assembled with other values"
        )
    if need == each.order:
        return ""
    ending = next(ending for ending, order in ORDERS.items() if order == need)
    if not need:
        return f"{each.base!r} is in no active row and acts by its value; ask for the input {each.base!r}"
    along = " and ".join(repr(f"{each.base}{e}") for e, order in ORDERS.items() if order < need)
    return (
        f"{each.base!r} prescribes a motion ({titles}), which acts by its {ending[1:]}; ask for the input "
        f"{each.base + ending!r}, which makes {along} states"
    )


def _unit(model: Any, equations: Equations, name: str, inside: Sequence[Row]) -> str:
    """Unit of a parameter or a law, '' where nothing tells."""
    owner, _, field = name.rpartition(".")
    if inside and field in ("value", "bias"):
        return per_second(inside[0].unit, field == "bias")
    for word in (*getattr(model, "forces", ()), *getattr(model, "constraints", ())):
        if isinstance(word, Motor) and word.name == owner:
            return "N m" if word.joint.labels[0].unit == "rad" else "N"
        domain = None if isinstance(word, str) else word.domains().get(name)
        if domain is not None and domain.unit:
            return str(domain.unit)
    if owner == "gravity":
        return "m/s²"
    units = {coordinate.name: coordinate.unit for coordinate in equations.coordinates}
    if field == "force" and owner in units:
        return {"rad": "N m", "m": "N"}.get(units[owner], "")
    return unit(name, Facts.of(equations)) if owner.rpartition(".")[2] in ("force", "torque") else ""


def per_second(base: str, order: int) -> str:
    """The unit of a derivative by time; of an integral for negative orders."""
    for ending, power in ("/s²", 2), ("/s", 1):
        if base.endswith(ending):
            base, order = base.removesuffix(ending), order + power
            break
    return base + {1: "/s", 2: "/s²"}.get(order, "") if base else ""


def output_nodes(equations: Equations, names: Any) -> tuple[Output, ...]:
    """The quantities that results have by these names; a vector gives its three components.

    Raises
    ------
    UnknownNameError
        with the nearest names.
    """
    names = names_of(names, "outputs")
    _twice(names, "outputs")
    places = {parameter.name: k for k, parameter in enumerate(equations.parameters)}
    known, facts = set(equations.output_names()), Facts.of(equations)
    found, faults = [], []
    for name in names:
        parts: tuple[str, ...] = (name,)
        if name not in known and all(f"{name}{axis}" in known for axis in AXES):
            parts = tuple(f"{name}{axis}" for axis in AXES)
        for part in parts:
            node = _node(equations, part, places)
            if node is None:
                vectors = {each[:-2] for each in known if each.endswith(".x")}
                faults.append(nearest(name, known | vectors, "result"))
            else:
                found.append(Output(part, unit(part, facts), node))
    if faults:
        raise UnknownNameError(faults)
    _twice([each.name for each in found], "outputs")
    return tuple(found)


def _node(equations: Equations, name: str, places: dict[str, int]) -> Node | None:
    try:
        return equations.output(name)
    except (UnknownNameError, KeyError):
        for inner in (name, f"{INCREMENT_PREFIX}{name}"):
            if inner in places:
                return equations.tape.input("p", places[inner])
    return None


def _twice(names: Sequence[str], what: str) -> None:
    doubled = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if doubled:
        raise ModelError([f"{name!r} is given twice in {what}; give each once" for name in doubled])


def port_terms(found: Any, inputs: Sequence[Input], outputs: Sequence[Output]) -> PortTerms:
    """Derivatives by the inputs that are in equations, and of the outputs, at an `Instant`."""
    mechanism, mode = found.mechanism, (found.rows, found.penalties, found.sliding)
    equations, given = mechanism.equations, tuple(each.node for each in inputs if each.node is not None)
    read = [each.node for each in outputs]
    key = (ports, mode, tuple(node.index for node in given), tuple(node.index for node in read))
    function = mechanism.kept(
        key, lambda: scalar_function(ports(equations, *mode, given, read), mechanism.layout, "ports")
    )
    out = found.evaluate(function)
    return PortTerms.of(out, equations, len(found.rows), len(given), len(outputs))


def doubt_of_idle(names: Sequence[str]) -> None:
    """Tell which inputs do nothing."""
    if names:
        listed, them = ", ".join(map(repr, names)), "it" if len(names) == 1 else "them"
        doubt(f"{listed}: nothing depends on {them} at this state; the columns of B and D are zero")
