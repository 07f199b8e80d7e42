"""The states just after an event as a manifold: what holds there, its tangent space, coordinates on it.

Just after the event positions satisfy the rows of all contacts that are closed then, of those that it released (a
configuration does not jump) and the gap of the event itself; velocities satisfy the rows of the contacts that took part
in its impact and stay closed, or open only after it. With G the derivatives of the former by increments x of q and B
the Jacobian of the latter, the tangent space is ``null(G) × null(B) × ż``, less the coordinates that a walker moves on
along. Bases are orthonormal, N are those of the row spaces; a point of the chart around (q₀, v₀) is

    q = q₀ ⊕ (Z_q c_q + N_q μ),  h(q) = 0;   v = v₀ + Z_v c_v + N_v ν,  B(q) v + h_t = 0

so that c_q = Z_qᵀ (q ⊖ q₀), c_v = Z_vᵀ (v − v₀) exactly. Multipliers of a return map depend neither on the bases nor
on the chart.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import field
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.assembly.pose import Posture
from mbd.assembly.posture import position_rows
from mbd.compile.mechanism import AccelerationTerms, Mechanism
from mbd.dataclass import dataclass
from mbd.equal import RANK_RTOL, REST_SPEED
from mbd.equations.equations import Contact
from mbd.errors import SimulationError
from mbd.gait.heading import Heading
from mbd.gait.machines import remembered, state_anchors
from mbd.gait.whole_turns import unwound
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.sensitivity.programs import Programs, State as At
from mbd.state import Mode, State
from mbd.tape.derivatives import live

GAP_ATOL = 1e-7
"""Gap of the section's event [m, rad] after a reset up to which it still holds."""
CORRECTIONS, FINE = 12, 1e-14
"""Newton corrections of positions onto the section, and the residual [m, rad] at which they end."""


