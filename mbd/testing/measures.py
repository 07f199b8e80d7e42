"""Laws of measures."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.bodies.ground import Ground
from mbd.constraints.measure import Measure
from mbd.constraints.user_measure import UserMeasure
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.derivatives import gradient, live
from mbd.tape.node import Node
from mbd.testing.findings import Findings, Verdict
from mbd.testing.scope import FreeScope

Build = Callable[[Frame, Frame, Joint], Any]
"""factory(a, b, hinge): frames a and b of two bodies, and a joint 'hinge' with an angle between these bodies."""


def check_measure(
    measure: Measure | Build,
    *,
    invariant: bool | None = None,
    joints: Iterable[Joint] = (),
    frames: Iterable[Frame] = (),
    postures: int = 8,
    seed: int = 0,
) -> Verdict:
    """A measure is a smooth function of the posture, honest about what it depends on, with tangents that start at zero.

    Parameters
    ----------
    measure : a measure, or a function ``factory(a, b, hinge)`` that makes one from frames of two free bodies and a
        joint named 'hinge' between them
    invariant : whether turning and moving the whole scene must leave it alone; None: where it takes its value between
        two moving bodies or from a joint, unless it is a function made by `mbd.measure`, which may mean anything
    joints, frames : those that an instance refers to by name only
    postures : how many random postures of the bodies are tried

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    """
    made: Any = measure
    if not isinstance(measure, Measure):
        made, hinge, places = between(measure)
        joints, frames = [*joints, hinge], [*frames, *places]
    findings = Findings(f"measure {type(made).__name__}")
    measure_laws(findings, made, invariant, joints, frames, postures, seed)
    return findings.verdict()


def between(factory: Build) -> tuple[Any, Joint, list[Frame]]:
    """What a factory makes between two bodies, with their hinge and frames."""
    thigh = mbd.Link("thigh", mass=1.0, length=0.5, center=0.2, inertia=0.05)
    shank = mbd.RigidBody("shank", 2.0, (0.3, 0.4, 0.5), center=(0.1, -0.2, 0.0))
    hinge = mbd.Revolute("hinge", thigh.end, shank.origin)
    a, b = thigh.point(0.1, -0.3, 0.05, name="a"), shank.point(0.2, -0.4, 0.1, name="b")
    return factory(a, b, hinge), hinge, [a, b, *thigh.frames.values(), *shank.frames.values()]


def relates_bodies(mentions: Sequence[Mention]) -> bool:
    """Whether they speak of a joint, or of frames of two moving bodies."""
    bodies = {mention.body.name for mention in mentions if isinstance(mention, Frame)}
    ground = any(isinstance(mention, Frame) and isinstance(mention.body, Ground) for mention in mentions)
    return not ground and (any(isinstance(mention, Joint) for mention in mentions) or len(bodies) > 1)


def turn_of(rng: np.random.Generator) -> Any:
    """A random rotation."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0.0 else -Q


def scope_of(mentions: Sequence[Mention], joints: Iterable[Joint], frames: Iterable[Frame]) -> FreeScope:
    """A scope that knows the joints and frames mentioned, and has met their bodies."""
    known = [mention for mention in mentions if isinstance(mention, Joint)]
    places = [mention for mention in mentions if isinstance(mention, Frame)]
    scope = FreeScope({joint.name: joint for joint in [*joints, *known]}.values(), frames=[*frames, *places])
    for frame in [*places, *(frame for joint in scope.joints.values() for frame in (joint.parent, joint.child))]:
        if not isinstance(frame.body, Ground):
            scope.coordinates(frame.body.name)
    return scope


def unsaid(mentions: Sequence[Mention], scope: FreeScope) -> list[str]:
    """The bodies that were asked for although no mention leads to them."""
    mentioned: list[Frame] = [mention for mention in mentions if isinstance(mention, Frame)]
    joints = [mention for mention in mentions if isinstance(mention, Joint)]
    for name in [mention for mention in mentions if isinstance(mention, str)]:
        owners = [name.rpartition(".")[0], name.removesuffix(".rate").rpartition(".")[0]]
        mentioned += [scope.frames[owner] for owner in owners if owner in scope.frames]
        joints += [scope.joints[owner] for owner in owners if owner in scope.joints]
    mentioned += [frame for joint in joints for frame in (joint.parent, joint.child)]
    return sorted(scope.asked - {frame.body.name for frame in mentioned})


