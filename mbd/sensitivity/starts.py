"""What a run is differentiated by: coordinates and speeds of its start, parameters, directions of several parameters.

A start with closed rows is completed as `mbd.assemble` and `mbd.project` complete it: positions that are not held move
least in the metric of the mass matrix until the rows on positions and the gaps of closed contacts hold, which stick
where they are then; then velocities.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.equations.equations import Equations
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.notes import doubt
from mbd.sensitivity.motion import First, Mode, Motion, Tangent
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.tangent.printer import LANES
from mbd.sensitivity.tangent_names import expanded, refuse_parts, start_names
from mbd.sensitivity.transitions import stored_at_start

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Direction:
    """One thing to differentiate by.

    name : as it was asked for
    q, y : numbers of the direction of the configuration or the velocity that it is, −1 if it is none
    parameters : rates of change of parameters by name; restitutions : of those of contacts, by name
    along : derivatives of (q, y, anchors) of a start that stays on its rows so; None: others complete it
    """

    name: str
    q: int = -1
    y: int = -1
    along: Vector | None = None
    parameters: Mapping[str, float] | None = None
    restitutions: Mapping[str, float] | None = None


RESTITUTION = ".restitution"
"""Behind the name of a contact, what one may differentiate by although no run takes it as a parameter."""


def restitution_names(equations: Equations) -> list[str]:
    """Restitutions of contacts that close by impact."""
    return [contact.name + RESTITUTION for contact in equations.contacts if contact.kind != "penalty"]


def unknown_name(equations: Equations, name: str, known: Collection[str], what: str) -> str:
    """What to write instead of a name by which runs cannot be changed."""
    if name in restitution_names(equations):
        return (
            f"{name!r} is a number of the model, which no run changes; give mbd.optimize a function that makes it with "
            f"the value, lambda values: mbd.sensitivities(model_of(values), …, wrt=[{name!r}])"
        )
    return nearest(name, known, what, "There are")


def programs_of(mechanism: Mechanism, wanted: Sequence[Direction], values: Vector) -> Programs:
    """The programs for the parameters that some directions change, at these values of all parameters."""
    known, alone = _numbers(mechanism), dict[int, int]()
    counts = Counter(name for each in wanted for name in each.parameters or ())
    if len(wanted) < LANES:  # else several runs share them
        for k, each in enumerate(wanted):
            for name, rate in (each.parameters or {}).items():
                if len(each.parameters or ()) == counts[name] == rate == 1:
                    alone[known[name]] = k
    return Programs(mechanism, [known[name] for name in counts], values, alone)


def _numbers(mechanism: Mechanism) -> dict[str, int]:
    """Numbers of parameters by name."""
    return mechanism.kept(
        _numbers, lambda: {parameter.name: k for k, parameter in enumerate(mechanism.equations.parameters)}
    )


def restitutions_of(wanted: Sequence[Direction]) -> dict[str, Vector]:
    """Rates (D,) of the restitutions of contacts, by their names."""
    found: dict[str, Vector] = {}
    for k, each in enumerate(wanted):
        for name, rate in (each.restitutions or {}).items():
            found.setdefault(name, np.zeros(len(wanted)))[k] = rate
    return found


def directions(
    mechanism: Mechanism, wrt: Sequence[str | tuple[str, Mapping[str, float]] | Direction]
) -> Sequence[Direction]:
    """Names, and pairs of a name and the rates of parameters by it, as directions; three of 'hip.orientation'.

    What is a direction already stays. Those of names alone are kept with the mechanism.

    Raises
    ------
    UnknownNameError
        for a name that is neither a coordinate or rate of the start nor a run-time parameter.
    """
    if set(map(type, wrt)) <= {str}:
        return mechanism.kept((directions, *wrt), lambda: _directions(mechanism.equations, wrt))
    return _directions(mechanism.equations, wrt)


def _directions(
    equations: Equations, wrt: Sequence[str | tuple[str, Mapping[str, float]] | Direction]
) -> Sequence[Direction]:
    start, known = start_names(equations), {parameter.name for parameter in equations.parameters}
    bounces = set(restitution_names(equations)) - known
    found = []
    for each in expanded(equations, wrt):
        if isinstance(each, Direction):
            found.append(each)
            continue
        name, parameters = (each, None) if isinstance(each, str) else each
        wanted = [name] if parameters is None else list(parameters)
        for one in wanted:
            if one in known or one in bounces or (parameters is None and one in start):
                continue
            refuse_parts(equations, [one], "wrt")
            text = nearest(
                one, {*known, *start, *bounces}, "coordinate, rate of the start or run-time parameter", "There are"
            )
            raise UnknownNameError(f"{text}; an exact 0 or ±1 is a run-time input only with tunable=[{one!r}]")
        if parameters is None and name in start:
            if name in known:
                doubt(
                    f"wrt: {name!r} is a state of the start and a run-time parameter; this is the derivative by the "
                    f"state. For that by the parameter give its rate, {{'parameter': {{{name!r}: 1.0}}}}"
                )
            found.append(Direction(name, *start[name]))
        else:
            rates = {name: 1.0} if parameters is None else dict(parameters)
            impacts = {one.removesuffix(RESTITUTION): rate for one, rate in rates.items() if one in bounces}
            found.append(
                Direction(name, parameters={k: v for k, v in rates.items() if k not in bounces}, restitutions=impacts)
            )
    return tuple(found)


def start_tangent(first: First, programs: Programs, wanted: Sequence[Direction], held: Collection[str] = ()) -> Tangent:
    """Derivatives of the consistent start by these directions; coordinates and rates that are `held` stay.

    Raises
    ------
    ModelError
        where the others cannot make the rows hold.
    """
    c, count = programs.columns, len(wanted)
    q, y, p = np.zeros((c.n_v, count)), np.zeros((c.n, count)), np.zeros((c.parameters, count))
    anchors = np.zeros((c.anchors, count))
    numbers, columns = _numbers(programs.mechanism), {place: k for k, place in enumerate(programs.places)}
    for k, each in enumerate(wanted):
        if each.q >= 0:
            q[each.q, k] = 1.0
        elif each.y >= 0:
            y[each.y, k] = 1.0
        for name, rate in (each.parameters or {}).items():
            p[columns[numbers[name]], k] = rate
        if each.along is not None:
            q[:, k], y[:, k], anchors[:, k] = np.split(each.along, [c.n_v, c.n_v + c.n])
    tangent = Tangent(np.zeros(count), q, y, anchors, p)
    if all(each.along is not None for each in wanted):
        return tangent
    motion = Motion(first.t, first.q, first.y, first.anchors, tangent)
    fixed = directions(programs.mechanism, tuple(held))
    free_q, free_v = np.ones(c.n_v, dtype=bool), np.ones(c.n_v, dtype=bool)
    free_q[[each.q for each in fixed if each.q >= 0]] = False
    free_v[[each.y for each in fixed if 0 <= each.y < c.n_v]] = False
    motion = _completed(programs, motion, first.mode, (free_q, free_v))
    return (motion if first.is_end else stored_at_start(programs, motion, first.mode)).tangent


def _completed(programs: Programs, motion: Motion, mode: Mode, free: tuple[Flags, Flags]) -> Motion:
    """The motion with positions and velocities on the rows, and contacts that hold what is now."""
    if not mode.held:
        return motion
    c, equations = programs.columns, programs.equations
    normals = {contact.rows[0] for contact in equations.contacts if contact.rows}
    zero = np.zeros(c.n), np.zeros(c.rows)
    _, _, _, of_r, of_h, of_rate = programs.steps(motion.at(mode, *zero))
    M = of_r[:, c.rate][: c.n_v, : c.n_v]
    places = [
        k for k in mode.held
        if not equations.rows[k].is_velocity and (equations.rows[k].contact < 0 or k in normals)
    ]  # fmt: skip
    completion = Completion(M, of_h[places][:, c.x], free[0])
    motion = motion.with_tangent(q=motion.tangent.q + completion.change(of_h[places] @ motion.tangent.stacked(c)))
    closed = [k for k in range(len(equations.contacts)) if mode.closed[k]]
    motion = captured(programs, motion, mode, closed)
    rates = of_rate[list(mode.held)]
    B = rates[:, c.y][:, : c.n_v]
    if not completion.is_of(B, free[1]):
        completion = Completion(M, B, free[1])
    y = motion.tangent.y.copy()
    y[: c.n_v] += completion.change(rates @ motion.tangent.stacked(c))
    return motion.with_tangent(y=y)


class Completion:
    """Changes of free coordinates that make rows hold, least in the metric of M of those that the rows act on.

    B may have dependent rows; M is made definite as an assembly does.
    """

    def __init__(self, M: Matrix, B: Matrix, free: Flags) -> None:
        self.B, self.free = B, free
        self._by_row = np.zeros((len(M), len(B)))  # change by what a row is off
        sizes = np.abs(B).max(axis=0, initial=0.0)
        places = np.flatnonzero((sizes > 1e-12 * sizes.max(initial=0.0)) & free)
        if len(places):
            part, rows = M[places[:, None], places], B[:, places]
            part.flat[:: len(places) + 1] += 1e-9 * (float(np.abs(part.diagonal()).max()) or 1.0)
            self._by_row[places] = _by_row(part, rows)

    def is_of(self, B: Matrix, free: Flags) -> bool:
        """Whether it is that of these rows too."""
        return np.array_equal(self.B, B) and np.array_equal(self.free, free)

    def change(self, off: Matrix) -> Matrix:
        """The change (n_v, D) that removes what rows are off (R, D)."""
        found = self._by_row @ off
        left = float(np.abs(off + self.B @ found).max(initial=0.0))
        if left > 1e-12 and left > 1e-8 * float(np.abs(off).max(initial=0.0)):
            raise ModelError(
                "the start cannot be changed so: besides the coordinates and rates that hold= or wrt= keep, none are "
                "left that make the rows of closed contacts and constraints hold; hold fewer"
            )
        return found


def _by_row(M: Matrix, B: Matrix) -> Matrix:
    """``−M⁻¹ Bᵀ (B M⁻¹ Bᵀ)⁺``, from one system where rows are independent."""
    n, m = len(M), len(B)
    A, b = np.zeros((n + m, n + m)), np.zeros((n + m, m))
    A[:n, :n], A[:n, n:], A[n:, :n] = M, B.T, B
    b[n:] = -np.eye(m)
    try:
        found = np.linalg.solve(A, b)[:n]
        if np.abs(B @ found + np.eye(m)).max(initial=0.0) <= ROUND_OFF_RTOL:
            return np.asarray(found)
    except np.linalg.LinAlgError:
        pass
    flow = np.linalg.solve(M, B.T)
    return -flow @ np.linalg.lstsq(B @ flow, np.eye(m), rcond=1e-12)[0]


def captured(programs: Programs, motion: Motion, mode: Mode, contacts: Sequence[int]) -> Motion:
    """The motion with what these contacts hold from now on."""
    equations = programs.equations
    places = [place for c in contacts for place in equations.contacts[c].anchors]
    if not places:
        return motion
    order = [place for contact in equations.contacts for place in contact.anchors]
    lines = [order.index(place) for place in places]
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    values, slopes = programs.captured(motion.at(mode, *zero))
    anchors, of_anchors = motion.anchors.copy(), motion.tangent.anchors.copy()
    anchors[places] = values[lines]
    of_anchors[places] = slopes[lines] @ motion.tangent.stacked(programs.columns)
    return replace(motion, anchors=anchors).with_tangent(anchors=of_anchors)
