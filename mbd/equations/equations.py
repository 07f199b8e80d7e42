"""The equations of motion as values: what both front doors produce and every later stage reads.

``r(t, q, v, a, λ) = M(q) a + f(t, q, v) + B(q, t)ᵀ λ = 0``, ``h(q, t) = 0``, ``ż = s(t, q, v, z)``.

Inputs on the tape, as (kind, index)
    ('t', 0)       time
    ('c', 0), ('c', 1)   tangent factors c_C = ∂v₁/∂v̇₁ and c_K = ∂q₁/∂v̇₁
    ('q', i)       coordinates at the center of the chart; ('x', i) local increment: everything is evaluated at q ⊕ x
    ('v', i), ('a', i)   velocities, accelerations
    ('z', i), ('s', i)   first-order states and their rates ż
    ('lam', k)     multiplier of row k of `rows`
    ('anchor', k)  value held between instants: what machines hold (state, its beginning, what was read then), what
                   contacts hold since they closed (point of touchdown, approach speed), whole turns of cut joints
    ('switch', c)  1.0 while penalty contact number c acts, else 0.0
    ('slip', k)    sign of the sliding of friction k, 0.0 while it sticks or its contact is open; of two directions
                   see `mbd.equations.cones`
    ('p', k)       parameter k
    ('place', 0), ('place', 1)   x and z of a height function that a picture shows
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any, Literal, Protocol

from mbd.configuration import Configuration
from mbd.dataclass import dataclass
from mbd.equations.composite_mass import MassLoop
from mbd.equations.shapes import Shape
from mbd.tape.node import Node, Table, Tape


@dataclass(frozen=True)
class Coordinate:
    """One entry of q (or of z): name as users write it, unit, default initial value."""

    name: str
    unit: str
    default: float = 0.0


@dataclass(frozen=True)
class Chart:
    """How increments x move, where q ⊕ x is not q + x: ``v = D(x) ẋ``, ``D(0) = 1`` (see `mbd.configuration`).

    rates : (n_v) ẋ = D⁻¹ v on the tape
    velocities : (n_v × n_v) the entries of D, line by line
    """

    rates: tuple[Node, ...]
    velocities: tuple[tuple[Node, ...], ...]


@dataclass(frozen=True)
class Parameter:
    """A run-time input: 'left thigh.mass' and its value in the description."""

    name: str
    value: float


@dataclass(frozen=True)
class Row:
    """One scalar constraint, on positions ``h = 0`` or on velocities ``B v + b = 0``.

    owner : name of the joint or constraint; part : which of its rows ('x', 'normal', 'tangent', …)
    value : h on the tape, zero for a row on velocities; rate : ḣ = B v + h_t, or B v + b, on the tape
    contact : number of the contact it belongs to, −1 for bilateral rows
    unit : of h, 'm' or 'rad'; that of the rate times seconds for a row on velocities
    kind : 'position', B = ∂h/∂q; or 'velocity', B = ∂rate/∂v, which need not come from a position
    friction : number of the dry friction that holds it only while it sticks, −1 otherwise
    reaction, wraps : see `mbd.constraints.law.Equation`
    """

    owner: str
    part: str
    value: Node
    rate: Node
    contact: int = -1
    unit: str = "m"
    kind: Literal["position", "velocity"] = "position"
    friction: int = -1
    reaction: str = "force"
    wraps: bool = False

    @property
    def is_velocity(self) -> bool:
        """Whether it holds at velocity level only."""
        return self.kind == "velocity"

    @property
    def title(self) -> str:
        """Owner and part, for messages."""
        return f"{self.owner!r} ({self.part})" if self.part else repr(self.owner)


@dataclass(frozen=True)
class Contact:
    """A constraint that opens and closes.

    kind : 'unilateral' (rows of Lagrange multipliers, normal first) or 'penalty' (a force law)
    gap, gap_rate : g and ġ on the tape, g ≥ 0 is open
    rows : its rows in `Equations.rows`
    captured, anchors : quantities stored into anchors k when it closes
    force : penalty force, ≥ 0 pushing; generalized : its contribution to f while it acts (length n_v + n_z)
    opens_on : 'pull' (multiplier or force would attract), 'gap' (penalty: g > 0 again) or 'when'
    when : (name of the other contact, after_impact) pairs that open it as the other closes
    released_in : states of modes ('leg: flight') that open it as they are entered
    only_while : name of a contact that must be closed, or a node that must be positive, or None
    restitution : e of Newton's law
    unit : of the gap
    may_pull : whether its rule says that it may, so that no note tells that it did
    drags : (part, velocity, force) of a force law's further forces, whose power is force · velocity; of a contact by
        rows those of smooth friction, which follow the multiplier of its normal row
    is_velocity : whether its gap is a velocity, along which its force acts then
    undefined : what it means where the gap is no number, for errors
    foot : the place (x, y, z) where it touches, if no body tells it
    """

    name: str
    kind: str
    gap: Node
    gap_rate: Node
    rows: tuple[int, ...] = ()
    captured: tuple[Node, ...] = ()
    anchors: tuple[int, ...] = ()
    force: Node | None = None
    generalized: tuple[Node, ...] = ()
    opens_on: str = "pull"
    when: tuple[tuple[str, bool], ...] = ()
    only_while: Node | str | None = None
    restitution: float = 0.0
    unit: str = "m"
    may_pull: bool = False
    drags: tuple[tuple[str, Node, Node], ...] = ()
    is_velocity: bool = False
    undefined: str = ""
    released_in: tuple[str, ...] = ()
    foot: tuple[Node, ...] = ()


@dataclass(frozen=True)
class Friction:
    """Dry friction along one direction, ``|λ_T| ≤ limit`` while γ = 0 and ``λ_T = limit · sign γ`` while it slides.

    The mechanism feels −λ_T along γ. It sticks by its row, whose multiplier is λ_T; while it slides the row is off.

    name : the contact or the joint
    row : the row that holds γ = 0 while it sticks
    contact : the contact whose normal force it follows, −1 if it always acts
    rate : γ on the tape; change : γ̇, with accelerations
    limit : at rest, of multipliers and parameters, homogeneous of degree one in the multipliers but for a constant
    sliding : limit at the velocity of its slide, `limit` itself where that changes nothing; see `limit_at_speed`
    struck : limit at the velocity before an impact, in whichever direction; `limit` where velocity changes nothing
    group : numbers, which follow each other, of those that slide together, itself among them: both directions of a
        contact in space, three of a ball joint; () of one alone. Together they obey ``‖λ_T‖ ≤ limit``, and
        ``λ_T = limit γ/‖γ‖`` while they slide (see `mbd.equations.cones`)
    """

    name: str
    row: int
    contact: int
    rate: Node
    change: Node
    limit: Node
    sliding: Node
    struck: Node
    group: tuple[int, ...] = ()

    @property
    def falls(self) -> bool:
        """Whether the limit of a contact's friction changes as it slides."""
        return self.contact >= 0 and self.sliding is not self.limit

    def limit_at_speed(self, smooth: Node | float = 1.0) -> Node:
        """``struck + smooth (sliding − struck)``, smooth = 0 in impacts: their limit is that of the slip before them.

        Friction in joints stays finite, so that impacts make nothing of it: it is that of its velocity always.
        """
        if not self.falls or not isinstance(smooth, Node):
            return self.sliding
        return self.struck + smooth * (self.sliding - self.struck)


