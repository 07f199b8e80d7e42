"""How many ways a mechanism can move: by the rank of its rows, against Grübler's count."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.assembly.conflicts import Conflict, loops_of
from mbd.assembly.dependence import Dependence, dependences, rank_of
from mbd.assembly.infeasibility import acceleration_conflict, position_conflicts, velocity_conflict
from mbd.assembly.manager import manager_of
from mbd.assembly.pose import Posture
from mbd.assembly.posture import capture, close_nearby, close_positions, close_velocities, move, position_rows
from mbd.bodies.values import named_number_faults, names_given
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.state import State, malformed

IN_PLANE = ("x", "y", "turn z", "turn about")
"""Parts of rows that hold places and angles of the plane x–y."""


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom, redundant rows, conflicts, and whether the posture is singular.

    Attributes
    ----------
    model : its name
    coordinates : n, of the tree that the chosen cut leaves
    rows : m, of cut joints, constraints and closed contacts
    rank : independent rows at a generic posture, the largest rank found near the one looked at
    rank_here : independent rows at the posture looked at
    grubler : degrees of freedom by Grübler's count, which takes every row for independent
    dependent : rows that follow from others at a generic posture
    lost : rows that follow from others at the posture looked at only
    conflicts : irreducible sets of constraints that cannot hold together
    """

    model: str
    coordinates: int
    rows: int
    rank: int
    rank_here: int
    grubler: int
    dependent: tuple[Dependence, ...]
    lost: tuple[Dependence, ...]
    conflicts: tuple[Conflict, ...]

    @property
    def dof(self) -> int:
        """Degrees of freedom, n − rank B."""
        return self.coordinates - self.rank

    @property
    def consistent(self) -> bool:
        """Whether all constraints can hold together."""
        return not self.conflicts

    @property
    def singular(self) -> bool:
        """Whether the constraint Jacobian loses rank at the posture looked at, and not nearby."""
        return self.rank_here < self.rank

    def __str__(self) -> str:
        differs = "" if self.dof == self.grubler else f", where Grübler counts {self.grubler}"
        lines = [
            f"{self.model}: {_count(self.dof, 'degree')} of freedom{differs}",
            f"  {_count(self.coordinates, 'coordinate')}, {_count(self.rows, 'row')} of rank {self.rank}",
        ]
        if self.dependent:
            lines.append(f"  redundant: {_count(len(self.dependent), 'row')}; {_standing(self.consistent)}")
            lines += [f"    {row}" for row in self.dependent]
        if self.singular:
            lines.append(f"  singular here: rank {self.rank_here}, {self.rank} at postures nearby")
            lines += [f"    {row}" for row in self.lost]
        lines += [f"  in conflict: {conflict}" for conflict in self.conflicts]
        return "\n".join(lines)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _standing(consistent: bool) -> str:
    return "they agree; the motion is unique, their multipliers are not" if consistent else "see the conflict below"


