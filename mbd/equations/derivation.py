"""From a model in words to its equations of motion."""

from collections.abc import Sequence
from functools import cached_property, partial
from typing import Protocol, runtime_checkable

from mbd.bodies.algebra import dot, norm
from mbd.bodies.domains import ParameterCheck
from mbd.dataclass import dataclass
from mbd.equations.changes import partials, rates
from mbd.equations.composite_mass import MassLoop
from mbd.equations.contacts import anchors_held, laws
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.dynamics import Dynamics, Work
from mbd.equations.effects import causes, effect_of, weight_of
from mbd.equations.equations import ActingForces, Equations, Facing
from mbd.equations.figure import figure_of, shown_markers
from mbd.equations.gathered import Gathered
from mbd.equations.held_forces import HeldForces, held_force_faults
from mbd.equations.impulses import impulses_of
from mbd.equations.kinematic_proxies import KinematicProxies, View
from mbd.equations.kinks import kinks
from mbd.equations.laws import Laws
from mbd.equations.machines import declare_machines, machine_guards
from mbd.equations.magnitudes import of_directions
from mbd.equations.observations import offer_observations
from mbd.equations.outputs import Outputs
from mbd.equations.placement import Placement, Point
from mbd.equations.results import offer_results
from mbd.equations.shapes import offer_shapes, shapes_of
from mbd.equations.sizes import require_room
from mbd.equations.solids import offer_solids, solids_of
from mbd.equations.states import state_balance
from mbd.equations.switching_times import table_faults
from mbd.equations.tree_elimination import TreeFactors
from mbd.equations.whole_body import offer_whole_body
from mbd.errors import ModelError
from mbd.forces.rotor import Rotor
from mbd.joints.reflected import signs_in_a_mirror
from mbd.tape.derivatives import gradient, live
from mbd.tape.functions import cos
from mbd.tape.node import Node, Scalar
from mbd.topology.check import require_valid
from mbd.topology.description import Description
from mbd.topology.plan import Plan, plan


@runtime_checkable
class FrontDoor(Protocol):
    """Anything that knows its own equations of motion, such as `Lagrangian`."""

    def equations_of_motion(self) -> Equations:
        """The equations."""

    def parameter_check(self) -> ParameterCheck:
        """The judgement of values of its parameters."""


def derive(model: Description | FrontDoor, chosen: Plan | None = None) -> Equations:
    """The equations of motion ``M a + f + Bᵀ λ = 0``, ``h = 0`` of a model.

    Parameters
    ----------
    model : a `Model`, or another front door; all its faults are raised together as a `ModelError`
    chosen : which joints of a `Model` are cut, in place of what it says itself
    """
    if isinstance(model, FrontDoor):
        equations = model.equations_of_motion()
    else:
        require_valid(model)
        chosen = plan(model) if chosen is None else chosen
        require_room(chosen)
        equations = _derived(model, chosen)
    if faults := table_faults(equations):
        raise ModelError(faults)
    return equations


def derivation_faults(model: Description | FrontDoor) -> list[str]:
    """What the derivation of a model refuses whose description has no fault of its own, one sentence each."""
    gathered = Gathered()
    with gathered.catch():
        derive(model)
    return [fault for error in gathered.errors for fault in getattr(error, "faults", (str(error),))]


