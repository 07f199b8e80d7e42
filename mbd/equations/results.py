"""The named results of a model of bodies."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import partial

from mbd.bodies.base import Frame
from mbd.bodies.scope import Triple
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.dynamics import Dynamics, Work
from mbd.equations.equations import Contact, Effect, Equations, Row
from mbd.equations.net_moments import offer_net_moments
from mbd.equations.outputs import AXES, Outputs
from mbd.equations.reactions import Wrench, reaction
from mbd.forces.base import Force
from mbd.joints.base import Joint, Label
from mbd.tape.node import Node, Scalar, Tape
from mbd.topology.description import Description


def offer_results(
    outputs: Outputs,
    scope: DerivationContext,
    dynamics: Dynamics,
    work: Work,
    equations: Equations,
    model: Description,
    hidden: Collection[str],
) -> None:
    """Everything that a run can be asked for besides what words may ask for.

    work : all forces, with all rows and penalties; hidden : names of joints that no user made
    """
    tape, rows, contacts = scope.tape, equations.rows, equations.contacts
    offer_rows(outputs, tape, rows)
    offer_contacts(outputs, tape, rows, contacts)
    offer_effects(outputs, tape, equations.effects)
    _offer_forces(outputs, scope, model.forces)
    acting = {effect.name for effect in equations.effects} - {force.name for force in model.forces}
    _offer_losses_and_springs(outputs, scope, acting)
    for name, energy in ("kinetic_energy", equations.kinetic), ("potential_energy", equations.potential):
        outputs.value(name, energy)
    _offer_joints(outputs, scope, dynamics, work, rows, hidden)
    offer_net_moments(outputs, equations, [force.name for force in model.forces if force.is_external])
    for frame in model.markers:
        accelerations = [f"a{axis}" for axis in AXES]
        outputs.triple(frame.full_name, partial(_frame_acceleration, scope, frame), accelerations)


def _offer_joints(
    outputs: Outputs,
    scope: DerivationContext,
    dynamics: Dynamics,
    work: Work,
    rows: Sequence[Row],
    hidden: Collection[str],
) -> None:
    """Accelerations and reactions of the joints; `hidden` are those that no user made."""
    known: dict[str, Wrench] = {}

    def part(joint: Joint, kind: str) -> Triple:
        if joint.name not in known:
            known[joint.name] = reaction(joint, scope, dynamics, work, rows)
        return known[joint.name].force if kind == "force" else known[joint.name].torque

    for joint in (*scope.tree, *scope.cuts):
        for k, label in enumerate(joint.freedoms):
            name = f"{joint.name}.{label.name}.acceleration"
            outputs.add(name, partial(_acceleration, scope, joint.name, k))
        if len(joint.freedoms) == 1:
            outputs.add(f"{joint.name}.acceleration", partial(_acceleration, scope, joint.name, 0))
        if joint.name not in hidden:
            outputs.triple(f"{joint.name}.reaction_force", partial(part, joint, "force"))
            outputs.triple(f"{joint.name}.reaction_torque", partial(part, joint, "torque"))


def _acceleration(scope: DerivationContext, joint: str, place: int) -> Scalar:
    return scope.change(scope.joint(joint).rates[place])


def _frame_acceleration(scope: DerivationContext, frame: Frame) -> Triple:
    x, y, z = (scope.change(rate) for rate in scope.frame(frame).velocity)
    return x, y, z


def offer_rows(outputs: Outputs, tape: Tape, rows: Sequence[Row]) -> None:
    """Multiplier and residual of each bilateral row; tension of rods, force or torque that drives a joint.

    A row on velocities has its rate as residual, and the force −λ along the row.
    """
    for k, row in enumerate(rows):
        if row.contact >= 0 and not row.is_velocity:
            continue
        multiplier = tape.input("lam", k)
        if row.friction >= 0:
            outputs.value(f"{row.owner}.friction", -multiplier)
            continue
        name = f"{row.owner}.{row.part}" if row.part else row.owner
        outputs.value(f"{name}.multiplier", multiplier)
        outputs.value(f"{name}.residual", row.rate if row.is_velocity else row.value)
        if row.is_velocity:
            outputs.value(f"{name}.force", -multiplier)
        if row.reaction == "drive":
            outputs.value(f"{name}.{'torque' if row.unit == 'rad' else 'force'}", -multiplier)
        elif row.reaction == "tension":
            outputs.value(f"{name}.tension", multiplier)
            outputs.value(f"{name}.force", multiplier)


def offer_contacts(outputs: Outputs, tape: Tape, rows: Sequence[Row], contacts: Iterable[Contact]) -> None:
    """Force (≥ 0 pushes), friction (of the ground on the body), gap and its rate."""
    for number, contact in enumerate(contacts):
        outputs.value(f"{contact.name}.gap", contact.gap)
        if contact.foot:
            outputs.triple(f"{contact.name}.foot", partial(tuple, contact.foot))
        outputs.value(f"{contact.name}.gap_rate", contact.gap_rate)
        if contact.force is not None:
            outputs.value(f"{contact.name}.force", tape.input("switch", number) * contact.force)
            for part, _, force in contact.drags:
                outputs.value(f"{contact.name}.{part}", tape.input("switch", number) * force)
            continue
        along: dict[str, Node] = {}
        for k in contact.rows:
            push = -tape.input("lam", k)
            if rows[k].part == "normal":
                outputs.value(f"{contact.name}.force", push)
            elif (rows[k].part, rows[k].unit) == ("spin", "rad"):
                outputs.value(f"{contact.name}.spin.torque", push)
            else:
                along[rows[k].part] = push
        for part, _, force in contact.drags:
            along[part] = along[part] + force if part in along else force
        for part, push in along.items():
            outputs.value(f"{contact.name}.friction", push)
            outputs.value(f"{contact.name}.friction.{part}", push)


def offer_effects(outputs: Outputs, tape: Tape, effects: Iterable[Effect]) -> None:
    """Power of what does work, energy of what stores it."""
    for effect in effects:
        switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
        if effect.power is not None:
            outputs.value(f"{effect.name}.power", switch * effect.power)
        if effect.potential is not None:
            outputs.value(f"{effect.name}.energy", effect.potential)


def _offer_losses_and_springs(outputs: Outputs, scope: DerivationContext, acting: Collection[str]) -> None:
    """Torque or force of the losses of joints and of their linear springs, positive along the coordinate."""
    for joint in (*scope.tree, *scope.cuts):
        alone = len(joint.freedoms) == 1
        if f"{joint.name} loss" in acting:
            for place in sorted({place for place, _, _ in joint.losses()}):
                label = joint.freedoms[place]
                name = f"{joint.name} loss" if alone else f"{joint.name} loss.{label.name}"
                outputs.add(f"{name}.{_effort(label)}", partial(_resistance, scope, joint, place))
        if alone and len(joint.labels) == 1 and f"{joint.name} spring" in acting:
            outputs.add(f"{joint.name} spring.{_effort(joint.labels[0])}", partial(_pull, scope, joint))


def _effort(label: Label) -> str:
    return "torque" if label.unit == "rad" else "force"


def _resistance(scope: DerivationContext, joint: Joint, place: int) -> Scalar:
    return -joint.resistance(scope.joint(joint.name).rates, scope)[place]


def _pull(scope: DerivationContext, joint: Joint) -> Scalar:
    """−k (q − rest)."""
    (q,) = scope.joint(joint.name).coordinates
    owner = f"{joint.name} spring"
    stretch = q - scope.parameter(owner, "rest", joint.rest)
    return -scope.parameter(owner, "stiffness", joint.stiffness) * stretch


def _offer_forces(outputs: Outputs, scope: DerivationContext, forces: Iterable[Force]) -> None:
    """What forces tell of themselves: the torque of a motor, the force of a spring."""
    for force in forces:
        for field, result in force.results().items():
            name, make = f"{force.name}.{field}", partial(result.value, scope)
            if result.is_vector:
                outputs.triple(name, make)  # type: ignore[arg-type]
            else:
                outputs.add(name, make)  # type: ignore[arg-type]
