"""A mechanism at one instant: which rows act, which frictions stick or slide, accelerations and multipliers."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.consistency import residuals, violations
from mbd.assembly.given_state import given_state
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import scalar_function
from mbd.dataclass import dataclass
from mbd.equations.equations import Row
from mbd.equations.linearization import LinearTerms, linearization
from mbd.errors import ModelError
from mbd.integrators.hht import HHT
from mbd.kernel import codes
from mbd.kernel.algebra.redundancy import find_dependent, sharing, spread
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.contact.cones import let_directions_go
from mbd.kernel.contact.contact_modes import resolve_contact_modes
from mbd.kernel.events.guards import watch
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.restart import active_rows
from mbd.simulation.run.plain import MechanismSystem, shares
from mbd.simulation.run.stepper import Stepper
from mbd.state import State

REASONS = {
    codes.NOT_FINITE: "a force, a mass or a row is not finite there",
    codes.CONFLICT: "no accelerations satisfy all rows there",
    codes.DEPENDENT: "neither mass nor rows determine all accelerations there",
    codes.ILL_CONDITIONED: "accelerations have no correct digits there",
    codes.NO_FORCE: "no contact forces are consistent with its frictions",
}


@dataclass(frozen=True, eq=False)
class Instant:
    """What acts at a state.

    Attributes
    ----------
    rows : numbers of all active rows, ascending; dependent : for each, whether it follows from earlier ones
    penalties, sliding : numbers of the penalty contacts that act and of the frictions that slide
    rate : (n,) consistent (v̇, ż); lam : (n_rows,) multipliers, of least norm where rows depend on each other
    system : the mechanism with all this held, as an integrator sees it
    """

    mechanism: Mechanism
    state: State
    rows: tuple[int, ...]
    dependent: tuple[bool, ...]
    penalties: tuple[int, ...]
    sliding: tuple[int, ...]
    rate: Vector
    lam: Vector
    system: MechanismSystem

    @property
    def titles(self) -> tuple[str, ...]:
        """A title for each active row."""
        return tuple(row.title for row in self._chosen)

    @property
    def velocity(self) -> Any:
        """(m,) booleans, which of the active rows hold velocities only."""
        return np.array([row.is_velocity for row in self._chosen], dtype=bool)

    @property
    def _chosen(self) -> list[Row]:
        return [self.mechanism.equations.rows[k] for k in self.rows]

    def terms(self, extra: Vector | None = None) -> LinearTerms:
        """Derivatives of balance and rows here; `extra` (m,) is added to the multipliers of the active rows."""
        mechanism, layout = self.mechanism, self.mechanism.layout
        mode = self.rows, self.penalties, self.sliding
        function = mechanism.kept(
            (linearization, *map(tuple, mode)),
            lambda: scalar_function(linearization(mechanism.equations, *mode), layout, "linear"),
        )
        return LinearTerms.of(self.evaluate(function, extra), layout.n, layout.n_v, len(self.rows))

    def evaluate(self, function: Any, extra: Vector | None = None) -> Vector:
        """What a program gives here; `extra` as for `terms`."""
        mechanism, state, layout = self.mechanism, self.state, self.mechanism.layout
        y = np.concatenate([state.v, state.z])
        block = mechanism.block(state.time, state.q, y, self.system.anchors, self.penalties)
        block[layout.a : layout.lam] = self.rate
        block[layout.lam : layout.anchor] = self.lam
        if extra is not None:
            block[[layout.lam + k for k in self.rows]] += extra
        block[layout.slip : layout.shift] = self.system.slips
        out = np.zeros(function.size)
        function(block, self.system.parameters, out)
        return out

    def value(self, parameter: Any) -> float:
        """The value of a parameter, by its input on the tape."""
        return float(self.system.parameters[parameter.data[1]])

    def kept(self, matrix: Matrix) -> Matrix:
        """The lines of a matrix that belong to independent rows."""
        return np.asarray(matrix[~np.array(self.dependent, dtype=bool)])

    def forces(self, terms: LinearTerms) -> Matrix:
        """(N, kept) what the multipliers of the independent rows do to the balance.

        While a friction slides, the rows that depend on them take their shares of a load, as in a run; they are held.
        """
        R, part = self.kept(terms.R.T).T, self.loads()
        return R if part is None else np.asarray(R + terms.R[:, np.array(self.dependent, dtype=bool)] @ part)

    def loads(self) -> Matrix | None:
        """(dependent, kept) what dependent rows carry of the multipliers of the others while a friction slides."""
        if not (self.sliding and any(self.dependent)):
            return None
        state, system = self.state, self.system
        there = self.mechanism.acceleration_terms(
            state.time, state.q, np.concatenate([state.v, state.z]), system.parameters, system.anchors,
            slips=system.slips, lam=self.lam,
        )  # fmt: skip
        flags = np.array(self.dependent, dtype=bool)
        kept, dependent = np.array(self.rows)[~flags], np.array(self.rows)[flags]
        return np.asarray(shares(self.mechanism.equations.rows, there, kept.tolist(), dependent.tolist()))


def instant(
    model: Any,
    state: State,
    parameters: Mapping[str, float] | None = None,
    backend: str = "auto",
    inputs: Collection[str] = (),
) -> Instant:
    """Accelerations and multipliers of the contacts that are closed in a state; frictions at rest stick if they can.

    `inputs` are parameters that are to be run-time inputs whatever their values.

    Raises
    ------
    ModelError
        if the state is that of another model, is not consistent, or closes a contact that would pull there.
    """
    given = given_state(model, state, parameters, backend, inputs)
    mechanism, manager, values = given.mechanism, given.manager, given.values
    stepper = Stepper(mechanism, manager, HHT(), values, 1.0, {"capacity": 1})
    K, flags = _kernel(stepper, state), manager.flags(state.mode.closed)
    with np.errstate(all="ignore"):
        status = resolve_contact_modes(K)
    if status != 0:
        why = REASONS.get(status, "no consistent contact forces were found")
        raise ModelError(f"no accelerations at t = {state.time:.6g} s: {why}")
    opened = [name for name, was, now in zip(manager.names, flags, K.closed, strict=False) if was != now]
    if opened:
        raise ModelError([_pulls(name) for name in opened])
    find_dependent(K, active_rows(K, K.closed))
    if K.n_dropped > 0 and not sharing(K):
        spread(K, K.lam)
    if K.n_cones > 0:
        _let_directions_go(K, manager)
    rows = manager.active_rows(flags, K.sticks)
    layout = mechanism.layout
    found = Instant(
        mechanism, state, rows, tuple(bool(K.dropped[k]) for k in rows), manager.penalties(flags),
        tuple(int(f) for f in np.flatnonzero(K.slip[: layout.n_frictions])), K.rate[: layout.n].copy(),
        K.lam[: layout.n_rows].copy(), stepper.system,
    )  # fmt: skip
    faults = _faults(found)
    if faults:
        raise ModelError(faults)
    return found


def _let_directions_go(K: Kernel, manager: ActiveSetManager) -> None:
    """Friction in a plane follows the velocity from here on; where it only begins to slide it has no linear law."""
    K.guards0[: K.n_watched] = 0.0
    watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
    let_directions_go(K)
    begins = [manager.frictions[f].name for f in range(K.n_frictions) if K.hold[f] > 0.0]
    if begins:
        raise ModelError(
            f"{begins[0]!r} begins to slide from rest at t = {K.time:.6g} s: in space its friction has no direction "
            "there that small motions could change smoothly; take a state in which it sticks or slides"
        )


def _kernel(stepper: Stepper, state: State) -> Kernel:
    """The kernel's arrays at the state."""
    values = stepper.kernel
    values.q[: values.n_q] = state.q
    values.y[: values.n] = np.concatenate([state.v, state.z])
    values.closed[: values.n_contacts] = stepper.manager.flags(state.mode.closed)
    if len(state.anchors) == values.n_anchors:
        values.anchors[: values.n_anchors] = state.anchors
    values.time = state.time
    values.chunk = 1
    return values


def _pulls(name: str) -> str:
    return (
        f"{name!r} is closed in the state, but its force would pull there, so that it opens at once; assemble the "
        "state without it in closed=[…], or choose one in which it pushes"
    )


def _faults(found: Instant) -> list[str]:
    """Active rows that the state does not satisfy."""
    state, system = found.state, found.system
    y, speed = np.concatenate([state.v, state.z]), float(np.max(np.abs(state.v), initial=0.0))
    left = residuals(found.mechanism, state.time, state.q, y, system.parameters, system.anchors)
    faults = violations(found.mechanism.equations.rows, found.rows, left, speed)
    if faults:
        faults[-1] += "; mbd.project(model, state) or mbd.assemble(model, …) gives a state that satisfies all rows"
    return faults
