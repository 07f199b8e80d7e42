"""Any integrator behind the interpreted kernel: a mechanism as a `System`, and the hooks that drive `step`."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector, read_only
from mbd.compile.mechanism import AccelerationTerms, Mechanism
from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.equations.equations import Equations, Row
from mbd.equations.programs import ActiveSet, follows_multipliers, mass_matrix
from mbd.errors import SimulationError
from mbd.integrators.base import Integrator, Point, StepReport, StepResult, System, Terms
from mbd.kernel.algebra.redundancy import JOINT_SHARE, MIN_LIMIT_SHARE
from mbd.kernel.codes import NOT_CONVERGED, NOT_FINITE, TOO_NEAR
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.memory import start_step
from mbd.kernel.stepping.restart import MAX_LOAD_ITERATIONS, fill_block, refresh_scales, take_consistent
from mbd.simulation.run.user_calls import call_user
from mbd.state import Mode, State
from mbd.tape.derivatives import live


def loads_act(equations: Equations) -> bool:
    """Whether forces follow multipliers: smooth friction of contacts by rows, and laws that read them."""
    return any(c.drags and c.rows for c in equations.contacts) or follows_multipliers(equations) > 0


class MechanismSystem(System):
    """A mechanism as the numbers an integrator sees; bound to parameters and to the anchors held now."""

    def __init__(
        self,
        mechanism: Mechanism,
        manager: ActiveSetManager,
        parameters: Vector,
        anchors: Vector,
        stabilized: bool,
        dropped: Any,
        sticks: Any,
        slip: Any,
        hold: Any = None,
        blurs: Any = (0.0,),
    ) -> None:
        self.mechanism, self.manager = mechanism, manager
        self.parameters, self.anchors, self.stabilized = parameters, anchors, stabilized
        self.dropped = dropped  # rows that depend on others, 1 each
        self.sticks, self.slip = sticks, slip[: mechanism.layout.n_frictions]  # of frictions
        self.hold = np.zeros(len(self.slip)) if hold is None else hold
        self.blurs = blurs  # part of the forces that is round-off
        self.grouped = np.array([bool(friction.group) for friction in manager.frictions], dtype=bool)
        places = [f - min(friction.group, default=f) for f, friction in enumerate(manager.frictions)]
        self.free = np.array([1.0 if place < 2 else 0.0 for place in places])  # as `kernel.contact.cones.fill_slips`
        self.loads_act = loads_act(mechanism.equations)
        self.evaluated: Vector | None = None  # the inputs evaluated last, to explain a failure with
        layout = mechanism.layout
        self.n_q, self.n_v, self.n_z = layout.n_q, layout.n_v, layout.n_z

    @property
    def slips(self) -> Any:
        """What programs know of sliding: signs, of groups how directions are held (`mbd.kernel.contact.cones`)."""
        if not self.grouped.any():
            return self.slip
        hold = self.hold[: len(self.slip)]
        held = np.where(hold > 0.0, hold * self.slip, self.free)
        return np.where(self.grouped & (self.slip != 0.0), held, self.slip)

    @property
    def is_vector(self) -> bool:
        """Whether q ⊕ x is q + x: of every joint whose coordinates add."""
        return self.mechanism.vector

    @property
    def constant_mass(self) -> bool:  # type: ignore[override]
        """Whether neither posture nor time enters the mass matrix."""
        equations = self.mechanism.equations
        with equations.tape.lock:
            inside = live([entry for column in mass_matrix(equations) for entry in column])
        return not any(node.op == "input" and node.data[0] in ("t", "q", "x") for node in inside)

    @property
    def angles(self) -> Any:
        """Which velocities turn, (n_v,) booleans."""
        return unit_blocks(self.mechanism)[: self.n_v] == 1

    def active(self, mode: Mode) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Rows that act and penalty contacts that push in a mode."""
        flags = self.manager.flags(mode.closed)
        rows = tuple(row for row in self.manager.active_rows(flags, self.sticks) if not self.dropped[row])
        return rows, self.manager.penalties(flags)

    def _acting(self, rows: tuple[int, ...], penalties: tuple[int, ...], given_rows: tuple[int, ...]) -> ActiveSet:
        sliding = tuple(int(f) for f in np.flatnonzero(self.slip))
        return ActiveSet(rows, penalties, self.stabilized, sliding, given_rows)

    def _given_rows(self, mode: Mode) -> tuple[int, ...]:
        """Rows that act and depend on others, where how loads are shared moves the mechanism: a friction slides."""
        if not (self.slip.any() or self.loads_act) or not any(self.dropped):
            return ()
        held = self.manager.active_rows(self.manager.flags(mode.closed), self.sticks)
        return tuple(row for row in held if self.dropped[row])

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        """Terms of `Terms` at a point of the mechanism."""
        rows, penalties = self.active(mode)
        given_rows = self._given_rows(mode)
        active = self._acting(rows, penalties, given_rows)
        code = self.mechanism.mode(active)
        n, m = self.mechanism.layout.n, len(rows)
        block = self.evaluated = self._block(point, rows, penalties)
        brought = self._share_loads(block, rows, given_rows) if given_rows else 0.0
        scale = np.zeros(n + 2 * self.mechanism.layout.n_rows)
        self.mechanism.common["scales"](block, self.parameters, scale)
        picked = list(rows)
        r_size, h_size, rate_size = np.split(scale, [n, n + self.mechanism.layout.n_rows])
        size, speed = _by_coordinate(point, self.mechanism)
        h_size, rate_size = np.maximum(h_size, size), np.maximum(rate_size, speed)
        tail, full = active.tail(n), active.size(n, self.n_v)
        turning = None
        if tangent is None:
            out = np.zeros(tail)
            code.residual(block, self.parameters, out)
            matrix = None
        else:
            factors = tangent if tangent[0] != 0.0 else (1.0, tangent[1])
            block[1:3] = factors
            out = np.zeros(full)
            code.tangent(block, self.parameters, out)
            if self.stabilized:
                turning = out[(n + m) ** 2 + tail :].reshape(m, self.n_v)
            matrix, out = out[: (n + m) ** 2].reshape(n + m, n + m), out[(n + m) ** 2 : (n + m) ** 2 + tail]
            if tangent != factors:  # S is affine in c_C, and B + (c_K/c_C) ∂ḣ/∂x in its inverse: without these parts
                other = np.zeros(full)
                block[1:3] = (2.0, tangent[1])
                code.tangent(block, self.parameters, other)
                double = other[: (n + m) ** 2].reshape(n + m, n + m)
                matrix = np.vstack([(2.0 * matrix - double)[:n], (2.0 * double - matrix)[n:]])
        velocity = np.array([self.mechanism.equations.rows[row].is_velocity for row in rows], dtype=bool)
        h, rate = out[n : n + m], out[n + m :]
        if not self.stabilized:  # index 3 has the rate of a row on velocities in the place of h
            h, rate = np.where(velocity, 0.0, h), np.where(velocity, h, 0.0)
        return Terms(
            out[:n],
            None if matrix is None else matrix[:n, :n],
            h,
            rate,
            None if matrix is None else matrix[:n, n:] + brought,
            None if matrix is None else matrix[n:, :n],
            _by_unit(r_size, self.mechanism),
            h_size[picked],
            rate_size[picked],
            velocity if velocity.any() else None,
            turning if turning is None else np.where(velocity[:, None], 0.0, turning),
            bool(given_rows),
            float(self.blurs[0]),
        )

    def _block(self, point: Point, rows: Sequence[int], penalties: Sequence[int]) -> Vector:
        layout = self.mechanism.layout
        block = self.mechanism.block(point.t, point.q, point.y, self.anchors, penalties)
        block[layout.x : layout.v] = point.x
        block[layout.a : layout.lam] = point.rate
        block[[layout.lam + k for k in rows]] = point.lam
        block[layout.slip : layout.shift] = self.slips
        return block

    def _share_loads(self, block: Vector, rows: tuple[int, ...], given_rows: tuple[int, ...]) -> Matrix:
        """Multipliers of the rows `given_rows` into the block; (n, m) what those of `rows` bring along through them."""
        lam, kept, dependent = self.mechanism.layout.lam, list(rows), list(given_rows)
        places = [lam + k for k in dependent]
        for _ in range(
            MAX_LOAD_ITERATIONS
        ):  # frictions that hold together share by their limits, which follow the loads
            terms = self.mechanism.terms_of(block, self.parameters)
            part = shares(self.mechanism.equations.rows, terms, kept, dependent)
            before, block[places] = block[places], part @ block[[lam + k for k in kept]]
            if np.max(np.abs(block[places] - before)) <= 1e-14 * np.max(np.abs(block[places])):
                break
        return np.asarray(terms.R[:, dependent] @ part)

    def accelerations(self, t: float, q: Vector, y: Vector, mode: Mode) -> tuple[Vector, Vector]:
        """Consistent (v̇, ż) and λ of the active rows."""
        rows, penalties = self.active(mode)
        n, m, picked, given_rows = self.mechanism.layout.n, len(rows), list(rows), list(self._given_rows(mode))
        lam = np.zeros(self.mechanism.layout.n_rows)
        for _ in range(
            MAX_LOAD_ITERATIONS
        ):  # friction follows multipliers: of degree one, so that this is Newton's method
            terms = self.mechanism.acceleration_terms(
                t, q, y, self.parameters, self.anchors, penalties, slips=self.slips, lam=lam
            )
            R = terms.R[:, picked]
            if given_rows:
                part = shares(self.mechanism.equations.rows, terms, picked, given_rows)
                R = R + terms.R[:, given_rows] @ part
            matrix = np.block([[terms.M, R], [terms.B[picked], np.zeros((m, m))]])
            solved = np.linalg.solve(matrix, -np.concatenate([terms.f, terms.bias[picked]]))
            change = np.max(np.abs(lam[picked] - solved[n:]), initial=0.0)
            lam[picked] = solved[n:]
            if given_rows:
                lam[given_rows] = part @ solved[n:]
            if not self.slip.any() or change <= 1e-13 * np.max(np.abs(lam)):
                break
        if not self.slip.any() and not any(self.dropped) and _least_pivot(terms.M) < DIRECT_PIVOT_RTOL:
            block = self._block(Point(t, q, np.zeros(self.n_v), y, solved[:n], solved[n:]), rows, penalties)
            active = self._acting(rows, penalties, ())
            out = np.zeros(active.tail(n))
            self.mechanism.mode(active).residual(block, self.parameters, out)
            off = np.concatenate([out[:n], terms.B[picked] @ solved[:n] + terms.bias[picked]])
            solved = solved - np.linalg.solve(matrix, off)
        return solved[:n], solved[n:]

    def compose(self, q: Vector, x: Vector) -> Vector:
        """q ⊕ x."""
        return self.mechanism.equations.configuration.compose(q, x)

    def increment_rates(self, x: Vector, v: Vector) -> Vector:
        """ẋ = D(x)⁻¹ v."""
        return self.mechanism.equations.configuration.increment_rates(x, v)


