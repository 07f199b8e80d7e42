"""Laws of forces."""

from collections.abc import Iterable
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.errors import ModelError
from mbd.forces.base import Action, Force
from mbd.joints.base import Joint
from mbd.tape.derivatives import gradient, jvp
from mbd.tape.node import Node, Scalar
from mbd.testing.equations import equation_laws
from mbd.testing.findings import Findings, Verdict
from mbd.testing.measures import Build, balance, between, relates_bodies, scope_of, turn_of, unsaid
from mbd.testing.scope import FreeScope


def check_force(
    force: Force | Build,
    *,
    internal: bool | None = None,
    joints: Iterable[Joint] = (),
    frames: Iterable[Frame] = (),
    postures: int = 8,
    seed: int = 0,
) -> Verdict:
    """A force between bodies balances itself, a loss loses, a potential is one, and tangents are exact.

    Parameters
    ----------
    force : a force, or a function ``factory(a, b, hinge)`` that makes one from frames of two bodies and a joint named
        'hinge' between them; a factory is also tried inside a small mechanism
    internal : whether it acts between the bodies it mentions, so that action equals reaction and turning the whole
        scene changes nothing; None: where it mentions a joint, or frames of two moving bodies
    joints, frames : those that an instance refers to by name only
    postures : how many random postures and rates of the bodies are tried

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    """
    factory, made = None, force
    if not isinstance(force, Force):
        factory = force
        made, hinge, places = between(factory)
        joints, frames = [*joints, hinge], [*frames, *places]
    if not isinstance(made, Force):
        raise ModelError(f"check_force takes a force or a function (a, b, hinge) that makes one; got {made!r}")
    findings = Findings(f"force {type(made).__name__} '{made.name}'")
    mentions = made.mentions()
    scope = scope_of(mentions, joints, frames)
    action = made.act(scope)
    _words(findings, made, scope, action)
    if internal is None:
        internal = relates_bodies(mentions)
    rng = np.random.default_rng(seed)
    effort = generalized(action, scope)
    for k in range(postures):
        scope.scatter(rng)
        findings.where = f"random places and rates of {', '.join(scope.bodies)} (seed {seed}, posture {k})"
        _passivity(findings, made, action, scope)
        _tangent(findings, scope, effort)
        if internal:
            hint = (
                "each force on one body needs its opposite on the other, in the line of action; or pass internal=False"
            )
            balance(
                findings,
                "action = reaction: the forces on all bodies balance",
                scope,
                np.array(scope.value(*effort)),
                "",
                hint,
            )
            _invariance(findings, action, scope, rng)
    findings.where = f"seed {seed}"
    if factory is not None and not findings.broken:
        _mechanics(findings, factory, seed)
    return findings.verdict()


def generalized(action: Action, scope: FreeScope) -> list[Node]:
    """−f: the virtual work per unit rate of every coordinate; forces of pairs are held fixed."""
    q, v = scope.all_coordinates, scope.all_rates
    total: list[Node] = [scope.tape.zero] * len(v)
    for velocity, value in action.pairs:
        total = [a + b * value for a, b in zip(total, gradient(scope.tape.lift(velocity), v), strict=True)]
    for function, inputs in (action.potential, q), (action.dissipation, v):
        if function is not None:
            total = [a - b for a, b in zip(total, gradient(scope.tape.lift(function), inputs), strict=True)]
    return total


def power(action: Action, scope: FreeScope) -> Node:
    """What pairs and the dissipation function give to the bodies [W]."""
    total: Scalar = 0.0
    for velocity, value in action.pairs:
        total = total + velocity * value
    if action.dissipation is not None:
        v = scope.all_rates
        (lost,) = jvp([scope.tape.lift(action.dissipation)], dict(zip(v, v, strict=True)))
        total = total - lost
    return scope.tape.lift(total)