@dataclass(frozen=True)
class Transition:
    """How an event changes what a machine holds.

    machine, source, target : their numbers
    causes : (kind, number) of what makes it happen: ('closed', contact), ('opened', contact), ('event', guard that
        crosses zero, its own among them), ('taken', guard of another transition)
    contact : number of a contact that must be closed for it, −1 for none
    condition : what must be positive for it, None for nothing
    stored : numbers of the anchors that are stored with it; `Machine.captured` tells what
    timed : as of `mbd.constraints.machine.Change`
    """

    machine: int
    source: int
    target: int
    causes: tuple[tuple[str, int], ...]
    contact: int = -1
    condition: Node | None = None
    stored: tuple[int, ...] = ()
    timed: bool = False

    @property
    def is_unconditional(self) -> bool:
        """Whether it happens whenever its cause does."""
        return self.contact < 0 and self.condition is None


@dataclass(frozen=True)
class Guard:
    """A user's event: fires when `value` crosses zero (direction −1 falling, +1 rising, 0 both).

    transition : that of a machine which is this event; one without a guard of its own never fires by itself
    is_kink : whether it is no event of the user's: a step ends at it, and nothing tells of it
    """

    name: str
    value: Node
    rate: Node
    direction: int = 0
    terminal: bool = False
    reset: Any = None
    transition: Transition | None = None
    is_kink: bool = False

    @property
    def is_timer(self) -> bool:
        """Whether it is the time less an instant that is known as a state is entered."""
        timed = self.transition is not None and self.transition.timed
        return timed and self.rate.op == "const" and self.rate.data == 1.0