def _least_pivot(M: Matrix) -> float:
    """Least pivot of the mass matrix over its largest diagonal entry; of its diagonal alone where it is singular."""
    diagonal = np.diag(M)
    try:
        pivots = np.diag(np.linalg.cholesky(M)) ** 2
    except np.linalg.LinAlgError:
        pivots = diagonal[diagonal > 0.0]
    return float(np.min(pivots, initial=np.inf) / np.max(diagonal, initial=np.finfo(float).tiny))


def _by_unit(scale: Vector, mechanism: Mechanism) -> Vector:
    """Forces and torques as blocks of their own, as the kernel judges them."""
    units = unit_blocks(mechanism)
    result = np.maximum(scale, 1e-300)
    return np.where(units < 2, _largest(result, units, 0.0)[units], result)


def _by_coordinate(point: Point, mechanism: Mechanism) -> tuple[Vector, Vector]:
    """Size of the coordinates and speeds of each row's unit, whose round-off the row inherits."""
    units, n_v = unit_blocks(mechanism), mechanism.layout.n_v
    q, v = np.abs(point.q), np.abs(point.y[:n_v])
    if mechanism.vector:
        size = _largest(q, units[:n_v], 1e-3)
    else:  # a coordinate has no unit of its own
        size = np.full(3, np.max(q, initial=1e-3))
    rows = row_units(mechanism)
    return size[rows], _largest(v, units[:n_v], 1e-3)[rows]