def _derived(
    model: Description, plan: Plan, carried: Sequence[tuple[str, int]] = (), first: Equations | None = None
) -> Equations:
    """Kinematics, causes of forces, balance, constraints, results.

    Angles of cut joints that forces, rows, contacts, events or controllers depend on, and that only a rotation shows,
    are `carried` as coordinates of their own in a second derivation. Laws that read forces of constraints know their
    rows from the `first` one.
    """
    written = {name for controller in model.controllers for name in controller.writes}
    tunable = {*model.tunable, *written}  # what a controller writes is no constant, whatever it begins with
    scope = DerivationContext(model.ground, plan.edges, plan.cut, model.gravity, tunable, plan.planar, carried)
    scope.held_force = held = HeldForces(model, scope, first)
    declare_machines(scope, model.machines, scope.quantities.value)
    scope.offer_frames(model.frames.values())
    scope.parameters.expect(model.parameters)
    if plan.planar and plan.cut:
        scope.count_turns(scope.first_anchor + anchors_held(scope, model.contacts))
    elif plan.cut:
        scope.count_turns_in_space(scope.first_anchor + anchors_held(scope, model.contacts))
    moving = list(scope.bodies.values())
    vectors = all(joint.is_vector for joint in plan.edges)
    masses = {body.body.name: body.body.mass_properties(scope) for body in moving}
    dynamics = Dynamics(moving, masses, scope.placement, scope.views, scope.inputs)
    scope.offer_inertia(dynamics, [force for force in model.forces if isinstance(force, Rotor)])
    gathered = Gathered()
    found = causes(scope, (*plan.edges, *plan.cut), model.forces, gathered)
    work = sum((cause.work + cause.inertia for cause in found), Work())
    kinetic = sum((cause.kinetic for cause in found if cause.kinetic is not None), dynamics.kinetic())
    found = [cause for cause in found if cause.works]
    joints = (*plan.edges, *plan.cut)
    always = [*model.bilaterals, *model.nonholonomic]
    constraints = laws(scope, dynamics, joints, always, model.contacts, model.events, gathered, written=written)
    with gathered.catch():
        constraints.take_machines(
            *machine_guards(scope, model.machines, model.contacts, model.events, model.parameters)
        )
    constraints.impulses += impulses_of(scope, dynamics, model.impulses, model.contacts, gathered)
    rests: list[Node] = []
    rates = [*(pair for cause in found for pair in cause.rates), *constraints.rates]
    with gathered.catch():
        rests = state_balance(scope, rates)
        constraints.guards += kinks(scope, found, constraints)
    gathered.raise_all()
    weight = weight_of(scope, dynamics)
    stored = [weight, *found] if weight.acts else found
    effects = (*(effect_of(cause, scope, dynamics) for cause in stored), *constraints.effects)
    potential = scope.tape.zero
    for effect in effects:
        potential = potential if effect.potential is None else potential + effect.potential
    balance = [*dynamics.balance(work), *rests]
    outputs = Outputs(scope.tape, scope.quantities, scope.real)
    equations = Equations(
        name=model.name, tape=scope.tape, coordinates=scope.coordinates,
        states=tuple(coordinate for coordinate, _ in scope.states), parameters=scope.parameters.found,
        balance=tuple(balance), rows=tuple(constraints.rows), contacts=tuple(constraints.contacts),
        guards=tuple(constraints.guards), effects=effects, kinetic=kinetic, potential=potential,
        compose=None if vectors else scope.composed, chart=scope.inputs.chart, configuration=scope.configuration,
        idle=tuple(constraints.idle), output=outputs, output_names=outputs.names,
        velocity_names=scope.configuration.velocity_names, notes=plan.notes,
        figure=figure_of(model), markers=shown_markers(model),
        observations=tuple((each.name, each.unit) for each in model.observations),
        anatomy=tuple((each.name, each.anatomy) for each in model.joints if each.anatomy),
        shapes=(*shapes_of(model), *(() if plan.planar else solids_of(model))),
        mirror=None if plan.planar else partial(signs_in_a_mirror, plan.edges, model.gravity),
        machines=tuple(constraints.machines), impulses=tuple(constraints.impulses),
        geometry=TreeGeometry(scope, dynamics, work, rests, constraints, plan.planar and vectors and not carried),
        frictions=tuple(constraints.frictions), turns=(*scope.turns.values(), *scope.wrapped.values()),
        facings=_facings(scope, constraints), held_forces=tuple(held.asked),
    )  # fmt: skip
    seen = () if carried else _wrapped(scope, equations, model)
    if seen or (held.asked and first is None):
        return _derived(model, plan, seen or carried, equations if held.asked and not seen else None)
    if held.asked and (faults := held_force_faults(equations, held.asked)):
        raise ModelError(faults)
    scope.held_force = held.asked.get  # results ask again; equations outlive the model, which `held` knows
    whole = work + _closed(scope, constraints)
    offer_results(outputs, scope, dynamics, whole, equations, model, {joint.name for joint in plan.floating})
    offer_whole_body(outputs, scope, masses)
    offer_observations(outputs, scope, model.observations)
    offer_shapes(outputs, scope, model)
    if not plan.planar:
        offer_solids(outputs, scope, model)
    return equations


