"""A mechanism as callable numbers: the compiled programs of its equations, made when they are needed."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from itertools import accumulate, pairwise
from math import prod
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import ref

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.backend import Backend, Function, Functions, backend as choose_backend
from mbd.compile.cache import key_of
from mbd.compile.composed import Composed, Shape, Term
from mbd.compile.energies import Energies
from mbd.compile.layout import Layout
from mbd.compile.mass_loop import WithMasses
from mbd.compile.orders import Filled, elimination_order, is_unit, may_pay, pattern, written
from mbd.compile.postponed import Postponed
from mbd.compile.remembered import Facts, Remembered
from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.equations.composite_mass import MassLoop
from mbd.equations.composition import Part, composes, own_program
from mbd.equations.equations import Equations
from mbd.equations.explicit_solution import explicit_solution
from mbd.equations.programs import ActiveSet
from mbd.equations.sizes import require_room_for_tangent, tangent_refused
from mbd.errors import MemoryLimitError, ModelError, UnknownNameError, nearest
from mbd.free_memory import no_collection
from mbd.tape.derivatives import live
from mbd.tape.node import Node


@dataclass(frozen=True)
class ModeCode:
    """Code of one contact mode: Newton tangent with residual, and residual alone.

    active : what acts in it
    correction, solution : the tangent with its factors and what solves with these (see `programs.correction`), or None
    order : in which the matrices of many unknowns are eliminated (see `orders`), or None
    rates, returns : accelerations, and corrections onto the rows (see `mbd.equations.explicit_solution`), or None
    """

    active: ActiveSet
    tangent: Any
    residual: Any
    correction: Any = None
    solution: Any = None
    order: Any = None
    rates: Any = None
    returns: Any = None


class AccelerationTerms:
    """The parts of ``M a + f + R λ = 0``, ``h``, ``ḣ``, ``ḧ = B a + bias`` of all rows, and what closing contacts hold.

    Each is cut out of the output of their program when somebody first looks at it: few are looked at.

    M (n, n), f (n,), R (n, n_rows), B (n_rows, n), h, rate, bias (n_rows,), captured (n_anchors,), kinetic [J],
    limits (n_frictions,) largest frictions [N, N m], impulses (n_impulses, n_v) w P of the user's as contacts close.
    """

    M: Matrix
    f: Vector
    R: Matrix
    B: Matrix
    h: Vector
    rate: Vector
    bias: Vector
    captured: Vector
    kinetic: float
    limits: Vector
    impulses: Matrix

    def __init__(self, out: Vector, parts: Mapping[str, tuple[slice, tuple[int, ...]]]) -> None:
        self._out, self._parts = out, parts

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name not in vars(self).get("_parts", ()):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self)
            place, shape = self._parts[name]
            part = self._out[place]
            vars(self)[name] = found = part.reshape(shape) if shape else float(part[0])
            return found

    def saddle(self, rows: Sequence[int], R: Matrix | None = None) -> Matrix:
        """``[M R; B 0]`` of some rows, with another R if one is given."""
        n, size = len(self.f), len(self.f) + len(rows)
        whole = np.zeros((size, size))
        whole[:n, :n], whole[:n, n:], whole[n:, :n] = self.M, (self.R if R is None else R)[:, rows], self.B[rows]
        return whole


T = TypeVar("T")
Made = tuple[Mapping[str, Sequence[Node]], Facts]
"""Programs by name, and what else was found while they were made."""


class Mechanism:
    """The programs of a set of equations in one backend.

    Common programs (accelerations, guards, magnitudes) are made at once; those of a contact mode
    the first time that mode occurs. Parameters stay run-time inputs.
    """

    def __init__(self, equations: Equations, backend: str = "auto") -> None:
        started = perf_counter()
        self.equations = equations
        self.backend: Backend = choose_backend(backend)
        self.layout = Layout.of(equations)
        self.common: Functions = self.backend.functions(self.layout)
        self._remembered, self._unmade = Remembered(equations, self.common), list[Callable[[], Made]]()
        self.vector, self.judged = equations.compose is None, programs.is_judged(equations)
        facts = self._compiled("common", self._made_at_once)
        self.accelerations: Function = self.common["accelerations"]
        if facts["bodies of M"]:
            self.accelerations = WithMasses(self.accelerations, self.layout.n, facts["bodies of M"])
        if not self.vector:
            self._compiled("charts", self._charts, rarely=True)
        rare = {"scales": programs.scales} | ({"terms": programs.guard_terms} if self.judged else {})
        for name, make in rare.items():  # twice a restart, and nowhere else
            self._compiled(name, lambda name=name, make=make: ({name: make(equations)}, {}), rarely=True)  # type: ignore[misc]
        self._kept: dict[Hashable, Any] = {}
        self.idle: dict[Hashable, Any] = {}  # what runs have left for the next ones
        self.notes: list[str] = []
        self.postponed: list[Postponed] = []
        self.without_effect: frozenset[str] = frozenset()
        self._modes: dict[tuple[Any, ...], ModeCode] = {}
        self._parts_of_modes: dict[Part, tuple[Facts, dict[str, Term]]] = {}
        self._drawn: dict[str, Sequence[Node]] = {}
        self._has_free_rates: bool | None = None
        equations.memory["mechanism"] = ref(self)
        if self.accelerations.address:
            equations.memory["machine code"] = self.layout, self.common, self.accelerations
        self.seconds = perf_counter() - started

    def _compiled(self, question: Hashable, make: Callable[[], Made], rarely: bool = False) -> Facts:
        """Offer the functions of the programs that are made, from where they are remembered if they are; the facts.

        What was found before is made first if something else must be: the order of nodes on the tape is that of
        questions, whatever is remembered, and so is the text of all code.
        """
        facts = self._remembered.find(question)
        if facts is not None:
            self._unmade.append(make)
            return facts
        with no_collection():
            while self._unmade:
                self._unmade.pop(0)()
            made, facts = make()
            if made:
                self.common.add(made, rarely)
        self._remembered.keep(question, facts, bool(made))
        return facts

    def _made_at_once(self) -> Made:
        """What steps of every mode need."""
        n, untouched = self.layout.n, self.equations.tape.untouched  # M alone is ever written to by others
        of_rows = range(n * (n + 1), n * (n + 1) + 2 * n * self.layout.n_rows)
        accelerations = self._accelerations.copy()
        for k in of_rows:
            if accelerations[k].is_zero:
                accelerations[k] = untouched
        made = {"accelerations": accelerations, "guards": programs.guards(self.equations)}
        composed = programs.compose(self.equations)
        if composed is not None:
            made |= {"compose": composed, "increment_rates": programs.increment_rates(self.equations)}
        return made, {"bodies of M": [] if self._mass_loop is None else list(self._mass_loop.bodies)}

    def _charts(self) -> Made:
        return {"chart_end": chart_end(self.equations), "chart_motion": chart_motion(self.equations)}, {}

    @cached_property
    def _mass_loop(self) -> MassLoop | None:
        return None if self.equations.geometry is None else self.equations.geometry.mass_loop()

    @cached_property
    def _accelerations(self) -> list[Node]:
        """What straight-line code writes; a loop may fill M."""
        return programs.accelerations(self.equations, loop=self._mass_loop)

    @cached_property
    def acceleration_nodes(self) -> list[Node]:
        """The program `accelerations` with every entry of M."""
        return self._accelerations if self._mass_loop is None else programs.accelerations(self.equations)

    @property
    def _operations(self) -> int:
        """What is derived, and what a loop spares of M: Newton's matrix has as many entries."""
        return len(self.equations.tape.nodes) + (0 if self._mass_loop is None else self._mass_loop.spared)

    @cached_property
    def _composes(self) -> bool:
        return composes(self.equations)

    @cached_property
    def _filled(self) -> Filled:
        return Filled.of(self._accelerations, self.layout.n, self.layout.n_rows)

    def free_rates(self) -> Function | None:
        """Accelerations of a tree on which no row acts, without M; made on first use, None where only M leads to them.

        See `programs.free_rates`.
        """
        with self.equations.tape.lock:
            if self._has_free_rates is None:
                self._has_free_rates = bool(self._compiled("free rates", self._made_without_rows)["found"])
            return self.common["free_rates"] if self._has_free_rates else None

    def _made_without_rows(self) -> Made:
        n = self.layout.n
        found = programs.free_rates(self.equations, self._accelerations[n * n : n * (n + 1)])
        return {} if found is None else {"free_rates": found}, {"found": found is not None}

    def mode(self, active: ActiveSet) -> ModeCode:
        """Code of a contact mode, made on first use."""
        with self.equations.tape.lock:  # runs in other threads share this mechanism
            if active not in self._modes and self._composes:
                self._modes[active] = self._composed(active)
            elif active not in self._modes:

                def make() -> Made:
                    require_room_for_tangent(self._operations)
                    outputs = programs.newton(self.equations, active)
                    order = self._order(pattern(outputs, self.layout.n + len(active.rows)), active.rows)
                    if order is not None:
                        outputs = self._as_eliminated(outputs, active, order)
                    return {"tangent": outputs, "residual": programs.residual(self.equations, active)}, {"order": order}

                facts, (tangent, residual) = self._add("mode", active, ("tangent", "residual"), make)
                self._modes[active] = ModeCode(active, tangent, residual, order=_numbers(facts["order"]))
            return self._modes[active]

    def _as_eliminated(self, outputs: Sequence[Node], active: ActiveSet, order: list[int]) -> list[Node]:
        """The tangent of a mode without the zeros that nobody reads who eliminates in this order."""
        n, n_v, m = self.layout.n, self.layout.n_v, len(active.rows)
        asked = {int(place) for places in written(_numbers(order), n, n_v, active.stabilized) for place in places}
        asked.update(range((n + m) ** 2, (n + m) ** 2 + active.tail(n)))
        untouched = self.equations.tape.untouched
        return [untouched if node.is_zero and k not in asked else node for k, node in enumerate(outputs)]

    def _composed(self, active: ActiveSet) -> ModeCode:
        """A mode of parts, each of which is made the first time that a mode needs it."""
        parts = [self._part(part) for part in Part.of_mode(self.equations, active)]
        rows, n, stabilized = tuple(sorted(active.rows)), self.layout.n, active.stabilized
        size, n_v = n + len(rows), self.layout.n_v
        shape, short = (Shape(n, n_v, rows, stabilized, whole) for whole in (True, False))

        def make() -> Made:
            entries: dict[tuple[int, int], bool] = {}
            for facts, _ in parts:
                for place, is_number in zip(
                    shape.places(facts["tangent"]).tolist(), facts["units of tangent"], strict=True
                ):
                    if place < size * size:
                        at = divmod(place, size)
                        entries[at] = is_number and at not in entries
            return {}, {"order": self._order(entries, rows)}

        facts = self._compiled(("order", active), make)
        order, cleared = _numbers(facts["order"]), None
        if order is not None:
            matrix, turning = written(order, n, n_v, stabilized)
            cleared = shape.head, short.size, np.concatenate([matrix, turning])

        def summed(name: str, shape: Shape, cleared: Any = None) -> Composed:
            terms = [functions[name]._replace(places=shape.places(facts[name])) for facts, functions in parts]
            return Composed(name, terms, shape.size, cleared)

        tangent, residual = summed("tangent", shape, cleared), summed("residual", short)
        return ModeCode(active, tangent, residual, order=order)

    def _part(self, part: Part) -> tuple[Facts, dict[str, Term]]:
        """Where the outputs of a part of a mode go, and its functions; the same one for all contacts of a kind."""
        if part in self._parts_of_modes:
            return self._parts_of_modes[part]

        def make() -> Made:
            require_room_for_tangent(self._operations)
            facts: dict[str, Any] = {}
            for name, made in (("tangent", part.newton), ("residual", part.residual)):
                found = made(self.equations)
                outputs, inputs = [node for _, node in found], list[tuple[str, int]]()
                facts[name], facts[f"units of {name}"] = [at for at, _ in found], [is_unit(node) for node in outputs]
                if part.contact >= 0 and not any(node.op == "table" for node in live(outputs)):
                    outputs, inputs = own_program(outputs)
                tape = outputs[0].tape if outputs else self.equations.tape
                known = (tuple(tape.keys()), [node.index for node in outputs]) if inputs else part
                facts[f"program of {name}"] = called = f"{name}_{key_of(repr(known))[:16]}"
                facts[f"inputs of {name}"] = [
                    [self.layout.place(kind, i) for kind, i in inputs if kind != "p"],
                    [i for kind, i in inputs if kind == "p"],
                ]
                self._drawn[called] = outputs
            return {}, facts

        facts, functions = self._compiled(("part", part), make), {}
        names = "tangent", "residual"
        if not all(self._has_program(facts[f"program of {name}"]) for name in names):
            # remembered, but not its programs: their nodes and inputs come in another order on another tape
            while self._unmade:
                self._unmade.pop(0)()
            facts = make()[1]
            self._remembered.keep(("part", part), facts, False)
        for name in names:
            called, (block, parameters) = facts[f"program of {name}"], facts[f"inputs of {name}"]
            if called not in self.common:
                self._compiled(called, lambda called=called: ({called: self._drawn[called]}, {}))  # type: ignore[misc]
            functions[name] = Term(self.common[called], _places([]), _places(block), _places(parameters))
        self._parts_of_modes[part] = facts, functions
        return self._parts_of_modes[part]

    def _has_program(self, called: str) -> bool:
        """Whether a program of a part is there, drawn in this process or remembered, which loads it."""
        return called in self.common or called in self._drawn or self._remembered.find(called) is not None

    def stepping(self, active: ActiveSet) -> ModeCode:
        """The same for the compiled kernel: with factors in straight-line code where that pays and no row is `given`.

        The tangent as a matrix is then needed only where a pivot of these is too small; it is made the first time.
        """
        if active.given_rows:
            return self.mode(active)
        key = (*active, "stepping")
        with self.equations.tape.lock:
            if key not in self._modes:
                self._modes[key] = self._straight(active) or self.mode(active)
            return self._modes[key]

    def explicit(self, active: ActiveSet) -> ModeCode:
        """The same for steps that ask for accelerations alone: tangent and residual are made if somebody calls them."""
        key = (*active, "explicit")
        with self.equations.tape.lock:
            if key not in self._modes:
                n, rows = self.layout.n, active.rows
                tangent = self._later("tangent", active, active.size(n, self.layout.n_v), self._newton)
                residual = self._later("residual", active, active.tail(n), programs.residual)

                def make() -> Made:
                    order = None
                    pays = may_pay(self._filled, n, sorted(rows))
                    if pays and not tangent_refused(self._operations):  # whose pattern is that of both
                        order = self._order(pattern(programs.newton(self.equations, active), n + len(rows)), rows)
                    found = None
                    if order is None and not active.given_rows:
                        found = explicit_solution(self.equations, self._accelerations, sorted(rows))
                    made = {} if found is None else {"rates": found.rates, "returns": found.returns}
                    return made, {"order": order}

                facts, made = self._add("explicit", active, ("rates", "returns"), make)
                rates, returns = made or (None, None)
                order = _numbers(facts["order"])
                self._modes[key] = ModeCode(active, tangent, residual, order=order, rates=rates, returns=returns)
            return self._modes[key]

    def _straight(self, active: ActiveSet) -> ModeCode | None:
        """A mode with factors, None where they do not pay."""
        names = "residual", "correction", "solution"

        def make() -> Made:
            require_room_for_tangent(len(self.equations.tape.nodes))
            found = programs.correction(self.equations, active)
            if found is None:
                return {}, {"tail": None}
            residual = programs.residual(self.equations, active)
            return dict(zip(names, (residual, found.outputs, found.solution), strict=True)), {"tail": found.tail}

        facts, functions = self._add("straight", active, names, make)
        if facts["tail"] is None:
            return None
        residual, first, again = functions
        tangent = self._later("tangent", active, active.size(self.layout.n, self.layout.n_v), self._newton)
        return ModeCode(active, tangent, residual, first, again)

    def _newton(self, equations: Equations, active: ActiveSet) -> Sequence[Node]:
        """`programs.newton` within a run, which ends in order where it does not fit into the memory that is free."""
        refused = tangent_refused(self._operations)
        if refused:
            raise MemoryLimitError(f"a step needs the tangent as a matrix: {refused}")
        return programs.newton(equations, active)

    def _later(self, name: str, active: ActiveSet, size: int, maker: Callable[..., Sequence[Node]]) -> Postponed:
        """A program of a mode, of so many outputs, that is compiled when it is called first."""

        def make() -> Function:
            return self._add(name, active, (name,), lambda: ({name: maker(self.equations, active)}, {}))[1][0]

        later = Postponed(make, size)
        self.postponed.append(later)
        return later

    def order(self, rows: tuple[int, ...]) -> Any | None:
        """The order in which matrices of accelerations with these rows are eliminated, None where it does not pay.

        Rows may depend on others: each is eliminated by its own pivot, which then is round-off of its terms. What a
        pair of numbers leaves of another row does not show in that one's pivot.
        """

        def make() -> Made:
            places = self._filled.places(self.layout.n, rows)
            return {}, {"order": self._order(dict.fromkeys(places, False), rows)}

        question = "order of accelerations", rows
        return self.kept((Mechanism.order, rows), lambda: _numbers(self._compiled(question, make)["order"]))

    def _order(self, tangent: Mapping[tuple[int, int], bool], rows: Sequence[int]) -> list[int] | None:
        """The order in which the matrices of these rows are eliminated, None where it does not pay."""
        n, n_rows = self.layout.n, self.layout.n_rows
        found = elimination_order(tangent, self._accelerations, self._filled, n, n_rows, sorted(rows))
        return None if found is None else list(found.tolist())

    def _add(
        self, kind: str, active: ActiveSet, names: Sequence[str], make: Callable[[], Made]
    ) -> tuple[Facts, list[Function]]:
        """Compile those programs of a mode that there are not yet, with the mode in their names; facts and functions.

        There are none where `make` makes none.
        """
        own = f"_{key_of(repr(active))[:16]}"
        with self.equations.tape.lock:
            started = perf_counter()
            wanted = tuple(name for name in names if name + own not in self.common)

            def named() -> Made:
                made, facts = make()
                return {name + own: made[name] for name in wanted if name in made}, facts

            facts = self._compiled((kind, active, wanted), named)
            self.seconds += perf_counter() - started
            return facts, [self.common[name + own] for name in names if name + own in self.common]

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """What somebody else makes of this mechanism once, kept with it.

        Parameters
        ----------
        key : the function or class that it is made for, with what else it depends on
        make : makes it; nobody else adds to the tape meanwhile
        """
        if key not in self._kept:
            with self.equations.tape.lock:
                if key not in self._kept:
                    self._kept[key] = make()
        found: T = self._kept[key]
        return found

    @cached_property
    def turning(self) -> tuple[tuple[str, list[int]], ...]:
        """Joints whose coordinates do not add, with the places of their angular velocities."""
        return tuple(
            (joint.name, [first + k for k, freedom in enumerate(joint.freedoms) if freedom.unit == "rad"])
            for joint, _, first in self.equations.configuration.charts
        )

    @cached_property
    def energies(self) -> Energies:
        """T and V [J] at many states at once."""
        machine = self.machine_code if self.accelerations.address else None
        return Energies(self.equations, self.layout, machine)

    def machine_code(self, name: str, outputs: Sequence[Node]) -> Function:
        """A function of the equations' own nodes, which adds none to the tape, made when it is first asked for."""
        with self.equations.tape.lock:
            if name not in self.common and self._remembered.find(name) is None:
                self.common.add({name: outputs}, rarely=True)
                self._remembered.keep(name, {}, True)
            return self.common[name]

    @property
    def modes(self) -> int:
        """How many contact modes have code."""
        return len(self._modes)

    def parameters(
        self, values: Mapping[str, float] | None = None, folded: Mapping[str, float] | None = None
    ) -> Vector:
        """The parameter vector, with some values replaced by name; tables follow.

        A value equal to the one that `folded` gives for its name is already part of the equations; parameters
        `without_effect`, such as the rest of a spring of stiffness 0, are in no equation.

        Raises
        ------
        UnknownNameError
            for a name that is not a run-time parameter, with the nearest one.
        """
        places, own = self._places_and_values
        p, given = own.copy(), folded or {}
        for name, value in (values or {}).items():
            place = places.get(name)
            if name in self.without_effect or (place is None and given.get(name) == value):
                continue
            if place is None and name in given:
                raise ModelError(
                    f"{name!r} is an exact 0 or ±1 of the model, which is part of its equations; name it in "
                    "tunable=[…] of the model"
                )
            if place is None:
                raise UnknownNameError(nearest(name, {*places, *given}, "parameter", "There are"))
            p[place] = float(value)
        return p

    def parameters_of(self, model: Any, values: Mapping[str, float]) -> Vector:
        """The same for a model of this mechanism, which is asked for what is folded only where it counts."""
        places, own = self._places_and_values
        if not values:
            return own.copy()
        return self.parameters(values, {} if values.keys() <= places.keys() else getattr(model, "parameters", {}))

    @property
    def parameter_places(self) -> Mapping[str, int]:
        """Places of run-time parameters in their vector, by name."""
        return self._places_and_values[0]

    @property
    def _places_and_values(self) -> tuple[dict[str, int], Vector]:
        tables = len(self.equations.tables)  # more may follow
        return self.kept((Mechanism.parameters, tables), self._own_parameters)

    def _own_parameters(self) -> tuple[dict[str, int], Vector]:
        """Places of parameters by name, and the parameter vector with the values of the model."""
        own, tables = self.equations.parameters, self.equations.tables
        values = [each.value for each in own] + [value for table in tables for value in table.flat]
        return {each.name: k for k, each in enumerate(own)}, np.array(values, dtype=float)

    def block(self, t: float, q: Vector, y: Vector, anchors: Vector, penalties: Sequence[int] = ()) -> Vector:
        """The block of inputs at a state, without accelerations and multipliers."""
        layout = self.layout
        block = np.zeros(layout.size)
        block[0] = t
        block[layout.q : layout.x] = q
        block[layout.v : layout.a] = y
        if len(anchors):
            block[layout.anchor : layout.switch] = anchors
        for contact in penalties:
            block[layout.switch + contact] = 1.0
        return block

    def acceleration_terms(
        self,
        t: float,
        q: Vector,
        y: Vector,
        parameters: Vector,
        anchors: Vector,
        penalties: Sequence[int] = (),
        slips: Vector | None = None,
        lam: Vector | None = None,
    ) -> AccelerationTerms:
        """M, f, R, B, h, ḣ, bias at a state; R follows multipliers `lam` where frictions slide (signs `slips`)."""
        layout = self.layout
        block = self.block(t, q, y, anchors, penalties)
        if slips is not None:
            block[layout.slip : layout.shift] = slips
        if lam is not None:
            block[layout.lam : layout.anchor] = lam
        return self.terms_of(block, parameters)

    def terms_of(self, block: Vector, parameters: Vector) -> AccelerationTerms:
        """The same at the inputs in a block; its accelerations and multipliers enter no more than R and the limits."""
        out = np.zeros(self.accelerations.size)
        self.accelerations(block, parameters, out)
        return AccelerationTerms(out, self._parts)

    @cached_property
    def _parts(self) -> dict[str, tuple[slice, tuple[int, ...]]]:
        """Places of the parts of `AccelerationTerms` in the output of their program, and shapes: () of one number."""
        layout = self.layout
        n, rows = layout.n, layout.n_rows
        shapes: dict[str, tuple[int, ...]] = {
            "M": (n, n), "f": (n,), "R": (n, rows), "B": (rows, n), "h": (rows,), "rate": (rows,), "bias": (rows,),
            "captured": (layout.n_anchors,), "kinetic": (), "limits": (layout.n_frictions,),
            "impulses": (len(self.equations.impulses), layout.n_v),
        }  # fmt: skip
        ends = pairwise(accumulate(map(prod, shapes.values()), initial=0))
        return {name: (slice(*pair), shape) for (name, shape), pair in zip(shapes.items(), ends, strict=True)}

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of the output of each common program."""
        layout = self.layout
        n, rows = layout.n, layout.n_rows
        return {
            "accelerations": self.accelerations.size,
            "guards": 4 * layout.n_contacts
            + (3 if self.equations.machines else 2) * len(self.equations.guards)
            + 3 * layout.n_frictions,
            "scales": n + 2 * rows,
            "compose": layout.n_q,
            "increment_rates": layout.n_v,
            "free_rates": 2 * layout.n_v + 2,
            "chart_end": 3 * layout.n_v,
            "chart_motion": 2 * layout.n_v,
        }


def _places(numbers: Sequence[int]) -> Any:
    return np.array(numbers, dtype=np.int64)


def _numbers(order: Sequence[int] | None) -> Any:
    """An order of elimination as the kernel reads it."""
    return None if order is None else np.array(order, dtype=np.int64)


def rate_names(equations: Equations) -> dict[str, int]:
    """Every spelling of a velocity: 'left hip.angle.rate' and, for a joint of one coordinate, 'left hip.rate'."""
    names = {name: k for k, name in enumerate(equations.velocity_names)}
    owners: dict[str, list[int]] = {}
    for name, k in list(names.items()):
        base = name.removesuffix(".rate")
        names.setdefault(base, k)
        owners.setdefault(base.rpartition(".")[0], []).append(k)
    for owner, places in owners.items():
        if owner and len(places) == 1:
            names.setdefault(f"{owner}.rate", places[0])
    return names
