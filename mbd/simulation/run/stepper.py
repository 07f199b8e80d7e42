"""The kernel's arrays for one run, and the call into the kernel, compiled or interpreted."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.dependence import MIN_COEFFICIENT
from mbd.compile.mechanism import AccelerationTerms, Mechanism
from mbd.compile.orders import MIN_UNKNOWNS
from mbd.equations.clusters import clusters
from mbd.equations.equations import Equations
from mbd.equations.programs import ActiveSet, follows_multipliers
from mbd.errors import MemoryLimitError, ModelError
from mbd.integrators.base import Integrator
from mbd.integrators.stepping import fill_coefficients, memory_lengths, own_scheme, set_numbers
from mbd.kernel import codes
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.contact.contact_log import room_to_log
from mbd.kernel.records import PROGRAMS, TABLE, Kernel
from mbd.kernel.schemes.contract import NO_SCHEME
from mbd.kernel.translation.interpreted import InterpretedScheme
from mbd.results.driving import driving_rows
from mbd.simulation.run.call_table import CallTable
from mbd.simulation.run.plain import MechanismSystem, PlainScheme, loads_act, row_units, unit_blocks
from mbd.simulation.run.shelves import Shelves, plan_of
from mbd.tape.derivatives import live

EVENT_CAPACITY = 512
"""Events that the kernel may log before it hands them over, at least."""
MAX_IDLE_SIZE = 1 << 22
"""Numbers in arrays of a mechanism up to which they are kept for its next run, 32 MB."""
LAWS = ("newton", "poisson", "sequential")
"""Impact laws in the order of their numbers in the kernel."""


def is_compiled(mechanism: Mechanism, integrator: Integrator) -> bool:
    """Whether the compiled kernel can run this scheme: machine code exists and it is one of the kernel's own."""
    return own_scheme(integrator) is not NO_SCHEME and mechanism.accelerations.address != 0


def may_be_free(equations: Equations) -> bool:
    """Whether there may be steps in which no row acts: all of them belong to contacts, or to friction in joints."""
    return all(row.contact >= 0 or row.friction >= 0 for row in equations.rows)


def follows(equations: Equations) -> int:
    """How frictions follow multipliers: 0 linearly, 1 as that of a pin does, 2 those of contacts that may pull."""
    limits = [friction.limit for friction in equations.frictions if friction.contact < 0]
    bent = any(node.op == "input" and node.data[0] == "lam" for node in live(limits))
    if bent or follows_multipliers(equations) > 1:
        return 1
    rubbing = [equations.contacts[friction.contact] for friction in equations.frictions if friction.contact >= 0]
    rubbing += [contact for contact in equations.contacts if contact.drags and contact.rows]
    return 2 if any(contact.opens_on == "when" for contact in rubbing) else 0


class InitialArrays:
    """The record and the arrays of a stepper before a run, of which only numbers other than 0 are kept."""

    def __init__(self, kernel: Kernel, rooms: list[Any]) -> None:
        if sum(map(len, rooms)) <= MAX_IDLE_SIZE:
            self._values = dict(vars(kernel))
            self._places = [np.flatnonzero(room) for room in rooms]
            self._numbers = [room[places] for room, places in zip(rooms, self._places, strict=True)]

    def keep(self, rooms: list[Any], shelf: int, places: Iterable[slice], arrays: Mapping[str, Any]) -> None:
        """From now on some of the numbers as they are, and arrays in the place of others."""
        self._values |= arrays
        numbers = np.zeros_like(rooms[shelf])
        numbers[self._places[shelf]] = self._numbers[shelf]
        for place in places:
            numbers[place] = rooms[shelf][place]
        self._places[shelf] = np.flatnonzero(numbers)
        self._numbers[shelf] = numbers[self._places[shelf]]

    def let_go(self, kernel: Kernel, renewed: Iterable[str] = ()) -> None:
        """Put the record back, without whatever arrays a run has put into it, some of those with names in `renewed`."""
        values = vars(kernel)
        kernel.renewed.update(name for name in renewed if values[name] is not self._values[name])
        values.clear()
        values.update(self._values)

    def restore(self, rooms: list[Any]) -> None:
        """Put the numbers back."""
        for room, places, numbers in zip(rooms, self._places, self._numbers, strict=True):
            room[:] = 0
            room[places] = numbers