def mobility(
    model: Any,
    state: State | None = None,
    closed: Iterable[str] | None = None,
    parameters: Mapping[str, float] | None = None,
    backend: str = "auto",
) -> Mobility:
    """Degrees of freedom ``n − rank B`` against Grübler's count, and every row that is redundant or in conflict.

    B are the rows of cut joints, constraints and closed contacts, each over its size; the rank is that of its
    singular values at a generic posture: the largest at some postures nearby that satisfy the rows, reached along the
    motions that they allow. A row that follows from earlier ones is named with them. Sets of rows that cannot hold
    together are found by leaving out one after the other (see `mbd.assembly.conflicts`).

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    state : where to look; None: at the posture nearest to the defaults [m, rad]
    closed : names of contacts that are closed; None: those of the state, or none
    parameters : values that differ from the model's, by name
    backend : see `mbd.simulate`

    Raises
    ------
    UnknownNameError
        for a contact or parameter that the model does not have.
    ModelError
        if the model has faults, or the state is that of another model.

    Examples
    --------
    >>> import mbd
    >>> model = mbd.Model("door")
    >>> leaf = mbd.RigidBody("leaf", mass=20.0, inertia=(1.0, 2.0, 1.0))
    >>> for name, height in ("lower hinge", 0.3), ("upper hinge", 1.7):
    ...     post = model.ground.point(0.0, height, 0.0, name=f"{name} post")
    ...     model.connect(mbd.Revolute(name, post, leaf.point(0.0, height, 0.0, name=name), axis=(0, 1, 0)))
    >>> print(mbd.mobility(model))
    door: 1 degree of freedom, where Grübler counts -4
      1 coordinate, 5 rows of rank 0
      redundant: 5 rows; they agree; the motion is unique, their multipliers are not
        ...
    """
    if not isinstance(state, State | None):
        raise ModelError(f"state must be a State from mbd.assemble(model, …), or None, not {state!r}")
    named, faults = names_given(() if closed is None else closed, "closed")
    faults += named_number_faults(parameters, "parameters") + (malformed(state) if state is not None else [])
    if faults:
        raise ModelError(faults)
    changed = {**(state.parameters if state is not None else {}), **(parameters or {})}
    mechanism = mechanism_of(model, backend, changed)
    work = _posture(model, mechanism, state, None if closed is None else named, changed)
    return _examined(model, work, given=state is not None)


def _examined(model: Any, work: Posture, given: bool) -> Mobility:
    """What the rows say at a posture that is `given`, or at the one nearest to the defaults."""
    loops, start = loops_of(model), work.q.copy()
    rows, free = position_rows(work), np.ones(work.equations.n_v, dtype=bool)
    misfit = close_positions(work, rows, free) if not given else _off(work, rows)
    conflicts: list[Conflict] = []
    if np.max(np.abs(misfit), initial=0.0) > EQUAL_RTOL:
        conflicts = position_conflicts(work, rows, start, loops, tried=not given)
    capture(work)
    active = work.active_rows
    idle = _idle(model, work, active)
    titles = [work.equations.rows[k].title for k in active] + idle
    here = _jacobian(work, active)
    generic = here if conflicts else _generic(work, rows, active, here)
    always = dependences(_with_idle(generic, idle), titles)
    known = {row.number for row in always}
    if not conflicts:
        conflicts = _moving_conflicts(work, loops, rank_of(here) == rank_of(generic))
    lost = tuple(row for row in dependences(_with_idle(here, idle), titles) if row.number not in known)
    return Mobility(
        work.equations.name, work.equations.n_v, len(titles), rank_of(generic), rank_of(here),
        _grubler(model, work, active), always, lost, tuple(conflicts),
    )  # fmt: skip


def _posture(
    model: Any, mechanism: Mechanism, state: State | None, closed: Sequence[str] | None, changed: Mapping[str, float]
) -> Posture:
    """Where to look: the state, or the defaults."""
    equations = mechanism.equations
    values = mechanism.parameters_of(model, changed)
    manager = manager_of(mechanism, values)
    wrong = [name for name in closed or () if name not in manager.names]
    faults = ["closed: " + nearest(name, manager.names, "contact") for name in wrong]
    if faults:
        raise UnknownNameError(faults)
    q = np.array([coordinate.default for coordinate in equations.coordinates], dtype=float)
    y = np.array([0.0] * equations.n_v + [float(each.default) for each in equations.states])
    anchors, time = np.zeros(mechanism.layout.n_anchors), 0.0
    if state is not None:
        if state.names != tuple(coordinate.name for coordinate in equations.coordinates):
            raise ModelError(f"the state has the coordinates {state.names}, not those of {equations.name!r}")
        q, y, time = state.q.copy(), np.concatenate([state.v, state.z]), state.time
        anchors = state.anchors.copy() if len(state.anchors) else anchors
        closed = closed if closed is not None else tuple(state.mode.closed)
    return Posture(mechanism, manager, values, q, y, manager.flags(closed or ()), anchors, time=time)