@dataclass(frozen=True)
class Machine:
    """Discrete states and held numbers; its transitions are guards.

    states : their names; anchors : the numbers that it holds, that of the state first; fields : their names
    times : which of these anchors are instants [s]
    initial : what they are before the start, but for the parameters that `own` tells, (turn, number) of each; first :
        those that are stored then, none where forces must be known for it
    captured : what is stored into each anchor, on the tape; the anchor itself where nothing is
    """

    name: str
    states: tuple[str, ...]
    anchors: tuple[int, ...]
    fields: tuple[str, ...]
    times: tuple[int, ...]
    initial: tuple[float, ...]
    first: tuple[int, ...]
    captured: tuple[Node, ...]
    own: tuple[tuple[int, int], ...] = ()

    def initial_at(self, parameters: Any) -> list[float]:
        """What it holds before the start with these values of parameters."""
        found = list(self.initial)
        for turn, number in self.own:
            found[turn] = float(parameters[number])
        return found


@dataclass(frozen=True)
class StrikeImpulse:
    """An impulse of the user as a contact closes.

    contact : number of that contact; order : 0 before, 1 with, 2 after its impact
    vector : w P on the tape, generalized (n_v)
    """

    name: str
    contact: int
    order: int
    vector: tuple[Node, ...]


@dataclass(frozen=True)
class Turn:
    """The angle between the frames of a cut joint in the plane, a sum of coordinates and of whole turns.

    ``angle = sign (φ_child − φ_parent + offset + 2π n)``, with the headings φ of the two bodies along the tree. The
    number n is a constant of the motion, since the angle is continuous: which of the angles that give the same pose is
    meant. The start chooses it.

    The angle of a cut joint in space on which no equation depends is read off a rotation, modulo a turn; its n changes
    as it turns, and is counted from row to row by its rate.

    name : of the coordinate, 'knee.angle'; '' for a joint that does not turn, whose row is the angle
    joint : name of the joint
    anchor : number of the anchor that holds n
    angle : on the tape [rad]
    sign : ±1, so that one more turn changes the angle by 2π · sign
    rate : of an angle that is read off a rotation [rad/s]; None in the plane, where n is constant
    """

    name: str
    joint: str
    anchor: int
    angle: Node
    sign: float
    rate: Node | None = None


@dataclass(frozen=True)
class Facing:
    """Which way round a cut joint is put together, where its rows hold sines of angles.

    joint : its name; rows : numbers of those rows
    cosine : ``(tr(R(q)ᵀ R) − 1)/2`` on the tape, with R the rotation between its frames and R(q) that of the joint's
        own coordinates read off them: 1 where it is put together as described, −1 half a turn off
    """

    joint: str
    rows: tuple[int, ...]
    cosine: Node