class Stepper:
    """One run's numbers: everything the kernel reads and writes.

    The accepted state, its guards and the stored rows live in flat arrays; `advance` calls the
    kernel, which returns when something needs Python: a full store, a new mode, an event, a failure.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        manager: ActiveSetManager,
        integrator: Integrator,
        parameters: Vector,
        dt: float,
        options: dict[str, Any],
    ) -> None:
        self.mechanism, self.manager, self.integrator = mechanism, manager, integrator
        self.key: Any = None  # of runs that may have it after this one
        self.words: dict[tuple[str, ...], tuple[str, ...]] = {}  # of memories, by what was asked (`run.memory`)
        self.compiled = is_compiled(mechanism, integrator)
        self.straight = self.compiled  # with straight-line code for factors, which machine code alone is worth
        self.judges_starts = self.compiled
        self.own = own_scheme(integrator)
        self.stabilized, self._is_high_order = integrator.stabilized, integrator.order() > 2
        layout = mechanism.layout
        self.kernel = self._sizes(dt, options)
        judged = layout.n_frictions > 0 or any(
            contact.kind != "penalty" and contact.opens_on == "pull" for contact in manager.contacts
        )
        if self.stabilized and judged and driving_rows(mechanism.equations):
            self.kernel.driven = 1
        self._arrays(parameters, manager)
        self.kernel.chunk, self.kernel.end = 1, float(options.get("end", 0.0))
        self.system = MechanismSystem(
            mechanism, manager, self.kernel.params, self.kernel.anchors, self.stabilized, self.kernel.dropped,
            self.kernel.sticks, self.kernel.slip, self.kernel.hold, self.kernel.blurs,
        )  # fmt: skip
        interpreted = self.own is not NO_SCHEME
        self.scheme: Any = InterpretedScheme(self.own) if interpreted else PlainScheme(integrator, self.system, manager)
        self.plain = self.scheme  # whose memory a final state takes along; that of `scheme` goes into savepoints
        self.functions: list[Any] = [mechanism.accelerations, mechanism.common["guards"], mechanism.common["scales"]]
        self.functions.append(None if mechanism.vector else mechanism.common["compose"])
        self.functions.append(mechanism.common["terms"] if mechanism.judged else None)
        for name in ("increment_rates", "chart_end", "chart_motion"):
            self.functions.append(None if mechanism.vector else mechanism.common[name])
        without_rows = self.own.abilities.explicit == 1 and may_be_free(mechanism.equations)
        self.functions.append(mechanism.free_rates() if without_rows else None)
        self.kernel.treelike = int(self.functions[-1] is not None)
        self.kernel.code = self.functions
        self.modes: list[Any] = []  # in the order in which their code was made
        self._n_of_modes = 0  # functions of these
        self._kept = 0, 0  # modes that runs begin with, and functions of these
        self.dependent: dict[int, tuple[int, ...]] = {}
        self._table: CallTable | None = None
        self._provisional = False  # whether addresses in the table may have changed
        self.resumed_at = float("nan")  # the instant whose row was stored as a run was taken up again
        self._fresh = InitialArrays(self.kernel, self.shelves.rooms) if self.compiled else None
        assert layout.n == self.kernel.n

    @property
    def max_idle(self) -> int:
        """How many steppers of this size are kept for other runs; 0 where arrays cannot be made as they were."""
        return 0 if self._fresh is None else min(8, MAX_IDLE_SIZE // self.size)

    @property
    def size(self) -> int:
        """How many numbers its arrays have."""
        return sum(map(len, self.shelves.rooms))

    def let_go(self) -> None:
        """Keep no arrays but those of its own, and what modes are known, while nobody runs."""
        assert self._fresh is not None
        self._keep_modes(self._fresh)
        self._fresh.let_go(self.kernel, () if self._table is None else self._table.renewed)

    def _keep_modes(self, fresh: InitialArrays) -> None:
        """Let the next run know the modes of this one, where nothing of them belongs to this run alone."""
        v, own, known = self.kernel, self.shelves.arrays, len(self.modes)
        alone = not (v.n_rows or v.n_contacts or v.n_frictions)  # the only one has the only order
        same = v.mode_code is own["mode_code"] and (v.orders is own["orders"] or alone)
        if known != self._kept[0] and known == v.n_known and same and not self.dependent:
            number = self.place_of("limits").start + TABLE.places["n_known"][1]
            places = [*map(self.place_of, ("mode_key", "mode_code", "mode_order")), slice(number, number + 1)]
            fresh.keep(self.shelves.rooms, 3, places, {"orders": v.orders})
            self._kept = known, self._n_of_modes

    def begin_again(self, parameters: Vector, end: float) -> None:
        """Make everything as it was before the run that is over, but for parameters and the end of the next one."""
        assert self._fresh is not None
        v = self.kernel
        self._fresh.restore(self.shelves.rooms)
        known, count = self._kept
        del self.functions[len(self.functions) - self._n_of_modes + count :]
        self._n_of_modes, self.modes, self.dependent = count, self.modes[:known], {}
        if len(parameters) == len(v.params):
            v.params[:] = parameters
        elif len(parameters):
            v.params = np.ascontiguousarray(parameters, dtype=float)
        self.system.parameters, v.end, self.resumed_at = v.params, end, float("nan")
        if self._table is not None:
            self._table.forget_code()
            self._provisional = self.provisional

    def _sizes(self, dt: float, options: dict[str, Any]) -> Kernel:
        layout = self.mechanism.layout
        self.clusters = self.mechanism.kept(clusters, lambda: clusters(self.mechanism.equations))
        n_contacts, n_guards = layout.n_contacts, len(self.manager.guards)
        K = Kernel(
            n_q=layout.n_q, n_v=layout.n_v, n=layout.n, n_rows=layout.n_rows, n_anchors=layout.n_anchors,
            n_contacts=n_contacts, n_guards=n_guards,
            n_frictions=layout.n_frictions, n_machines=len(self.manager.machines),
            n_impulses=len(self.manager.impulses),
            n_cones=len({f.group for f in self.manager.frictions if f.group}),
            loads_act=int(loads_act(self.mechanism.equations)),
            loaded=follows(self.mechanism.equations), impact_law=LAWS.index(options.get("impact", "newton")),
            strategy=int(options.get("contact") == "nonsmooth"), auto=int(options.get("auto", False)),
            vector=int(self.mechanism.vector), treelike=0,
            stabilized=int(self.stabilized), linear=int(options.get("locate") == "linear"),
            capacity=int(options["capacity"]), stride=int(options.get("store", 1)),
            rest_speed=float(options.get("rest_speed", 1e-6)), dt=dt,
            alpha_m=0.0, alpha_f=0.0, beta=0.25, gamma=0.5, tolerance=1e-9, jerk=1, exact=0,
            allowed=float(options.get("allowed", 0.0)),
            driven=int(options.get("driven", False)), longest=float(options.get("longest", np.inf)),
            error_order=self.integrator.error_order(), n_substeps=1,
            n_clusters=1 + max(self.clusters, default=0),
            **self.own.numbers(),
        )  # fmt: skip
        K.event_capacity = max(EVENT_CAPACITY, 2 * room_to_log(K))
        set_numbers(K, self.integrator)
        return K

    def _arrays(self, parameters: Vector, manager: ActiveSetManager) -> None:
        v = self.kernel
        block, tables = v.n_block, manager.tables()
        own = memory_lengths(v, self.own)
        given = own | {name: len(table) for name, table in tables.items()}
        given |= {"out": max(v.n_tangent, block), "acc": self.mechanism.sizes["accelerations"]}
        given["chart"] = 1 if v.vector else max(block, 2 * v.n_q + 2 * v.n_v)
        self.shelves = Shelves(plan_of(v, self._lengths(given)))
        self.reals, self.integers, *_ = self.shelves.rooms
        vars(v).update(self.shelves.arrays)
        for name, table in tables.items():
            getattr(v, name)[: len(table)] = table
        v.shift1 = v.block[self.mechanism.layout.shift :]  # read by model code as well
        v.params = np.ascontiguousarray(parameters, dtype=float) if len(parameters) else np.zeros(1)
        v.step = v.dt
        v.sinking[:] = np.inf
        v.was[:] = codes.NOT_KNOWN_YET
        fill_coefficients(v, self.own)
        v.unit = unit_blocks(self.mechanism).copy()
        v.cluster[: v.n + v.n_rows] = self.clusters
        for number, (_, turning) in enumerate(self.mechanism.turning, 1):
            v.turned_by[turning] = number
        v.row_unit = np.array([*row_units(self.mechanism), 2], dtype=np.int64)
        if not v.n_anchors:
            v.anchors = np.zeros(0)

    def _lengths(self, given: dict[str, int]) -> dict[str, int]:
        """Lengths of arrays that do not follow from the sizes of the kernel alone."""
        return given

    @cached_property
    def columns(self) -> dict[str, Any]:
        """Places in a row of the results by their letters; time stands alone."""
        v = self.kernel
        lengths = {
            "q": v.n_q, "v": v.n_v, "z": v.n - v.n_v, "a": v.n_v, "s": v.n - v.n_v, "lam": v.n_rows,
            "closed": v.n_contacts, "phase": None,
        }  # fmt: skip
        found, first = dict[str, Any](time=0), 1
        for name, length in lengths.items():
            found[name] = slice(first, None if length is None else first + length)
            first += length or 0
        return found

    def place_of(self, name: str) -> slice:
        """Where a kept array stands in `reals` or `integers`."""
        return self.shelves.place_of(name)

    def acting(self, flags: Any) -> list[int]:
        """Rows that act at the accepted state with these contacts closed, without those that depend on others."""
        return [row for row in self.manager.active_rows(flags, self.kernel.sticks) if not self.kernel.dropped[row]]

    def terms(
        self, penalties: Sequence[int] = (), slips: Vector | None = None, lam: Vector | None = None
    ) -> AccelerationTerms:
        """M, f, R, B, h, ḣ, bias at the accepted state: see `Mechanism.acceleration_terms`."""
        v = self.kernel
        q, y, anchors = v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors]
        return self.mechanism.acceleration_terms(float(v.time), q, y, v.params, anchors, penalties, slips, lam)

    def add_mode(self) -> None:
        """Make code for the contacts closed now."""
        v = self.kernel
        flags, dropped = v.closed[: v.n_contacts], v.dropped[: v.n_rows]
        sticks, slip = v.sticks[: v.n_frictions], v.slip[: v.n_frictions]
        held = self.manager.active_rows(flags, sticks)
        rows = tuple(row for row in held if not dropped[row])
        sliding = tuple(f for f, sign in enumerate(slip.tolist()) if sign)
        given_rows = tuple(row for row in held if dropped[row]) if sliding or v.loads_act else ()
        make = self._maker()
        try:
            code = make(ActiveSet(rows, self.manager.penalties(flags), self.stabilized, sliding, given_rows))
        except ModelError as refused:
            if int(v.n_steps) == 0:
                raise
            raise MemoryLimitError(f"t = {float(v.time):.9g} s: {refused}") from refused  # what has run is kept
        count, width = int(v.n_known), v.n_contacts + v.n_rows + v.n_frictions
        phases = np.maximum(2 * (sticks == 1), slip != 0.0) if v.n_frictions else sticks
        if PROGRAMS * (count + 1) > len(v.mode_code):
            v.mode_key = np.concatenate([v.mode_key, np.zeros_like(v.mode_key)])
            v.mode_code = np.concatenate([v.mode_code, np.zeros_like(v.mode_code)])
            v.mode_order = np.concatenate([v.mode_order, np.zeros_like(v.mode_order)])
        v.mode_key[count * width : (count + 1) * width] = np.concatenate([flags, dropped, phases])
        offered = [code.tangent, code.residual, code.correction, code.solution]
        offered += [code.rates, code.returns] if self.straight else [None, None]
        known = [function for function in offered if function is not None]
        numbers = iter(range(len(self.functions), len(self.functions) + len(known)))
        v.mode_code[PROGRAMS * count : PROGRAMS * (count + 1)] = [
            0 if each is None else next(numbers) for each in offered
        ]
        if code.order is not None:
            v.mode_order[count] = len(v.orders)
            v.orders = np.concatenate([v.orders, code.order])
        self.functions += known
        self._n_of_modes += len(known)
        self.modes.append(code)
        dependence = v.dependence.reshape(v.n_rows, -1) if v.n_rows else v.dependence
        for row in range(v.n_rows):
            if dropped[row]:  # as they were found first
                self.dependent.setdefault(
                    row, tuple(int(k) for k in np.flatnonzero(np.abs(dependence[row]) > MIN_COEFFICIENT))
                )
        v.n_known = count + 1  # at last: an interrupt may come between any two lines

    def code_of(self, mode: int) -> Any:
        """The code of a mode by its number in the kernel."""
        residual = self.functions[self.kernel.mode_code[PROGRAMS * mode + 1]]
        return next(code for code in self.modes if code.residual is residual)

    def _maker(self) -> Any:
        """What makes the code of a mode, no more of it than the scheme calls."""
        plain = self.own.programs == "stepping" and not self.straight
        return getattr(self.mechanism, "mode" if plain else self.own.programs)

    @property
    def provisional(self) -> bool:
        """Whether some function is waiting for faster code; the kernel gets that between two of its calls."""
        return any(getattr(function, "provisional", False) for function in self.functions)

    def advance(self, until: float) -> int:
        """Run the kernel until it returns; its status."""
        self.kernel.until = until
        return self._called()

    def march_many(self, many: int = 1) -> int:
        """Take runs, or steps again, from their lines of starts to their ends until the kernel returns; its status."""
        self.kernel.many = many
        try:
            return self._called()
        finally:
            self.kernel.many = 0

    def judge_start(self) -> int:
        """Judge the start in the arrays, in compiled code: see `mbd.kernel.stepping.begin_run.judge_start`."""
        self.kernel.many = 2
        try:
            return self._advance_compiled()
        finally:
            self.kernel.many = 0

    def _called(self) -> int:
        v = self.kernel
        if v.n_kkt >= MIN_UNKNOWNS and v.n_modes == 0 and v.orders[0] == 0:
            order = self.mechanism.order(self.manager.active_rows(v.closed[: v.n_contacts]))
            v.orders = v.orders if order is None else np.concatenate([[1], order])
        if v.n_known == 0 and not (v.n_rows or v.n_contacts or v.n_frictions):
            self.add_mode()  # the only one there is, which the kernel need not ask for
        if v.auto:
            v.strategy = int(v.fallback > 0)
        # parts in which a step of a scheme of order 3 or more is looked at for guards
        v.n_substeps = 4 if self._is_high_order and not v.strategy else 1
        return self._advance_compiled() if self.compiled else self._advance_plain()

    def keep_row(self) -> None:
        """Store the accepted state, unless it is the last row anyway."""
        if self.kernel.steps_since_row > 0 and self.kernel.time != self.resumed_at:
            self.store_row()

    def store_row(self) -> None:
        """Store the accepted state as a row of the results."""
        from mbd.kernel.stepping.observe import store_row

        store_row(self.kernel)

    def hold(self) -> None:
        """Give the inputs of the forces the closed contacts, as a start of the scheme would leave them."""
        from mbd.kernel.stepping.restart import fill_block

        fill_block(self.kernel, self.kernel.time, self.kernel.q, self.kernel.y)

    def guard_round_off(self, e: int) -> float:
        """Round-off of a user's guard at the accepted state."""
        from mbd.kernel.events.guard_round_off import guard_round_off
        from mbd.kernel.stepping.restart import fill_block, refresh_scales

        K = self.kernel
        fill_block(K, K.time, K.q, K.y)
        refresh_scales(K)
        return guard_round_off(K, e, K.time, K.q, K.y)

    def _enter(self, address: int) -> int:
        """Call the compiled kernel with a table."""
        from mbd.kernel.entry import entry  # with llvmlite, which runs in Python do without

        return int(entry()(address))

    def _advance_plain(self) -> int:
        from mbd.kernel.stepping.advance import advance
        from mbd.kernel.stepping.many_runs import march_many

        self.kernel.hooks = self.scheme
        with np.errstate(all="ignore"):
            return int(march_many(self.kernel) if self.kernel.many else advance(self.kernel))

    def _advance_compiled(self) -> int:
        if self._table is None or self._provisional:
            self._provisional = self.provisional  # before the addresses: whoever settles in between is looked at again
            self._table = CallTable(self.functions, self.kernel, self.shelves.known)
        else:
            self._table.fill(self.functions, self.kernel)
        postponed = [tangent for tangent in self.mechanism.postponed if not tangent.made]
        status = self._enter(self._table.address)
        for tangent in postponed:
            if tangent.raised is not None:
                raised, tangent.raised = tangent.raised, None
                raise raised
            if tangent.made:
                self._table = None  # it has another address now
        return status