def _wrapped(scope: DerivationContext, equations: Equations, model: Description) -> list[tuple[str, int]]:
    """(joint, number) of the angles of cut joints that jump by a turn, and on which the motion depends.

    So does a controller that reads one. A `Bilateral` on the joint alone compares modulo a turn and needs no more.
    """
    angles: dict[int, tuple[str, int]] = {}
    for joint in scope.cuts:
        known = scope.joint(joint.name).coordinates if joint.labels and joint.is_vector else ()
        for k, value in enumerate(known):
            node = scope.real(value)
            if scope.is_wrapped(joint, k, node):
                angles[node.index] = joint.name, k
    if not angles:
        return []
    nodes = [*equations.balance, equations.potential, *(row.value for row in equations.rows if not row.wraps)]
    nodes += [row.rate for row in equations.rows if row.is_velocity] + [f.sliding for f in equations.frictions]
    for contact in equations.contacts:
        nodes += [each for each in (contact.gap, contact.force, contact.only_while) if isinstance(each, Node)]
        nodes += [force for _, _, force in contact.drags]
    nodes += [guard.value for guard in equations.guards]
    nodes += [effect.power for effect in equations.effects if effect.power is not None]
    read = {name for controller in model.controllers for name in controller.reads}
    labels = {joint.name: joint.labels for joint in scope.cuts}
    found = {angles[node.index] for node in live(nodes) if node.index in angles}
    found |= {(joint, k) for joint, k in angles.values() if f"{joint}.{labels[joint][k].name}" in read}
    return sorted(found)


def _facings(scope: DerivationContext, constraints: Laws) -> tuple[Facing, ...]:
    """Of cut joints with rows on directions that are not angles themselves."""
    found = []
    for joint in scope.cuts:
        owned = [k for k, row in enumerate(constraints.rows) if row.owner == joint.name and row.contact < 0]
        owned = [k for k in owned if not constraints.rows[k].part.startswith("turns of")]
        rows = tuple(k for k in owned if constraints.rows[k].unit == "rad" and constraints.rows[k].friction < 0)
        if rows and joint.is_vector and joint.name not in scope.turns:
            R, p = scope.relative(joint)
            S, _ = joint.transform(joint.recover(R, p, scope), scope)
            trace = sum((dot(a, b) for a, b in zip(S, R, strict=True)), scope.tape.zero)
            found.append(Facing(joint.name, rows, scope.real(0.5 * (trace - 1.0))))
    for name, k in scope.carried:
        joint = next(each for each in scope.cuts if each.name == name)
        part = f"turns of {joint.labels[k].name}"
        row = next(i for i, each in enumerate(constraints.rows) if (each.owner, each.part) == (name, part))
        off = scope.read(joint)[k] - scope.own_angle(name, k)
        found.append(Facing(f"{name}.{joint.labels[k].name}", (row,), scope.real(cos(off))))
    return tuple(found)