def _off(work: Posture, rows: list[int]) -> Any:
    """Residuals of rows at a given state."""
    terms = work.terms()
    return terms.h[rows]


def _jacobian(work: Posture, active: list[int]) -> Matrix:
    """B of the active rows."""
    terms = work.terms()
    return np.asarray(terms.B[active][:, : work.equations.n_v])


def _idle(model: Any, work: Posture, active: list[int]) -> list[str]:
    """Rows of cut joints that hold whatever the motion: of a planar model, those in its plane."""
    if not hasattr(model, "joints"):
        return []
    from mbd.topology.plan import plan

    chosen, titles, rows = plan(model), list[str](), work.equations.rows
    for joint in chosen.cut:
        parts = [part for owner, part in work.equations.idle if owner == joint.name]
        parts += [rows[k].part for k in sorted(work.manager.trivial) if rows[k].owner == joint.name]
        present = sum(rows[k].owner == joint.name and not rows[k].part.startswith("turns of") for k in active)
        count = max((3 if chosen.planar else 6) - len(joint.freedoms) - present, 0)
        parts.sort(key=lambda part: part not in IN_PLANE)
        titles += [f"{joint.name!r} ({part})" for part in parts[:count]]
    return titles


def _with_idle(B: Matrix, idle: list[str]) -> Matrix:
    return np.vstack([B, np.zeros((len(idle), B.shape[1]))])


def _generic(work: Posture, rows: list[int], active: list[int], here: Matrix) -> Matrix:
    """B of largest rank at postures nearby, reached in strides along the null space of the rows on positions."""
    walker = replace(work, q=work.q.copy(), anchors=work.anchors.copy())
    free, random = np.ones(work.equations.n_v, dtype=bool), np.random.default_rng(3)
    best, most, last = here, rank_of(here), np.zeros(work.equations.n_v)
    for _ in range(6):  # postures nearby
        before = walker.q.copy()
        B = _jacobian(walker, rows)
        _, sizes, right = np.linalg.svd(B) if len(B) else (None, np.zeros(0), np.eye(work.equations.n_v))
        count = int(np.count_nonzero(sizes > 1e-8 * max(float(np.max(sizes, initial=0.0)), 1e-300)))
        if count == work.equations.n_v:
            break
        step = right[count:].T @ random.standard_normal(work.equations.n_v - count)
        # how far from one to the next, along the motions that the rows allow [m, rad]
        step *= 0.2 / float(np.linalg.norm(step)) * (-1.0 if step @ last < 0.0 else 1.0)  # on, not to and fro
        last = step
        move(walker, step)
        if np.max(np.abs(close_nearby(walker, rows, free)), initial=0.0) > EQUAL_RTOL:
            walker.q = before
            continue
        capture(walker)
        came = _jacobian(walker, active)
        if rank_of(came) > most:
            best, most = came, rank_of(came)
        elif rank_of(came) == most and most == rank_of(here):
            best = came
    return best


def _moving_conflicts(work: Posture, loops: Mapping[str, tuple[str, ...]], regular: bool) -> list[Conflict]:
    """Rows that agree on positions but not on velocities or, at a regular posture, on accelerations."""
    found = velocity_conflict(work, loops)
    if found is None and regular:
        close_velocities(work, np.ones(work.equations.n_v, dtype=bool))
        found = acceleration_conflict(work, loops)
    return [found] if found is not None else []


def _grubler(model: Any, work: Posture, active: list[int]) -> int:
    """Grübler's count of the joints, less one for each row of constraints and closed contacts."""
    if not hasattr(model, "joints"):
        return work.equations.n_v - len(active)
    from mbd.topology.plan import plan

    joints = {joint.name for joint in model.joints}
    others = [k for k in active if work.equations.rows[k].owner not in joints or work.equations.rows[k].contact >= 0]
    return plan(model).mobility - len(others)