def _largest(values: Vector, units: Any, least: float) -> Vector:
    """The largest value of each unit, (3,)."""
    sizes = np.full(3, least)
    np.maximum.at(sizes, units, values)
    return sizes


def row_units(mechanism: Mechanism) -> Any:
    """0 [m], 1 [rad], 2 other, of each row."""
    return _units(tuple(row.unit for row in mechanism.equations.rows))


def unit_blocks(mechanism: Mechanism) -> Any:
    """0 for balance components that are forces, 1 for torques, 2 for others, each judged alone."""
    equations = mechanism.equations
    return _units((*(unit for _, unit in equations.configuration.freedoms), *[""] * equations.n_z))


@lru_cache(maxsize=256)
def _units(names: tuple[str, ...]) -> Any:
    """0 [m], 1 [rad], 2 other."""
    return read_only(np.array([{"m": 0, "rad": 1}.get(name, 2) for name in names], dtype=np.int64))


class PlainScheme:
    """Hooks of the interpreted kernel: an integrator's `start` and `step` on the kernel's arrays."""

    def __init__(self, integrator: Integrator, system: MechanismSystem, manager: ActiveSetManager) -> None:
        self.integrator, self.system, self.manager = integrator, system, manager
        self.memory: Any = None
        self.pending: Any = None
        self.report = StepReport(True)

    def _state(self, K: Kernel) -> tuple[State, Mode, list[int]]:
        flags = K.closed[: K.n_contacts]
        mode = self.manager.mode(flags)
        n_v = K.n_v
        state = State(float(K.time), K.q.copy(), K.y[:n_v].copy(), K.y[n_v:].copy(), mode)
        return state, mode, [row for row in self.manager.active_rows(flags, K.sticks) if not K.dropped[row]]

    def start(self, K: Kernel) -> int:
        """Memory at the accepted state, whose rates are consistent; sizes of the residual for the guards."""
        state, mode, _ = self._state(K)
        what = f"the start of {self.integrator!r} at t = {state.time:.6g} s"
        return self._begin(K, call_user(what, self.integrator.start, self.system, state, mode, start_step(K)))

    def resume(self, K: Kernel, h: float) -> int:
        """After a step that told `LEFT`, which only schemes of the kernel do: their next step resumes by itself."""
        take_consistent(K)
        return self._begin(K, self.memory)

    def _begin(self, K: Kernel, memory: Any) -> int:
        self.memory = memory
        K.near_singular = 0
        K.slope[:] = getattr(memory, "slope", 0.0)
        fill_block(K, K.time, K.q, K.y)
        refresh_scales(K)
        return 0

    def step(self, K: Kernel, h: float, t1: float) -> int:
        """A candidate from the integrator's own step."""
        state, mode, rows = self._state(K)
        what = f"a step of {self.integrator!r} from t = {state.time:.6g} s"
        result = call_user(what, self.integrator.step, self.system, state, t1 - state.time, mode, self.memory)
        if not isinstance(result, StepResult):
            raise SimulationError(f"{what} must return a StepResult(state, memory, report), not {result!r}")
        self.report = result.report
        K.n_iterations += result.report.iterations
        if not result.report.converged:
            K.failure_time, K.failure_size, K.failure_step = t1, result.report.residual, h
            if self.system.evaluated is not None:
                K.block[:] = self.system.evaluated
            if result.report.too_near:
                return TOO_NEAR
            return NOT_CONVERGED if np.isfinite(result.report.residual) else NOT_FINITE
        y = np.concatenate([result.state.v, result.state.z])
        if not (np.isfinite(y).all() and np.isfinite(result.state.q).all()):
            K.failure_time = t1
            return NOT_FINITE
        self.pending = result.memory
        K.near_singular = getattr(result.memory, "near", 0)
        K.n_singular_steps += int(K.near_singular > 0)
        rate, lam = getattr(result.memory, "rate", None), getattr(result.memory, "lam", None)
        if rate is None or lam is None:
            rate, lam = self.system.accelerations(t1, result.state.q, y, mode)
        K.q1[:], K.y1[:], K.rate1[:], K.aux1[:] = result.state.q, y, rate, rate
        K.lam1[:] = 0.0
        K.lam1[rows] = lam
        fill_block(K, t1, K.q1, K.y1)
        K.block[K.o_a : K.o_a + K.n] = rate
        K.block[K.o_lam : K.o_lam + K.n_rows] = K.lam1[: K.n_rows]
        return 0

    def error(self, K: Kernel, h: float) -> None:
        """The integrator's estimate of the local error of the candidate."""
        estimate = self.integrator.local_error(self.memory, self.pending, h)
        if estimate is not None:
            K.error[:] = estimate

    def accept(self, K: Kernel, h: float) -> None:
        """The candidate becomes the accepted state, its memory the memory."""
        self.memory = self.pending
        K.slope[:] = (K.rate1 - K.rate) / h
        K.lam_slope[:] = (K.lam1 - K.lam) / h
        K.q[:], K.y[:], K.rate[:], K.aux[:], K.lam[:] = K.q1, K.y1, K.rate1, K.aux1, K.lam1


