"""Steps of the kernel's schemes on any `System`: the functions that machine code is made of, interpreted.

A step copies what the scheme carries into a record of the kernel, in which the system's `evaluate` stands for the
programs of a model, calls the scheme, and copies the outcome back.
"""

from collections.abc import Mapping
from dataclasses import field, replace
from functools import lru_cache
from itertools import accumulate
from typing import Any, ClassVar, Protocol

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, nearest
from mbd.integrators.system import Point, StepReport, StepResult, System, Terms
from mbd.kernel import codes
from mbd.kernel.records import TABLE, Kernel
from mbd.kernel.schemes.contract import MEMORY, NO_SCHEME, Scheme, scheme_named
from mbd.kernel.stepping.restart import consistent
from mbd.kernel.translation.interpreted import InterpretedScheme
from mbd.state import Mode, State

CARRIED = ("aux", "slope", "lam_slope", "shift", "shift_change", "past_stages")
"""Arrays from which a scheme makes its next step."""
JUDGING = ("scale", "weight", "left", "clock", "detail", "state")
"""Arrays that only decide when an iteration has ended, or how near a singular configuration is."""
REASONS = {
    codes.NOT_FINITE: "a force or a row is not finite",
    codes.NOT_CONVERGED: "Newton did not converge",
    codes.STAGNATED: "Newton stalled",
    codes.TOO_TIGHT: "round-off is larger than the tolerance",
    codes.SINGULAR: "the Newton matrix is singular",
    codes.TOO_NEAR: "a singular configuration is too close",
}
"""Why a step failed, by the status of the kernel."""


NOTHING: dict[str, Any] = dict.fromkeys((*TABLE.integers, *TABLE.reals), 0) | {
    "beta": 0.25, "gamma": 0.5, "tolerance": 1e-9, "jerk": 1, "rest_speed": 1e-6,
    "longest": np.inf, "n_substeps": 1, "capacity": 1, "width": 1, "event_capacity": 1, "event_width": 1,
}  # fmt: skip
"""Numbers of a record without contacts, guards and results."""


def own_scheme(integrator: Any) -> Scheme:
    """The kernel's scheme that takes this integrator's steps; `NO_SCHEME` if it is written in Python only."""
    return scheme_named(integrator.compiled_scheme or "")


def set_numbers(K: Kernel, integrator: Any) -> None:
    """The parameters of an integrator, under the names of the kernel's fields."""
    for name, number in integrator.numbers().items():
        if name not in TABLE.kinds:
            text = nearest(name, TABLE.kinds, "number of the kernel", "There are")
            raise CapabilityError(f"{integrator!r} gives numbers() for {name!r}: {text}")
        setattr(K, name, number)


def memory_lengths(K: Kernel, scheme: Scheme) -> dict[str, int]:
    """Lengths of the arrays that a scheme asks for."""
    own = scheme.memory(K)
    unknown = [name for name in own if name not in MEMORY]
    if unknown:
        raise CapabilityError(
            f"the scheme {scheme.name!r} asks for memory {unknown[0]!r}; the kernel has {', '.join(MEMORY)}"
        )
    return own


def fill_coefficients(K: Kernel, scheme: Scheme) -> None:
    """The coefficients and nodes of a scheme into the arrays that it asked for."""
    for name, numbers in (*scheme.coefficients().items(), ("nodes", scheme.nodes)):
        if len(numbers) > len(getattr(K, name)):
            raise CapabilityError(
                f"the scheme {scheme.name!r} has {len(numbers)} coefficients for {name!r}, to which its memory "
                f"gives a length of {len(getattr(K, name))}; try {len(numbers)} or more"
            )
        getattr(K, name)[: len(numbers)] = numbers


@dataclass(frozen=True)
class SchemeMemory:
    """What a scheme of the kernel carries from step to step.

    rate, lam : (n,) accelerations and rates of first-order states, (m,) multipliers, at the state
    aux, slope, lam_slope, shift, shift_change, past_stages : as in `mbd.kernel.records.state`
    step, whole : sizes of the last step and of the step that the start was made for [s]
    near : 1 within a few steps of a singular configuration, 2 just beyond it
    error : (n_v + n,) estimated local error of positions x, then of (v, z), of the last step
    levels : (m,) 1 for rows on velocities
    judged : arrays that only decide when an iteration has ended
    """

    rate: Vector
    lam: Vector
    aux: Vector
    slope: Vector
    lam_slope: Vector
    shift: Vector
    shift_change: Vector
    past_stages: Vector
    step: float
    whole: float
    near: int
    levels: tuple[int, ...]
    error: Vector
    judged: Mapping[str, Any] = field(default_factory=dict, metadata={"carried": False})