@dataclass(frozen=True)
class Effect:
    """One cause of forces: a loss, a spring, a motor, a penalty stop, gravity.

    kind : 'gravity', 'potential', 'loss', 'applied', 'penalty'
    column : kind of cause in the energy ledger, see `mbd.results.ledger.Part`; by default from its kind
    generalized : makes its part of f (length n_v + n_z), positive on the left-hand side
    power : rate of work it does on the mechanism [W]; None where `potential` accounts for it
    potential : its stored energy [J] or None; what it gains as first-order states change, the effect gives
    contact : the penalty contact whose switch it follows, −1 otherwise
    elastic : energy that a penalty contact can give back while it acts [J], of which `power` is not the account; None
        where its law does not tell
    """

    name: str
    kind: str
    generalized: Callable[[], Sequence[Node]]
    power: Node | None = None
    potential: Node | None = None
    contact: int = -1
    column: str = ""
    elastic: Node | None = None

    def __post_init__(self) -> None:
        if not self.column:
            usual = {"loss": "damper", "applied": "force"}
            object.__setattr__(self, "column", usual.get(self.kind, self.kind))


class Eliminated(Protocol):
    """A matrix that is eliminated on the tape: see `mbd.tape.elimination.Factors`."""

    @property
    def sound(self) -> Node: ...

    @property
    def weakest(self) -> Node: ...

    def solve(self, right: Sequence[Node]) -> list[Node]: ...

    def kept(self) -> list[Node]: ...

    def read(self, kept: Mapping[int, Node]) -> Eliminated: ...


@dataclass(frozen=True)
class ActingForces:
    """What acts besides the balance: Σ_k multiplier_k ∂value_k/∂x + Σ_k force_k ∂rate_k/∂v.

    values, multipliers : functions of t and q ⊕ x, and what acts on each
    rates, along_rates : functions that depend on v too, and the force on each
    """

    values: Sequence[Node] = ()
    multipliers: Sequence[Node] = ()
    rates: Sequence[Node] = ()
    along_rates: Sequence[Node] = ()


class Geometry(Protocol):
    """What a derivation knows of its own expressions: shorter ways to derivatives that the tape could take alone.

    depth : how many coordinates move a body, on average
    largest_tree : coordinates of the largest tree, as bodies that fixed ones alone connect are apart
    """

    @property
    def depth(self) -> float: ...

    @property
    def largest_tree(self) -> int: ...

    def balance_with(self, forces: ActingForces) -> list[Node]:
        """The balance with these forces too (length n_v + n_z)."""

    def forces(self, forces: ActingForces) -> list[Node]:
        """What `balance_with` adds to the balance."""

    def mass_matrix(self) -> list[list[Node]] | None:
        """M = ∂r/∂a, line by line; None where more than inertia depends on accelerations."""

    def mass_loop(self) -> MassLoop | None:
        """The same as a loop; None where its entries are few."""

    def accelerations(self, forces: Sequence[Node]) -> tuple[list[Node], Node] | None:
        """v̇ with M v̇ = forces by a shorter way than by M, and the least part of an inertia that its pivots keep.

        None where it knows none.
        """

    def tangent(self, forces: ActingForces) -> list[list[Node]] | None:
        """The columns of S = M + c_C C + c_K K of `balance_with` by a shorter way, or None where it knows none."""

    def eliminated(self, forces: ActingForces) -> Eliminated | None:
        """The same S eliminated without the matrix, with operations in proportion to the bodies; None if it cannot."""

    def partials(self, outputs: Sequence[Node]) -> list[dict[Node, Node]]:
        """For each x_j, ∂node/∂x_j of the nodes inside `outputs` (positions, rotations) where it is known."""

    def rates(self, outputs: Sequence[Node]) -> dict[Node, Node]:
        """d node/dt of the nodes inside `outputs` where it is known."""

    def row_sizes(self, row: int) -> list[Node]:
        """Σ|parts| of the derivative of a row by each x_j, by v_j of one on velocities, before they cancel."""

    def amplitudes(self) -> dict[int, float]:
        """How large components of directions can be that are sums of products, by the numbers of their nodes."""