def _closed(scope: DerivationContext, constraints: Laws) -> Work:
    """The work of every row, and of every penalty contact behind its switch."""
    work = Work()
    for k, (row, view) in enumerate(zip(constraints.rows, constraints.viewed, strict=True)):
        if row.friction >= 0:  # λ_T along the direction of now, not along that at the anchor
            work.on_velocity(constraints.sliding[row.friction], scope.tape.input("lam", k))
            continue
        act = work.on_velocity if row.is_velocity else work.on_value
        act(view, scope.tape.input("lam", k))
    for number, gap, force in constraints.penalties:
        act = work.on_velocity if constraints.contacts[number].is_velocity else work.on_value
        act(gap, -(scope.tape.input("switch", number) * force))
    for number, velocity, force in constraints.drags:
        by_rows = constraints.contacts[number].force is None  # its force follows the multiplier of the normal row
        work.on_velocity(velocity, -force if by_rows else -(scope.tape.input("switch", number) * force))
    return work


@dataclass(frozen=True)
class TreeGeometry:
    """`mbd.equations.equations.Geometry` of a tree of bodies; `planar` if so, with coordinates that add."""

    scope: DerivationContext
    dynamics: Dynamics
    work: Work
    rests: Sequence[Node]
    constraints: Laws
    planar: bool

    @property
    def depth(self) -> float:
        """How many coordinates move a body, on average."""
        paths = [len(body.path) for body in self.scope.bodies.values() if body.parent is not None]
        return sum(paths) / max(1, len(paths))

    @cached_property
    def largest_tree(self) -> int:
        """Coordinates of the largest tree, as bodies that fixed ones alone connect are apart."""
        trees: dict[int, set[int]] = {}
        for body in self.scope.bodies.values():
            if body.path:
                trees.setdefault(body.path[0], set()).update(body.path)
        return max(map(len, trees.values()), default=0)

    def balance_with(self, forces: ActingForces) -> list[Node]:
        """The balance with forces on these values and velocities in the same reverse sweep."""
        work = self.work + self._viewed(forces)
        return [*self.dynamics.balance(work), *self.rests]

    def forces(self, forces: ActingForces) -> list[Node]:
        """What `balance_with` adds to the balance."""
        pushed = self.dynamics.generalized(self._viewed(forces))
        return [*pushed, *([self.scope.tape.zero] * len(self.rests))]

    def tangent(self, forces: ActingForces) -> list[list[Node]] | None:
        """The columns of S of the same balance from quantities of branches: of planar trees whose coordinates add."""
        if not self.planar:
            return None
        return self.dynamics.tangent(self.work + self._viewed(forces), self.rests)

    def eliminated(self, forces: ActingForces) -> TreeFactors | None:
        """S of the same balance eliminated from the tips of the tree, or None where it is no sum over joints."""
        if self.rests:
            return None
        return self.dynamics.eliminated(self.work + self._viewed(forces))

    def _viewed(self, forces: ActingForces) -> Work:
        """Forces on values and velocities, written in views."""
        laws = self.constraints
        rows = list(zip(laws.rows, laws.viewed, strict=True))
        viewed = {row.value.index: view for row, view in rows if not row.is_velocity}
        moving = {row.rate.index: view for row, view in rows if row.is_velocity}
        moving |= {f.rate.index: view for f, view in zip(laws.frictions, laws.sliding, strict=True)}
        for number, gap, _ in laws.penalties:
            (moving if laws.contacts[number].is_velocity else viewed)[laws.contacts[number].gap.index] = gap
        reals = [velocity for contact in laws.contacts for _, velocity, _ in contact.drags]
        moving |= {real.index: view for real, (_, view, _) in zip(reals, laws.drags, strict=True)}
        return Work(
            [viewed.get(value.index, value) for value in forces.values], list(forces.multipliers),
            [moving.get(rate.index, rate) for rate in forces.rates], list(forces.along_rates),
        )  # fmt: skip

    def mass_matrix(self) -> list[list[Node]] | None:
        """M of the bodies, where no force and no state depends on accelerations."""
        return self.dynamics.mass_matrix() if self._inertia_alone else None

    def mass_loop(self) -> MassLoop | None:
        """The same as a loop, where its entries are many."""
        return self.dynamics.mass_loop() if self._inertia_alone else None

    @cached_property
    def _inertia_alone(self) -> bool:
        """Whether no force and no state depends on accelerations."""
        forces = [contact.force for contact in self.constraints.contacts if contact.force is not None]
        forces += [force for contact in self.constraints.contacts for _, _, force in contact.drags]
        forces += [friction.sliding for friction in self.constraints.frictions]
        inside = live([*self.dynamics.generalized(self.work), *forces])
        return not self.rests and not any(node.op == "input" and node.data[0] == "a" for node in inside)

    def accelerations(self, forces: Sequence[Node]) -> tuple[list[Node], Node] | None:
        """v̇ with M v̇ = forces from the tips of the tree, where M is that of `mass_matrix`."""
        return self.dynamics.accelerations(forces) if self._inertia_alone else None

    def partials(self, outputs: Sequence[Node]) -> list[dict[Node, Node]]:
        """∂node/∂x_j of the places and rotations inside the outputs."""
        return [*partials(self.scope.placement, outputs), *({} for _ in self.scope.carried)]

    def row_sizes(self, row: int) -> list[Node]:
        """Σ|parts| of the derivative of a row by each coordinate, before they cancel."""
        laws, scope = self.constraints, self.scope
        moving = laws.rows[row].is_velocity
        inputs = scope.inputs.v if moving else scope.inputs.x
        return _row_sizes(scope.placement, scope.views, laws.viewed[row], inputs, moving)

    def amplitudes(self) -> dict[int, float]:
        """How large elements of rotations can be, where joints turn by quaternions."""
        bodies = self.scope.bodies.values()
        if all(body.edge is None or body.edge.joint.is_vector for body in bodies):
            return {}
        turns = of_directions(element for body in bodies for row in body.turn for element in row)
        return turns | of_directions(self.scope.placement.directions())

    def rates(self, outputs: Sequence[Node]) -> dict[Node, Node]:
        """d node/dt of the places and rotations inside the outputs."""
        return rates(self.scope.placement, outputs)