class Scheming(Protocol):
    """What is asked of an integrator that names a scheme of the kernel."""

    scheme: ClassVar[str | None]
    stabilized: bool

    def numbers(self) -> dict[str, float]:
        """Its parameters by the names that the kernel has for them."""


def start_of(integrator: Scheming, system: System, state: State, mode: Mode, dt: float) -> SchemeMemory:
    """Memory of the scheme that an integrator names at a consistent state, for steps of dt."""
    record = _Record(integrator, system, mode, state, dt)
    rate, lam = system.accelerations(state.time, state.q, np.concatenate([state.v, state.z]), mode)
    record.lay_out(lam, None)
    record.place(state, rate, lam)
    with np.errstate(all="ignore"):
        record.hooks.start(record.K)
    return record.memory()


def step_of(
    integrator: Scheming, system: System, state: State, dt: float, mode: Mode, memory: SchemeMemory
) -> StepResult:
    """One step of that scheme."""
    record = _Record(integrator, system, mode, state, memory.whole)
    record.lay_out(memory.lam, memory.levels)
    record.recall(memory)
    record.place(state, memory.rate, memory.lam)
    return record.step(state, dt, memory)


@lru_cache(maxsize=64)
def _rooms(
    n_q: int, n_v: int, n: int, m: int, vector: int, nodes: int, own: tuple[tuple[str, int], ...]
) -> dict[Any, tuple[int, dict[str, slice]]]:
    """Of the reals and the integers of a record: how many, and where each array stands among them."""
    K = Kernel()
    vars(K).update(NOTHING, n_q=n_q, n_v=n_v, n=n, n_rows=m, vector=vector, n_nodes=nodes)
    given = {"out": K.n_tangent + K.n_block, "acc": K.acc_limit + 1, "params": 1, "blurs": 1, "unit": n}
    given |= {"chart": 2 * n_q + 2 * n_v, "row_contact": m, "row_trivial": m, "row_level": m}
    given |= {"row_friction": m, "row_unit": m + 1, **dict(own)}
    found = {}
    asked = TABLE.lengths(K, given)
    for kind, names in (np.float64, TABLE.real_arrays), (np.int64, TABLE.integer_arrays):
        lengths = [asked.get(name, 0) for name in names]
        ends = [*accumulate(max(length, 1) for length in lengths)]
        begins = [0, *ends[:-1]]
        places = {name: slice(o, o + k) for name, o, k in zip(names, begins, lengths, strict=True)}
        found[kind] = ends[-1], places
    return found