@dataclass(frozen=True, eq=False)
class Section:
    """What holds just after the event.

    mode, armed : closed contacts and those that may close
    places : numbers of rows whose h holds; gaps : (value, rate) places in the program `guards` of gaps that are zero
    rates : numbers of rows whose ḣ holds; speeds : places there of events that watch velocities
    held : numbers of anchors that are part of the state: of penalty contacts that act, what machines remember
    fixed : numbers of increments of q along which the walker moves on
    heading : turns about the vertical that change nothing; None: headings differ
    stored : numbers of anchors that machines store as it is reached
    states : numbers of the states of machines
    carried : (fixed, held) by how much each held anchor moves on with the walker, as the place of a spring leg's foot
    """

    mechanism: Mechanism
    manager: ActiveSetManager
    mode: Mode
    armed: frozenset[str] | None
    places: tuple[int, ...]
    gaps: tuple[tuple[int, int], ...]
    rates: tuple[int, ...]
    held: tuple[int, ...]
    fixed: tuple[int, ...]
    heading: Heading | None = None
    stored: tuple[int, ...] = ()
    states: tuple[float, ...] = ()
    speeds: tuple[int, ...] = ()
    carried: Matrix = field(default_factory=lambda: np.zeros((0, 0)))

    def other_states(self, state: State) -> str:
        """Modes that are in other states than on the section, in words; '' where none is."""
        machines = self.mechanism.equations.machines if len(state.anchors) else ()
        found = []
        for machine, needs in zip(machines, self.states[: len(machines)], strict=True):
            has = state.anchors[machine.anchors[0]]
            if has != needs:
                found.append(f"{machine.name!r} is in {machine.states[int(has)]!r}, not {machine.states[int(needs)]!r}")
        return " and ".join(found)

    @cached_property
    def flags(self) -> NDArray[np.int64]:
        """1 for each closed contact."""
        return self.manager.flags(self.mode.closed)

    @cached_property
    def touching(self) -> list[Contact]:
        """Unilateral contacts that are closed."""
        return [each for each in self.manager.contacts if each.name in self.mode and each.kind == "unilateral"]

    @cached_property
    def _following(self) -> list[int]:
        """Numbers of the anchors that these hold at q, and of those that machines have stored."""
        return [*(k for contact in self.touching for k in contact.anchors), *self.stored]

    @cached_property
    def _picked(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """`places` and `rates` as indices."""
        return np.array(self.places, dtype=np.intp), np.array(self.rates, dtype=np.intp)

    def terms(self, q: Vector, y: Vector, parameters: Vector, anchors: Vector) -> AccelerationTerms:
        """What holds of positions and velocities follows from these."""
        return self.mechanism.acceleration_terms(0.0, q, y, parameters, anchors)

    def positions(
        self, terms: AccelerationTerms, q: Vector, parameters: Vector, anchors: Vector
    ) -> tuple[Vector, Callable[[], Matrix]]:
        """h of all that holds of positions, and what gives G = ∂h/∂x."""
        mechanism, n_v, (picked, _) = self.mechanism, self.mechanism.layout.n_v, self._picked
        if not self.gaps:
            return terms.h[picked], lambda: np.ascontiguousarray(terms.B[picked][:, :n_v])
        guards = self._guards(q, np.zeros(mechanism.layout.n - n_v), parameters, anchors)
        here = guards(np.zeros(n_v))

        def slopes() -> Matrix:
            along = [guards(unit) for unit in np.eye(n_v)]
            rows = [np.array([[moved[rate] - here[rate] for moved in along]]) for _, rate in self.gaps]
            return np.vstack([terms.B[picked][:, :n_v], *rows])

        return np.concatenate([terms.h[picked], here[[value for value, _ in self.gaps]]]), slopes

    def velocities(
        self, terms: AccelerationTerms, q: Vector, y: Vector, parameters: Vector, anchors: Vector
    ) -> tuple[Vector, Matrix]:
        """ḣ and B of all that holds of velocities, and the event that watches them with its gradient."""
        n_v, (_, picked), speeds = self.mechanism.layout.n_v, self._picked, list(self.speeds)
        if not speeds:
            return terms.rate[picked], terms.B[picked][:, :n_v]
        programs = Programs(self.mechanism, (), parameters)
        still = np.zeros(len(y)), np.zeros(programs.columns.rows)
        switches, slips = self.flags.astype(float), np.zeros(len(self.mechanism.equations.frictions))
        here, slopes = programs.watched(At(0.0, q, y, *still, anchors, switches, slips))
        lines = [self.watched_line(place) for place in speeds]
        B = np.vstack([terms.B[picked][:, :n_v], slopes[lines, programs.columns.y][:, :n_v]])
        return np.append(terms.rate[picked], here[lines]), B

    def watched_line(self, place: int) -> int:
        """Where `Programs.watched` lists the value of a gap or of what an event watches, from its place in `guards`."""
        contacts = len(self.manager.contacts)
        return place if place < contacts else place - 2 * contacts

    def anchored(self, q: Vector, y: Vector, parameters: Vector, anchors: Vector) -> Vector:
        """The anchors with what closed unilateral contacts hold at q, and machines have just stored."""
        found = np.array(anchors, dtype=float)
        if len(anchors) and self._following:
            found[self._following] = self.terms(q, y, parameters, anchors).captured[self._following]
        return found

    def _guards(self, q: Vector, z: Vector, parameters: Vector, anchors: Vector) -> Callable[[Vector], Vector]:
        """What gives values and rates of all guards by velocities."""
        mechanism, at_v = self.mechanism, self.mechanism.layout.v
        block = mechanism.block(0.0, q, np.concatenate([np.zeros(mechanism.layout.n_v), z]), anchors)
        length = max(mechanism.sizes["guards"], 1)

        def values(v: Vector) -> Vector:
            out = np.zeros(length)
            block[at_v : at_v + len(v)] = v
            mechanism.common["guards"](block, parameters, out)
            return out

        return values


class Chart:
    """Coordinates c of the section around one of its states; see the head of this file.

    Attributes
    ----------
    state : c = 0; size : of c; parameters : at which it was made
    basis : (n_v + n_v + n_z + held, size) tangent vectors (δx, δv, δz, δanchors)
    """

    _last: tuple[tuple[bytes, bytes], State] | None = None  # what `at` was asked last, and its answer

    def __init__(self, section: Section, state: State, parameters: Vector) -> None:
        self.section, self.state, self.parameters = section, state, parameters
        layout, q, y = section.mechanism.layout, state.q, np.concatenate([state.v, state.z])
        terms = section.terms(q, y, parameters, state.anchors)
        _, slopes = section.positions(terms, q, parameters, state.anchors)
        _, B = section.velocities(terms, q, y, parameters, state.anchors)
        G = slopes()
        G[:, list(section.fixed)] = 0.0
        unmoved = np.eye(layout.n_v)[list(section.fixed)]
        self.turning = np.zeros(layout.n_v)
        if section.heading is not None:
            self.turning = section.heading.tangent(q)
            self.turning[list(section.fixed)] = 0.0
            unmoved = np.vstack([unmoved, self.turning])
        self.off_places, self.off_rates = _row_space(G), _row_space(B)
        self.places, self.rates = _null_space(np.vstack([G, unmoved])), _null_space(B)
        self.counts = (self.places.shape[1], self.rates.shape[1], layout.n - layout.n_v, len(section.held))
        self.size = sum(self.counts)
        self.basis = _blocks(self.places, self.rates, np.eye(self.counts[2]), np.eye(self.counts[3]))

    def at(self, c: Vector, parameters: Vector) -> State:
        """The state of the section with these coordinates.

        Raises
        ------
        SimulationError
            where no state of the section is near.
        """
        section, base = self.section, self.state
        compose = section.mechanism.equations.configuration.compose
        c, ends = np.asarray(c, dtype=float), [0, *accumulate(self.counts)]
        asked = c.tobytes(), parameters.tobytes()
        if self._last is not None and self._last[0] == asked:
            return self._last[1]
        parts = [c[first:last] for first, last in pairwise(ends)]
        anchors = np.array(base.anchors, dtype=float)
        if section.held:
            anchors[list(section.held)] += parts[3]
        move, size = self.places @ parts[0], np.inf
        v, z = base.v + self.rates @ parts[1], base.z + parts[2]
        y = np.concatenate([v, z])
        for _ in range(CORRECTIONS):
            q = compose(base.q, move)
            terms = section.terms(q, y, parameters, anchors)
            h, slopes = section.positions(terms, q, parameters, anchors)
            before, size = size, float(np.abs(h).max(initial=0.0))
            if size <= FINE or (size >= before and size < 1e-12):
                break
            move = move - self.off_places @ np.linalg.lstsq(slopes() @ self.off_places, h, rcond=None)[0]
        if not size < 1e-9:
            raise SimulationError(f"no state of the section is near: {size:.2g} m or rad are left of its rows")
        rate, B = section.velocities(terms, q, y, parameters, anchors)
        along = B @ self.off_rates
        # ḣ is linear in v, what an event watches may not be
        for _ in range((CORRECTIONS if section.speeds else 2) if len(rate) else 0):
            change = self.off_rates @ np.linalg.lstsq(along, rate, rcond=None)[0]
            v, rate = v - change, rate - B @ change
            if section.speeds:
                y = np.concatenate([v, z])
                rate, B = section.velocities(section.terms(q, y, parameters, anchors), q, y, parameters, anchors)
                along = B @ self.off_rates
        anchors = section.anchored(q, np.concatenate([v, z]), parameters, anchors)
        found = State(0.0, q, v, z, section.mode, section.armed, anchors, base.names, base.velocity_names)
        self._last = asked, found
        return found

    def of(self, state: State) -> Vector:
        """The coordinates of a state."""
        held, (q, v) = list(self.section.held), self.facing(state)
        anchors = np.zeros(0)
        if held:
            moved = self.section.mechanism.equations.configuration.difference(self.state.q, q)
            anchors = (state.anchors - self.state.anchors)[held] - moved[
                list(self.section.fixed)
            ] @ self.section.carried
        parts = self.places.T @ self.away(q), self.rates.T @ (v - self.state.v), state.z - self.state.z, anchors
        return np.concatenate(parts)

    def away(self, q: Matrix) -> Matrix:
        """Differences (…, n_v) of configurations from the base, without whole turns of angles that change nothing."""
        mechanism = self.section.mechanism
        moved = mechanism.equations.configuration.difference(self.state.q, q)
        return unwound(mechanism, self.parameters, moved)

    def facing(self, state: State) -> tuple[Vector, Vector]:
        """Coordinates and velocities of a state, turned about the vertical to head as the base does."""
        heading = self.section.heading
        if heading is None:
            return state.q, state.v
        return heading.turned(state.q, state.v, heading.angle(self.state.q, state.q, self.turning))


def section_of(
    mechanism: Mechanism, manager: ActiveSetManager, name: str, arrived: State, before: frozenset[str],
    parameters: Vector, fixed: Sequence[int], heading: Heading | None = None, stored: Collection[int] = (),
) -> Section:  # fmt: skip
    """The section of an event, from the state just after it and the contacts that were closed just before it."""
    after = arrived.mode.closed
    q, y = arrived.q, np.concatenate([arrived.v, arrived.z])

    def posture(closed: frozenset[str]) -> Posture:
        return Posture(mechanism, manager, parameters, q, y, manager.flags(closed), arrived.anchors)

    late = {c.name for c in manager.contacts if c.name in before and any(waits for _, waits in c.when)}
    rates = list(manager.active_rows(manager.flags(after | (late - after))))
    terms = mechanism.acceleration_terms(0.0, q, y, parameters, arrived.anchors)
    speed = max(1.0, float(np.max(np.abs(y), initial=0.0)))
    rates += [
        friction.row for friction in manager.frictions
        if friction.contact >= 0 and manager.contacts[friction.contact].name in after
        and abs(terms.rate[friction.row]) <= REST_SPEED * speed
    ]  # fmt: skip
    places = sorted({*position_rows(posture(after)), *position_rows(posture(before | after))})
    out = np.zeros(max(mechanism.sizes["guards"], 1))
    mechanism.common["guards"](mechanism.block(0.0, q, y, arrived.anchors), parameters, out)
    contacts, guards = len(manager.contacts), len(manager.guards)
    pairs = [(c, contacts + c) for c, contact in enumerate(manager.contacts)
             if contact.name == name and name not in after]  # fmt: skip
    pairs += [(4 * contacts + e, 4 * contacts + guards + e) for e, guard in enumerate(manager.guards)
              if guard.name == name]  # fmt: skip
    touching = [pair for pair in pairs if abs(out[pair[0]]) <= GAP_ATOL]
    watching = _watching_velocities(mechanism, contacts, name)
    gaps = tuple(pair for pair in touching if pair[0] not in watching)
    speeds = tuple(pair[0] for pair in touching if pair[0] in watching)
    held = [k for c in manager.contacts if c.kind == "penalty" and c.name in after for k in c.anchors]
    states = arrived.anchors[state_anchors(mechanism.equations)] if len(arrived.anchors) else ()
    numbers = tuple(float(each) for each in states)
    held += [anchor for anchor in remembered(mechanism.equations, numbers) if anchor not in stored]
    carried = _carried(mechanism, arrived, parameters, fixed, held)
    return Section(
        mechanism, manager, arrived.mode, arrived.armed, tuple(places), gaps, tuple(sorted(set(rates))), tuple(held),
        tuple(fixed), None if held else heading, tuple(sorted(stored)), numbers, speeds,
        carried,
    )  # fmt: skip


def _watching_velocities(mechanism: Mechanism, contacts: int, name: str) -> set[int]:
    """Places in the program of gaps of events and contacts of a name that watch velocities."""
    equations = mechanism.equations
    found = {
        4 * contacts + e for e, guard in enumerate(equations.guards)
        if guard.name == name and any(node.op == "input" and node.data[0] == "v" for node in live([guard.value]))
    }  # fmt: skip
    return found | {c for c, contact in enumerate(equations.contacts) if contact.name == name and contact.is_velocity}


def _carried(
    mechanism: Mechanism, state: State, parameters: Vector, fixed: Sequence[int], held: Sequence[int]
) -> Matrix:  # fmt: skip
    """By how much what would be held changes along each coordinate that the walker moves on along (fixed, held)."""
    found = np.zeros((len(fixed), len(held)))
    if not held:
        return found
    y = np.concatenate([state.v, state.z])
    compose = mechanism.equations.configuration.compose
    for number, k in enumerate(fixed):
        move = np.zeros(mechanism.layout.n_v)
        move[k] = 0.5
        ends = [mechanism.acceleration_terms(0.0, compose(state.q, sign * move), y, parameters, state.anchors).captured
                for sign in (1.0, -1.0)]  # fmt: skip
        found[number] = (ends[0] - ends[1])[list(held)]
    return found


def _row_space(rows: Matrix) -> Matrix:
    """An orthonormal basis (n, r) of the row space."""
    if not len(rows):
        return np.zeros((rows.shape[1], 0))
    _, sizes, V = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(V[sizes > RANK_RTOL * max(float(np.max(sizes, initial=0.0)), 1e-300)].T)


def _null_space(rows: Matrix) -> Matrix:
    """An orthonormal basis (n, n − r) of the null space."""
    if not len(rows):
        return np.eye(rows.shape[1])
    _, sizes, V = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(sizes > RANK_RTOL * max(float(np.max(sizes, initial=0.0)), 1e-300)))
    return np.asarray(V[rank:].T)


def _blocks(*parts: Matrix) -> Matrix:
    """A block diagonal matrix."""
    whole = np.zeros((sum(part.shape[0] for part in parts), sum(part.shape[1] for part in parts)))
    row = column = 0
    for part in parts:
        whole[row : row + part.shape[0], column : column + part.shape[1]] = part
        row, column = row + part.shape[0], column + part.shape[1]
    return whole