# How large the parts of a row's Jacobian are before they cancel.
#
# A row is written in places and directions of bodies (views). Its derivative by a coordinate x_j is the sum over these
# of ``∂h/∂view · ∂view/∂x_j``, with ``∂p/∂x_j = û_j + ω̂_j × (p − o_j)`` and ``∂R/∂x_j = ω̂_j × R``. The sizes
#
# ``Σ |∂h/∂view| · (|û_j| + |ω̂_j| (|p| + |o_j|))`` for places,  ``Σ |∂h/∂view| · |ω̂_j|`` for directions
#
# do not vanish where the parts cancel, as those of two frames on one axis do: what is left of a derivative below its
# round-off says that the row does not depend on x_j at all.


def _row_sizes(
    placement: Placement, views: KinematicProxies, viewed: Node, inputs: Sequence[Node], motion: bool
) -> list[Node]:
    """Σ|parts| of the derivative of a row by each coordinate.

    Parameters
    ----------
    viewed : the value of the row in views, or the rate of one on velocities
    inputs : x, or v of a row on velocities
    motion : whether the row holds velocities
    """
    inside = [view for view in views.inside([viewed]) if view.motion == motion]
    slopes = [abs(slope) for slope in views.real(gradient(viewed, [*inputs, *(view.node for view in inside)]))]
    sizes: list[Scalar] = list(slopes[: len(inputs)])
    for view, slope in zip(inside, slopes[len(inputs) :], strict=True):
        for j in view.of.carrier.path:
            sizes[j] = sizes[j] + slope * _motion(placement, view, j)
    return [placement.tape.lift(size) for size in sizes]


def _motion(placement: Placement, view: View, j: int) -> Scalar:
    """How far coordinate j moves a place or turns a direction, without cancellation."""
    mover = placement.movers[j]
    assert mover.edge is not None
    column = placement.columns(mover)[j - mover.edge.first]
    turn = norm(column.angular)
    if not isinstance(view.of, Point):
        return turn
    return norm(column.linear) + turn * (norm(view.of.position) + norm(placement.joint(mover).position))