class _Record:
    """A record of the kernel about a system, in the place of that about a mechanism."""

    def __init__(self, integrator: Scheming, system: System, mode: Mode, state: State, dt: float) -> None:
        self.integrator, self.system, self.mode, self.whole = integrator, system, mode, dt
        self.scheme = scheme_named(integrator.scheme or "")
        if self.scheme is NO_SCHEME:
            raise CapabilityError(f"{integrator!r} names no scheme; give its class scheme = '…', or a step of its own")
        self.hooks = InterpretedScheme(self.scheme)
        self.n_q, self.n_v, self.n_z = len(state.q), len(state.v), len(state.z)
        self.n = self.n_v + self.n_z

    def lay_out(self, lam: Vector, levels: tuple[int, ...] | None) -> None:
        """Make room for n rates and m rows; without `levels` the system is asked which rows hold velocities."""
        n_q, n_v, n, m = self.n_q, self.n_v, self.n, len(lam)
        vector = int(self.system.is_vector)
        K = self.K = Kernel()
        vars(K).update(NOTHING)
        vars(K).update(
            n_q=n_q, n_v=n_v, n=n, n_rows=m, vector=vector, stabilized=int(self.integrator.stabilized),
            dt=self.whole, **self.scheme.numbers(),
        )  # fmt: skip
        set_numbers(K, self.integrator)
        own = memory_lengths(K, self.scheme)
        for kind, (whole, places) in _rooms(n_q, n_v, n, m, vector, K.n_nodes, tuple(own.items())).items():
            room = np.zeros(whole, dtype=kind)
            vars(K).update({name: room[place] for name, place in places.items()})
        K.shift1 = K.block[K.n_block - n_v :]
        fill_coefficients(K, self.scheme)
        K.row_contact[:] = K.row_friction[:] = -1
        K.unit[:], K.row_unit[:] = 2, 2
        if self.system.angles is not None:
            K.unit[:n_v] = np.asarray(self.system.angles, dtype=bool)
        K.step = K.aux_step = self.whole
        K.n_active = m
        K.rows[:] = np.arange(m)
        self.levels = levels
        programs = (
            self._accelerations, None, self._scales, self._compose, None, self._increment_rates, self._chart_end, None,
            None, self._tangent, self._residual,
        )  # fmt: skip
        K.code = programs
        K.mode_code[:2] = len(programs) - 2, len(programs) - 1

    def place(self, state: State, rate: Vector, lam: Vector) -> None:
        """The accepted state into the record."""
        K = self.K
        K.time, K.q[:], K.y[:], K.rate[:], K.lam[:] = state.time, state.q, [*state.v, *state.z], rate, lam
        if self.levels is None:
            held = self._at(Point(state.time, state.q, np.zeros(self.n_v), K.y, rate, lam)).velocity
            self.levels = tuple(int(each) for each in held) if held is not None else (0,) * len(lam)
        K.row_level[:] = self.levels
        self.velocity = K.row_level == 1

    def recall(self, memory: SchemeMemory) -> None:
        """What the scheme carries into the record."""
        K = self.K
        for name, values in memory.judged.items():
            getattr(K, name)[:] = values
        for name in CARRIED:
            getattr(K, name)[:] = getattr(memory, name)
        K.aux_step, K.near_singular = memory.step, memory.near

    def memory(self) -> SchemeMemory:
        """What the scheme carries, out of the record."""
        K = self.K
        assert self.levels is not None
        return SchemeMemory(
            K.rate.copy(), K.lam.copy(), **{name: getattr(K, name).copy() for name in CARRIED}, step=float(K.aux_step),
            whole=self.whole, near=int(K.near_singular), levels=self.levels, error=K.error.copy(),
            judged={name: getattr(K, name).copy() for name in JUDGING},
        )  # fmt: skip

    def step(self, state: State, dt: float, memory: SchemeMemory) -> StepResult:
        """The scheme's step of dt, accepted and copied out if it has a candidate."""
        K, status = self.K, 0
        with np.errstate(all="ignore"):
            if K.near_singular == codes.LEFT:
                status = consistent(K, K.time, K.q, K.y)
                status = status or self.hooks.resume(K, K.aux_step)
            status = status or self.hooks.step(K, dt, state.time + dt)
            candidate = np.concatenate([K.q1, K.y1, K.rate1, K.lam1])
            if status == 0 and not np.isfinite(candidate).all():
                status = codes.NOT_FINITE
            size = float(K.failure_size) if status != codes.NOT_FINITE else np.inf
            iterations = int(K.n_iterations)
            if status != 0:
                reason = REASONS.get(status, f"the kernel refused the step with status {status}")
                report = StepReport(False, iterations, size, reason, too_near=status == codes.TOO_NEAR)
                return StepResult(state, memory, report)
            self.hooks.error(K, dt)
            self.hooks.accept(K, dt)
        n_v = self.n_v
        after = State(
            state.time + dt, K.q.copy(), K.y[:n_v].copy(), K.y[n_v:].copy(), state.mode, state.armed, state.anchors,
            state.names, state.velocity_names, {}, state.parameters,
        )  # fmt: skip
        return StepResult(after, self.memory(), StepReport(True, iterations, size))

    # programs: (block, parameters, out) --------------------------------------------------------------------------
    def _point(self, block: Vector) -> Point:
        K, copy = self.K, block[: self.K.o_anchor].copy()
        x, v, a, lam = copy[K.o_x : K.o_v], copy[K.o_v : K.o_a], copy[K.o_a : K.o_lam], copy[K.o_lam :]
        return Point(float(copy[0]), copy[3 : K.o_x], x, v, a, lam)

    def _at(self, point: Point, tangent: tuple[float, float] | None = None) -> Terms:
        return self.system.evaluate(point, self.mode, tangent)

    def _accelerations(self, block: Vector, parameters: Vector, out: Vector) -> None:
        """M, f, R, B, h, ḣ and γ, such that the balance and rows give the system's own accelerations."""
        K, n, m, point = self.K, self.n, self.K.n_rows, self._point(block)
        still = Point(point.t, point.q, point.x, point.y, np.zeros(n), point.lam)
        terms = self._at(still, (0.0, 0.0))
        M, out[:] = np.asarray(terms.S), 0.0
        out[: n * n] = M.ravel()
        if not m:
            out[n * n : n * n + n] = terms.r
            return
        R, H, B = np.asarray(terms.R), np.asarray(terms.H), np.zeros((m, n))
        B[:, : H.shape[1]] = H
        q = point.q if not point.x.any() else self.system.compose(point.q, point.x)
        rate, _ = self.system.accelerations(point.t, q, point.y, self.mode)
        for begin, part in (
            (K.acc_f, terms.r - R @ point.lam), (K.acc_R, R), (K.acc_B, B), (K.acc_h, terms.h),
            (K.acc_rate, terms.rate if np.any(terms.rate) else B @ point.y), (K.acc_bias, -B @ rate),
        ):  # fmt: skip
            out[begin : begin + np.size(part)] = np.ravel(part)

    def _scales(self, block: Vector, parameters: Vector, out: Vector) -> None:
        """Magnitudes of r, h and ḣ, also at the center of the chart, whose round-off increments inherit."""
        n, m, point = self.n, self.K.n_rows, self._point(block)
        terms = self._at(point)
        sizes = self._force_sizes(terms, point)
        if point.x.any():
            center = replace(point, x=np.zeros(self.n_v))
            sizes = np.maximum(sizes, self._force_sizes(self._at(center), center))
        out[:n] = sizes
        out[n : n + m] = 1.0 if terms.scale_h is None else terms.scale_h
        out[n + m : n + 2 * m] = 1.0 if terms.scale_rate is None else terms.scale_rate
        self.K.blur = terms.blur

    def _force_sizes(self, terms: Terms, point: Point) -> Vector:
        """Magnitudes of r, (n,); a system that does not tell has its inertia forces and all others."""
        if terms.scale_r is not None:
            return terms.scale_r
        terms = self._at(point, (0.0, 0.0))
        M = np.asarray(terms.S)
        rows = np.abs(np.asarray(terms.R)) @ np.abs(point.lam) if len(point.lam) else 0.0
        parts = np.abs(M) @ np.abs(point.rate) + np.abs(terms.r - M @ point.rate) + rows
        return np.full(self.n, np.max(parts, initial=0.0))

    def _compose(self, block: Vector, parameters: Vector, out: Vector) -> None:
        point = self._point(block)
        out[: self.n_q] = self.system.compose(point.q, point.x)

    def _increment_rates(self, block: Vector, parameters: Vector, out: Vector) -> None:
        point = self._point(block)
        out[: self.n_v] = self.system.increment_rates(point.x, point.y[: self.n_v])

    def _chart_end(self, chart: Vector, parameters: Vector, out: Vector) -> None:
        """Increment of the candidate, which the block has, and its rate."""
        K, n_v = self.K, self.n_v
        x = K.block[K.o_x : K.o_x + n_v].copy()
        out[:n_v], out[n_v : 2 * n_v] = x, self.system.increment_rates(x, K.y1[:n_v].copy())

    def _tail(self, terms: Terms) -> Vector:
        """r, then h and ḣ; of index 3 the rate of a row on velocities in the place of h."""
        h, rate = np.where(self.velocity, 0.0, terms.h), terms.rate
        if self.K.stabilized:
            return np.concatenate([terms.r, h, rate])
        return np.concatenate([terms.r, np.where(self.velocity, rate, h)])

    def _residual(self, block: Vector, parameters: Vector, out: Vector) -> None:
        tail = self._tail(self._at(self._point(block)))
        out[: len(tail)] = tail

    def _tangent(self, block: Vector, parameters: Vector, out: Vector) -> None:
        """``[S R; H 0]``, the residual, and the rates of B where the form is stabilized."""
        n, m, n_v, point = self.n, self.K.n_rows, self.n_v, self._point(block)
        c_C, c_K = float(block[1]), float(block[2])
        terms = self._at(point, (c_C, c_K))
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n] = terms.S
        if m:
            H = np.asarray(terms.H)
            matrix[:n, n:], matrix[n:, : H.shape[1]] = terms.R, H
        parts = [matrix.ravel(), self._tail(terms)]
        if m and self.K.stabilized:
            parts.append(self._turning(terms, point, c_C, c_K, n_v).ravel())
        whole = np.concatenate(parts)
        out[: len(whole)] = whole

    def _turning(self, terms: Terms, point: Point, c_C: float, c_K: float, n_v: int) -> Matrix:
        """∂ḣ/∂x, (m, n_v): told, or what c_K changes of H."""
        if terms.turning is not None:
            return terms.turning
        if c_K == 0.0 or c_C == 0.0:
            return np.zeros((len(terms.h), n_v))
        B = np.asarray(self._at(point, (c_C, 0.0)).H)
        turning = (np.asarray(terms.H) - B)[:, :n_v] * (c_C / c_K)
        return np.where(self.velocity[:, None], 0.0, turning)