def measure_laws(
    findings: Findings,
    measure: Measure,
    invariant: bool | None,
    joints: Iterable[Joint],
    frames: Iterable[Frame],
    postures: int,
    seed: int,
) -> None:
    """The laws of `check_measure`, added to what was found before."""
    mentions = measure.mentions()
    scope = scope_of(mentions, joints, frames)
    gap = scope.tape.lift(measure.gap(scope))
    _words(findings, measure, scope, gap)
    captured = [scope.tape.lift(value) for value in measure.captured(scope)]
    anchors = [scope.tape.input("anchor", k) for k in range(len(captured))]
    rows = [(part, scope.tape.lift(value)) for part, value in measure.tangents(scope, anchors)]
    hint = "has_tangents, captured() and tangents() must agree"
    sentence = f"has_tangents is {measure.has_tangents}, tangents() gives {len(rows)} rows"
    findings.holds("tangents are as announced", bool(rows) <= measure.has_tangents, sentence, hint)
    sentence = f"parts {[part for part, _ in rows]}"
    findings.holds("tangents are told apart", len({part for part, _ in rows}) == len(rows), sentence, "name each part")
    if invariant is None:
        invariant = relates_bodies(mentions) and not isinstance(measure, UserMeasure)
    rng = np.random.default_rng(seed)
    for k in range(postures):
        scope.scatter(rng)
        findings.where = f"random places of {', '.join(scope.bodies)} (seed {seed}, posture {k})"
        given = dict(zip(anchors, scope.value(*captured), strict=True))
        slips = scope.value(*(value for _, value in rows), given=given)
        hint = "tangents(scope, anchors) is zero where anchors are the values of captured(scope)"
        findings.equal("tangents are zero where the contact closed", "slip", slips, 0.0, hint, 1e-12)
        slope = _gradient(findings, "gap", scope, gap, {})
        sides = [_gradient(findings, f"tangent '{part}'", scope, row, given) for part, row in rows]
        if sides:
            smallest = np.linalg.svd(np.array([slope, *sides]), compute_uv=False).min()
            sentence = f"smallest singular value {smallest:.3g} of ∇g and the tangents"
            hint = "a tangent that is parallel to the normal holds nothing of its own"
            findings.holds("tangents are independent of the normal", smallest > 1e-8, sentence, hint)
        if invariant:
            hint = "g must change with relative motion only; or pass invariant=False"
            balance(
                findings,
                "action = reaction: the forces λ ∂g/∂q on all bodies balance",
                scope,
                slope,
                " for λ = 1",
                hint,
            )
            before = scope.value(gap)[0]
            scope.turn_scene(turn_of(rng), rng.uniform(-1.0, 1.0, 3))
            hint = "it depends on an absolute place or direction; take differences of places, or pass invariant=False"
            law = "frame invariance: turning and moving the whole scene changes nothing"
            findings.equal(law, "gap after the move", scope.value(gap)[0], before, hint, 1e-9)
    findings.where = ""


def balance(findings: Findings, law: str, scope: FreeScope, work: Any, each: str, hint: str) -> None:
    """Generalized forces that act between the bodies make no force and no moment on all of them together."""
    size, zero = np.abs(work), np.zeros(3)
    rides = {"force along": [(axis, zero) for axis in np.eye(3)], "moment about": [(zero, axis) for axis in np.eye(3)]}
    for kind, motions in rides.items():
        for name, motion in zip("xyz", motions, strict=True):
            found = work @ scope.ride(*motion)
            findings.equal(law, f"net {kind} {name}{each}", found, 0.0, hint, 1e-9, size)


def _words(findings: Findings, measure: Measure, scope: FreeScope, gap: Node) -> None:
    """What it says of itself."""
    units = ("m", "rad")
    findings.holds("unit is 'm' or 'rad'", measure.unit in units, f"unit {measure.unit!r}", "angles are 'rad'")
    sentence = f"reaction {measure.reaction!r}"
    law = "reaction is 'force', 'drive' or 'tension'"
    findings.holds(law, measure.reaction in ("force", "drive", "tension"), sentence, "see Measure")
    kinds = sorted({node.data[0] for node in live([gap]) if node.op == "input"} & {"v", "z", "a", "lam"})
    hint = "rows and contacts need positions and time only; velocities belong to losses, events and controllers"
    findings.holds("it depends on the posture and the time", not kinds, f"it depends on inputs {kinds}", hint)
    left = unsaid(measure.mentions(), scope)
    hint = "mentions() must list every frame, joint and name that gap() asks for"
    findings.holds("mentions are complete", not left, f"not mentioned: {', '.join(left)}", hint)
    faults = measure.faults("it")
    findings.holds("it finds no fault with itself", not faults, "; ".join(faults), "its own faults() complains")
    again = scope.tape.lift(measure.gap(scope))
    hint = "gap() may depend on its scope alone, not on how often it was asked"
    findings.holds("determinism", again is gap, "asked twice, it gave two expressions", hint)


def _gradient(findings: Findings, what: str, scope: FreeScope, value: Node, given: dict[Any, float]) -> Any:
    """∇ of a value, held against differences of its values."""
    q, step = scope.all_coordinates, 1e-4
    exact = np.array(scope.value(*gradient(value, q), given=given))
    here, slopes = scope.numbers, []
    for node in q:
        sides = [
            scope.value(value, given={**given, node: here[node] + side * step})[0] for side in (1.0, -1.0, 2.0, -2.0)
        ]
        slopes.append((8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * step))
    law, hint = "Jacobian: ∂g/∂q is the slope of g", "a kink, or a derivative that is not that of the value"
    findings.equal(law, what, exact, slopes, hint, 1e-7)
    return np.nan_to_num(exact)