def _words(findings: Findings, force: Force, scope: FreeScope, action: Action) -> None:
    own = {name: value for name, value in scope.recorded.items() if name.startswith(f"{force.name}.")}
    declared = force.parameters()
    hint = "parameters() must name every scope.parameter(…) with the same value"
    sentence = f"used {own}, declared {declared}"
    findings.holds("parameters are declared before they are used", own == declared, sentence, hint)
    left = unsaid(force.mentions(), scope)
    hint = "mentions() must list every frame, joint and name that act() asks for"
    findings.holds("mentions are complete", not left, f"not mentioned: {', '.join(left)}", hint)
    faults = force.faults()
    findings.holds("it finds no fault with itself", not faults, "; ".join(faults), "its own faults() complains")
    kinds, law = ("potential", "loss", "applied"), "kind agrees with the action"
    findings.holds(law, force.kind in kinds, f"kind {force.kind!r}", f"kind is one of {kinds}")
    stores = action.potential is not None or bool(action.inertias)
    sentence = f"kind is {force.kind!r}, and act() gives {'a' if stores else 'no'} potential or inertia"
    agrees = stores if force.kind == "potential" else not stores or force.kind == "loss"  # springs beside dampers
    findings.holds(law, agrees, sentence, "the energy ledger files it by its kind")


def _passivity(findings: Findings, force: Force, action: Action, scope: FreeScope) -> None:
    v = scope.all_rates
    for velocity, _ in action.pairs:
        node = scope.tape.lift(velocity)
        euler, now = scope.value(jvp([node], dict(zip(v, v, strict=True)))[0], node)
        hint = "a pair is (velocity, force): velocities are sums of rates, forces may be anything"
        findings.equal("velocities of pairs are linear in the rates", "velocity", now, euler, hint, 1e-10)
    if force.kind == "loss":
        watts = scope.value(power(action, scope))[0]
        sentence = f"power on the bodies: expected ≤ 0 W, found {watts:.6g}"
        hint = "a loss opposes the velocity of its pair: (velocity, −force)"
        findings.holds("passivity: a loss takes energy out", watts <= 0.0, sentence, hint)


def _tangent(findings: Findings, scope: FreeScope, effort: list[Node]) -> None:
    """∂(−f)/∂(q, v) along one direction, exact against differences."""
    inputs = [*scope.all_coordinates, *scope.all_rates, scope.time]
    here = scope.numbers
    along = {node: 0.3 + 0.1 * (k % 7) for k, node in enumerate(inputs)}
    exact, step = scope.value(*jvp(effort, dict(along))), 1e-4
    sides = [
        np.array(scope.value(*effort, given={node: here[node] + side * step * rate for node, rate in along.items()}))
        for side in (1.0, -1.0, 2.0, -2.0)
    ]
    slope = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * step)
    hint = "a kink, or a derivative that is not that of the value; tables and where() must meet smoothly"
    size = np.abs(sides[0])
    findings.equal("tangent: ∂f/∂q and ∂f/∂v are slopes of f", "generalized force", exact, slope, hint, 1e-6, size)


def _invariance(findings: Findings, action: Action, scope: FreeScope, rng: np.random.Generator) -> None:
    """Power and energy stay when the whole scene, with its motion, is turned and moved."""
    invariants: Any = [power(action, scope)] + ([] if action.potential is None else [scope.tape.lift(action.potential)])
    before = np.array(scope.value(*invariants))
    saved = dict(scope.numbers)
    scope.turn_scene(turn_of(rng), rng.uniform(-1.0, 1.0, 3))
    after = scope.value(*invariants)
    scope.numbers.update(saved)
    hint = "it depends on an absolute place or direction; use differences, or pass internal=False"
    law = "frame invariance: turning and moving the whole scene changes nothing"
    findings.equal(law, "power, energy", after, before, hint, 1e-8, before)


def _mechanics(findings: Findings, factory: Build, seed: int) -> None:
    """The laws of the equations of a two-link mechanism with the force."""
    made, hinge, _ = between(factory)
    model = mbd.Model("two links", gravity=(1.0, -9.81, 0.0))
    model.connect(mbd.Revolute("hip", model.ground.origin, hinge.parent.body.origin), hinge)
    model.apply(made)
    equation_laws(findings, model, postures=1, seed=seed)