@dataclass
class Equations:
    """Everything derived from a model, as expressions on one tape.

    balance : the n_v + n_z components of ``r`` without rows and penalties (``ż − s`` for the states)
    kinetic, potential : T and V; V includes gravity and every effect with a potential
    output : any named result as a node ('left hip.angle', 'left shank.end.x', 'left knee.reaction_force.x', …)
    output_names : the names that `output` certainly knows
    compose, chart : q ⊕ x (n_q) and how x moves; None where all coordinates add
    configuration : what the joints say of coordinates and velocities; made from `coordinates` where it is not given
    turns : of the cut joints, see `Turn`
    facings : of the cut joints whose rows hold sines, see `Facing`
    machines : discrete states, see `Machine`
    impulses : of the user, as contacts close
    held_forces : names of the forces of constraints, contacts and joints that laws read
    idle : (owner, part) of rows of cut joints that hold whatever the motion, and were left out
    markers : full names of the named points, which pages show
    observations : (name, unit) of the results of users' own; anatomy : (joint, joint of the body) of those that are one
    shapes : what pictures show beside bodies
    mirror : gives signs of coordinates and velocities in space, where the sides 'left' and 'right' are exchanged
    memory : what follows from the rest, kept once it was found
    """

    name: str
    tape: Tape
    coordinates: tuple[Coordinate, ...]
    states: tuple[Coordinate, ...]
    parameters: tuple[Parameter, ...]
    balance: tuple[Node, ...]
    rows: tuple[Row, ...]
    contacts: tuple[Contact, ...]
    guards: tuple[Guard, ...]
    effects: tuple[Effect, ...]
    kinetic: Node
    potential: Node
    compose: tuple[Node, ...] | None
    output: Callable[[str], Node]
    output_names: Callable[[], Sequence[str]]
    velocity_names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    idle: tuple[tuple[str, str], ...] = ()
    figure: Callable[[], Any] | None = field(default=None, repr=False)
    geometry: Geometry | None = field(default=None, repr=False)
    frictions: tuple[Friction, ...] = ()
    turns: tuple[Turn, ...] = ()
    facings: tuple[Facing, ...] = ()
    chart: Chart | None = None
    markers: tuple[str, ...] = ()
    machines: tuple[Machine, ...] = ()
    impulses: tuple[StrikeImpulse, ...] = ()
    held_forces: tuple[str, ...] = ()
    observations: tuple[tuple[str, str], ...] = ()
    anatomy: tuple[tuple[str, str], ...] = ()
    shapes: tuple[Shape, ...] = ()
    mirror: Callable[[], Mapping[str, float]] | None = field(default=None, repr=False)
    configuration: Configuration = field(default=None, repr=False)  # type: ignore[assignment]
    memory: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.configuration is None:
            names, units = [c.name for c in self.coordinates], [c.unit for c in self.coordinates]
            self.configuration = Configuration.of_vectors(names, units, [c.default for c in self.coordinates])

    @property
    def n_q(self) -> int:
        return len(self.coordinates)

    @property
    def n_v(self) -> int:
        return len(self.velocity_names)

    @property
    def n_z(self) -> int:
        return len(self.states)

    @cached_property
    def n_anchors(self) -> int:
        """Values that machines hold, then those that contacts do, then the whole turns of cut joints."""
        held = sum(len(contact.anchors) for contact in self.contacts)
        return self.n_held_by_machines + held + len(self.turns)

    @property
    def n_held_by_machines(self) -> int:
        """Anchors before those of contacts."""
        return sum(len(machine.anchors) for machine in self.machines)

    @cached_property
    def wrapped(self) -> tuple[Turn, ...]:
        """The turns that are counted along the motion."""
        return tuple(turn for turn in self.turns if turn.rate is not None)

    @property
    def tables(self) -> list[Table]:
        return self.tape.tables

    @property
    def bilateral(self) -> tuple[int, ...]:
        """Numbers of the rows that are always active."""
        return tuple(k for k, row in enumerate(self.rows) if row.contact < 0 and row.friction < 0)
