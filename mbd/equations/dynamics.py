"""The balance of forces: one reverse sweep along the bodies' velocities.

``r = Σ_bodies ∂v_Cᵀ/∂v · m (a_C − g) + ∂ωᵀ/∂v · (I α + ω × I ω) + forces on bodies + forces on coordinates``

The velocities are linear in v, so differentiating them in reverse with forces as adjoints is the principle of virtual
power; the sweep itself is the recursion of forces from the tips of the tree to the ground.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import field, replace

from mbd.bodies.algebra import cross, dot, rotate, scaled, total
from mbd.bodies.mass import MassProperties
from mbd.bodies.scope import Triple
from mbd.dataclass import dataclass
from mbd.equations.articulated_bodies import articulated_accelerations
from mbd.equations.composite_mass import MassLoop, composite_mass_matrix, mass_loop
from mbd.equations.composite_tangent import Branches, turns_by_numbers
from mbd.equations.inputs import Inputs
from mbd.equations.kinematic_proxies import KinematicProxies, Wrench
from mbd.equations.kinematics import Moving, Twist, twists
from mbd.equations.placement import Placement
from mbd.equations.tree_elimination import TreeFactors, tree_factors
from mbd.tape.derivatives import vjp
from mbd.tape.node import Node, Scalar


@dataclass
class Work:
    """Generalized forces by their virtual work, positive on the left-hand side, written in views.

    values, multipliers : Σ multiplier · δvalue of functions of t and q ⊕ x (potentials, rows, gaps)
    velocities, forces : Σ force · δvelocity of functions of the velocities (losses, motors, applied forces)
    """

    values: list[Node] = field(default_factory=list)
    multipliers: list[Scalar] = field(default_factory=list)
    velocities: list[Node] = field(default_factory=list)
    forces: list[Scalar] = field(default_factory=list)

    def on_value(self, value: Node, multiplier: Scalar) -> None:
        """Add multiplier · δvalue."""
        self.values.append(value)
        self.multipliers.append(multiplier)

    def on_velocity(self, velocity: Node, force: Scalar) -> None:
        """Add force · δvelocity."""
        self.velocities.append(velocity)
        self.forces.append(force)

    def key(self) -> Hashable:
        """Equal for the same work on the same tape."""
        parts = (self.values, self.multipliers, self.velocities, self.forces)
        return tuple(tuple(("node", p.index) if isinstance(p, Node) else p for p in part) for part in parts)

    def __add__(self, other: Work) -> Work:
        return Work(
            self.values + other.values, self.multipliers + other.multipliers,
            self.velocities + other.velocities, self.forces + other.forces,
        )  # fmt: skip


class Dynamics:
    """Masses on a tree of moving bodies."""

    def __init__(
        self,
        bodies: Sequence[Moving],
        masses: Mapping[str, MassProperties],
        placement: Placement,
        views: KinematicProxies,
        inputs: Inputs,
    ) -> None:
        self._bodies, self._masses, self._inputs = bodies, masses, inputs
        self._placement, self._views, self._tape = placement, views, placement.tape
        self._twists = twists(bodies)
        self._composites: Branches | None = None
        self._balances: dict[Hashable, list[Node]] = {}
        self._inertia = [pull for body in bodies if body.parent is not None for pull in self._inertia_of(body)]

    def balance(self, work: Work) -> list[Node]:
        """M a + f of the bodies and of other forces (length n_v)."""
        key = work.key()
        if key not in self._balances:  # residual, tangent and correction of a mode ask for the same
            pulls_on, direct = self._read(work)
            self._balances[key] = self._gather([*self._inertia, *pulls_on], direct)
        return list(self._balances[key])

    def tangent(self, work: Work, rests: Sequence[Node]) -> list[list[Node]] | None:
        """The columns of S = M + c_C C + c_K K of a planar tree from quantities of branches.

        None where a coordinate does not turn its body by a number.

        Parameters
        ----------
        rests : the rows of r that belong to first-order states (n_z)
        """
        branches = self._branches(len(rests))
        if branches is None:
            return None
        pulls, direct = self._read(work)
        pulls = [pull for pull in pulls if pull.carrier.parent is not None]
        n = len(direct)
        S = []
        for line in branches.changes(pulls, [*direct, *rests]):
            S.append([*_sums(line[:n], line[n : 2 * n]), *line[2 * n :]])
        for column, entries in zip(S[:n], branches.tangent([*self._inertia, *pulls]), strict=True):
            column[:n] = _sums(entries, column[:n])
        return S

    def eliminated(self, work: Work) -> TreeFactors | None:
        """S eliminated from the tips of the tree, see `tree_factors`; None where a force acts on a body."""
        pulls, direct = self._read(work)
        if any(pull.carrier.parent is not None for pull in pulls):
            return None
        return tree_factors(self._bodies, self._inertia_of, direct, self._inputs, self._tape)

    def _branches(self, n_z: int) -> Branches | None:
        """Quantities of branches, the same for all forces."""
        if self._composites is None and turns_by_numbers(self._bodies, self._tape):
            z, s = (tuple(self._tape.input(kind, k) for k in range(n_z)) for kind in "zs")
            inputs = replace(self._inputs, z=z, s=s)
            self._composites = Branches(self._bodies, self._masses, self._placement, inputs)
        return self._composites

    def generalized(self, work: Work) -> list[Node]:
        """The forces alone, without the bodies' inertia and weight (length n_v)."""
        pulls_on, direct = self._read(work)
        return self._gather(pulls_on, direct)

    def mass_matrix(self) -> list[list[Node]]:
        """M of the bodies, line by line (n_v × n_v)."""
        return composite_mass_matrix(self._bodies, self._masses, len(self._inputs.v), self._tape)

    def mass_loop(self) -> MassLoop | None:
        """The same as a loop, see `mbd.equations.composite_mass`."""
        return mass_loop(self._bodies, self._masses, len(self._inputs.v), self._tape)

    def accelerations(self, forces: Sequence[Node]) -> tuple[list[Node], Node] | None:
        """v̇ with M v̇ = forces, see `articulated_accelerations`."""
        return articulated_accelerations(self._bodies, self._masses, forces, self._tape)

    def joint_wrench(self, body: Moving, work: Work) -> tuple[Triple, Triple]:
        """Force and torque that a body needs at its joint, in body axes: the residual conjugate to a virtual motion.

        The body and everything beyond it are moved rigidly by six increments at the joint; forces on coordinates
        (springs, losses, motors, stops of the joint itself) do no work on them.
        """
        increments = [self._tape.input("virtual", k) for k in range(6)]
        turn, shift = increments[:3], increments[3:]
        extra = {body.body.name: Twist((turn[0], turn[1], turn[2]), (shift[0], shift[1], shift[2]))}
        pulls_on, _ = self._read(work, attributed=True)
        tx, ty, tz, fx, fy, fz = self._sweep([*self._inertia, *pulls_on], twists(self._bodies, extra), increments)
        return (fx, fy, fz), (tx, ty, tz)

    def _inertia_of(self, body: Moving) -> list[Wrench]:
        """Force m (a_C − g) at the center, torque I α + ω × I ω."""
        mass = self._masses[body.body.name]
        force = scaled(mass.mass, body.acceleration_at(mass.center))
        momentum = rotate(mass.inertia, body.angular_velocity)
        torque = total(rotate(mass.inertia, body.angular_acceleration), cross(body.angular_velocity, momentum))
        return [Wrench(body, mass.center, force, torque)]

    def _read(self, work: Work, attributed: bool = False) -> tuple[list[Wrench], list[Node]]:
        """Forces on bodies, and forces on coordinates."""
        x, v, pulls = self._inputs.x, self._inputs.v, self._views.pulls
        still, on_x = pulls(work.values, work.multipliers, x, motion=False, attributed=attributed)
        moving, on_v = pulls(work.velocities, work.forces, v, motion=True, attributed=attributed)
        on_x = self._inputs.along_velocities(on_x)
        return still + moving, [a + b for a, b in zip(on_x, on_v, strict=True)]

    def _gather(self, forces: Sequence[Wrench], direct: Sequence[Node]) -> list[Node]:
        swept = self._sweep(forces, self._twists, self._inputs.v)
        return [a + b for a, b in zip(swept, direct, strict=True)]

    def _sweep(self, forces: Sequence[Wrench], motion: Mapping[str, Twist], inputs: Sequence[Node]) -> list[Node]:
        """The reverse sweep."""
        velocities: list[Scalar] = []
        adjoints: list[Scalar] = []
        for pull in forces:
            twist = motion[pull.carrier.body.name]
            velocities += [*total(twist.linear, cross(twist.angular, pull.place)), *twist.angular]
            adjoints += [*pull.force, *pull.torque]
        lift = self._tape.lift
        outputs = [lift(velocity) for velocity in velocities]
        return vjp(outputs, adjoints, inputs) if outputs else [self._tape.zero] * len(inputs)

    def kinetic(self) -> Node:
        """T = Σ ½ m v_C² + ½ ω·I ω [J]."""
        energy: Scalar = 0.0
        for body in self._bodies:
            if body.parent is None:
                continue
            mass, twist = self._masses[body.body.name], self._twists[body.body.name]
            v = total(twist.linear, cross(twist.angular, mass.center))
            energy = energy + 0.5 * (mass.mass * dot(v, v) + dot(twist.angular, rotate(mass.inertia, twist.angular)))
        return self._tape.lift(energy)

    def weight_energy(self, gravity: Triple) -> Node:
        """−Σ m g·p_C [J], in views."""
        energy: Scalar = 0.0
        for body in self._bodies:
            if body.parent is not None and any(not self._tape.lift(part).is_zero for part in gravity):
                mass = self._masses[body.body.name]
                center = self._views.position(self._placement.point(body, mass.center))
                energy = energy - mass.mass * dot(gravity, center)
        return self._tape.lift(energy)


def _sums(one: Sequence[Node], other: Sequence[Node]) -> list[Node]:
    """Sums of many nodes, most of which are zero."""
    return [b if a.is_zero else a if b.is_zero else a + b for a, b in zip(one, other, strict=True)]