def shares(rows: Sequence[Row], terms: AccelerationTerms, kept: Sequence[int], dependent: Sequence[int]) -> Matrix:
    """S (d, k) of ``λ_d = S λ_kept``, the multipliers of least norm: ``S = W_d C W_kept⁻¹`` with ``B_d = C B_kept``.

    W is that of `mbd.kernel.algebra.redundancy.share`: of joints far above 1, of contacts 1, or the limit of the
    friction that holds a row over the largest of all.

    Parameters
    ----------
    rows : all rows of the equations
    terms : B and the limits of the frictions at the present multipliers
    kept, dependent : numbers of the rows that are solved with and of those that depend on them
    """
    weights = np.array([_weight(row, terms.limits) for row in rows])
    dependence = np.linalg.lstsq(terms.B[list(kept)].T, terms.B[list(dependent)].T)[0].T
    return np.asarray(weights[list(dependent)][:, None] * dependence / weights[list(kept)])


def _weight(row: Row, limits: Vector) -> float:
    largest = float(np.max(limits, initial=0.0))
    if row.friction < 0 and row.contact < 0:
        return JOINT_SHARE
    if row.friction < 0 or largest == 0.0:
        return 1.0
    return float(max(limits[row.friction] / largest, MIN_LIMIT_SHARE))
