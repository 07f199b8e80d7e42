"""Laws of constraints: where, what law and when, in the equations and along runs."""

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Body, Frame
from mbd.bodies.ground import Ground
from mbd.bodies.point_mass import PointMass
from mbd.compile.mechanisms import mechanism_of
from mbd.constraints.base import Constraint
from mbd.constraints.measure import Measure
from mbd.equations.equations import Contact, Equations
from mbd.equations.programs import constraint_jacobian
from mbd.errors import MbdError, ModelError
from mbd.joints.base import Joint
from mbd.testing.equations import equation_laws
from mbd.testing.findings import Findings, Verdict
from mbd.testing.measures import between, measure_laws
from mbd.testing.numbers import Numbers, Point, at, derivative, inputs
from mbd.testing.runs import run_laws


def check_constraint(
    constraint: Constraint | mbd.Model | Callable[..., Any],
    *,
    invariant: bool | None = None,
    integrator: Any = None,
    dt: float = 1e-3,
    until: float = 0.3,
    postures: int = 2,
    seed: int = 0,
) -> Verdict:
    """A constraint keeps the laws of its measure, of the equations around it, and of contact along short runs.

    Its measure is held against `check_measure`; the equations against `check_model`; force laws must push and lose;
    then runs start on the contact and above it, moving towards it: gap ≥ 0 ⟂ force ≥ 0, impulses push, energy books
    close, a penalty gives back no more than it took, and a run repeated gives the same bits.

    Parameters
    ----------
    constraint : one of
        a constraint (its bodies float in the plane, its joints are connected);
        ``factory(a, b, hinge)`` that makes one from frames of two bodies and the joint 'hinge' between them, which
        float in the plane;
        ``factory()`` that builds a `Model` or `Lagrangian` with it, or returns (model, start)
    invariant : see `check_measure`
    integrator, dt, until : of the runs; default ``HHT(alpha=0.05)``
    postures, seed : random postures for the laws without a run

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    """
    model, start, own = _scene(constraint)
    names = ", ".join(f"{type(word).__name__} '{word.name}'" for word in own)
    findings = Findings(f"constraint {names}" if own else f"constraints of '{model.name}'")
    frames = list(getattr(model, "frames", {}).values())
    for word in own:
        measure = getattr(word, "measure", None)
        if isinstance(measure, Measure):
            measure_laws(findings, measure, invariant, getattr(model, "joints", ()), frames, 4 * postures, seed)
        faults = word.faults()
        findings.holds("it finds no fault with itself", not faults, "; ".join(faults), "its own faults() complains")
    if findings.broken:
        return findings.verdict()
    mechanism = mechanism_of(model)
    equations = mechanism.equations
    equation_laws(findings, equations, postures=postures, seed=seed)
    for contact in equations.contacts:
        if contact.is_velocity:
            _starts_from_zero(findings, equations, contact, seed)
        elif contact.force is not None:
            _force_law(findings, equations, contact, seed)
    scheme = mbd.HHT(alpha=0.05) if integrator is None else integrator
    starts = [("the start given", start)] if start is not None else list(_starts(findings, model, equations, seed))
    for label, state in starts:
        findings.where = label
        _along(findings, model, equations, state, scheme, dt, until)
    if not starts:
        findings.note("runs: no consistent start was found; let the factory return (model, start)")
    return findings.verdict()


# the scene ----------------------------------------------------------------------------------------------------------
def _scene(given: Any) -> tuple[Any, Any, list[Constraint]]:
    """(model, start or None, the constraints that are checked)."""
    if isinstance(given, Constraint):
        return _around([given], []), None, [given]
    if callable(given) and len(inspect.signature(given).parameters) == 3:
        made, hinge, _ = between(given)
        several = list(made) if isinstance(made, tuple | list) else [made]
        return _around(several, [hinge]), None, several
    made = given() if callable(given) else given
    model, start = made if isinstance(made, tuple) else (made, None)
    if not isinstance(model, mbd.Model | mbd.Lagrangian):
        raise ModelError(
            "check_constraint takes a constraint, a function of (a, b, hinge) that makes one, or a function without "
            f"arguments that returns a model or (model, start); got {model!r}"
        )
    own = model.words if isinstance(model, mbd.Lagrangian) else model.constraints
    return model, start, list(own)  # expressions of a Lagrangian are tried in its equations and runs


def _around(constraints: list[Constraint], joints: list[Joint]) -> mbd.Model:
    """The constraint with its joints between bodies that float in the plane."""
    model = mbd.Model("scene of the check", gravity=(0.5, -9.81, 0.0))
    mentions = [mention for word in constraints for mention in word.mentions()]
    known = {joint.name: joint for joint in [*joints, *(each for each in mentions if isinstance(each, Joint))]}
    held: set[str] = {joint.child.body.name for joint in known.values()}
    frames = [frame for joint in known.values() for frame in (joint.parent, joint.child)]
    bodies: dict[str, Body] = {
        frame.body.name: frame.body for frame in [*frames, *(each for each in mentions if isinstance(each, Frame))]
    }
    for place, body in enumerate(bodies.values()):
        if isinstance(body, Ground) or body.name in held:
            continue
        ends = model.ground.point(0.3 + 0.7 * place, 1.5), body.origin
        name = f"float {body.name}"
        model.connect(mbd.Translation(name, *ends) if isinstance(body, PointMass) else mbd.Planar(name, *ends))
    model.connect(*known.values())
    model.constrain(*constraints)
    return model


# force laws ---------------------------------------------------------------------------------------------------------
def _force_law(findings: Findings, equations: Equations, contact: Contact, seed: int) -> None:
    """F(g, ġ) of a penalty: it pushes when pressed, more as it is pressed faster, and not at a mere touch."""
    assert contact.force is not None
    for k, depth in enumerate((0.0, 1e-4, 1e-3, 1e-2)):
        point = inputs(equations, seed + k)
        point |= {("anchor", j): 0.5 for j in contact.anchors} | {("v", j): 0.0 for j in range(equations.n_v)}
        point |= {("z", j): float(state.default) for j, state in enumerate(equations.states)}
        placed = _at_gap(equations, contact, point, -depth)
        if placed is None:
            findings.note(f"force law of '{contact.name}': no posture with a gap of {-depth:g} was found")
            return
        direction = _slope(equations, contact, placed)
        findings.where = f"penetration {depth:g} {contact.unit} (seed {seed + k})"
        drift = float(at([contact.gap_rate], placed)[0])  # of a surface that moves, the mechanism being at rest

        def force(rate: float, placed: Point = placed, direction: Numbers = direction, drift: float = drift) -> float:
            speed = direction * (rate - drift) / (direction @ direction)
            return float(at([contact.force], placed | {("v", j): float(s) for j, s in enumerate(speed)})[0])  # type: ignore[list-item]

        rest, hint = force(0.0), "force() is positive pushing: p = k δⁿ + c δ̇ with δ = −g"
        if depth == 0.0:
            law = "a penalty starts from zero"
            findings.equal(law, "p at the first touch, at rest", rest, 0.0, "a jump cannot be integrated", 1e-6)
            continue
        sentence = f"'{contact.name}' at rest: expected p > 0, found {rest:.6g}"
        findings.holds("a penalty pushes when pressed", rest > 0.0, sentence, hint)
        for rate in (0.01, 0.3, 1.0):
            pressing, opening = force(-rate) - rest, force(rate) - rest
            sentence = (
                f"'{contact.name}' at ġ = ∓{rate:g}: p − p(rest) is {pressing:.6g} pressing (expected ≥ 0) and "
                f"{opening:.6g} opening (expected ≤ 0)"
            )
            slack = 1e-9 * (1.0 + abs(rest))
            hint = "damping must oppose the motion: it adds to p where ġ < 0"
            passive = pressing >= -slack and opening <= slack
            findings.holds("passivity: a penalty resists its penetration", passive, sentence, hint)
    findings.where = ""


def _starts_from_zero(findings: Findings, equations: Equations, contact: Contact, seed: int) -> None:
    """A force law whose gap is a velocity: no force at the instant of closing, where that passes zero."""
    point = inputs(equations, seed)
    slope = _slope(equations, contact, point)
    excess = float(at([contact.gap], point)[0]) / float(slope @ slope)
    moved: Point = {("v", j): point["v", j] - excess * float(slope[j]) for j in range(equations.n_v)}
    point = point | moved
    point |= dict(zip((("anchor", k) for k in contact.anchors), map(float, at(contact.captured, point)), strict=True))
    found, law = float(at([contact.force], point)[0]), "a penalty starts from zero"  # type: ignore[list-item]
    findings.equal(law, "p as it closes", found, 0.0, "a jump cannot be integrated", 1e-6)


def _slope(equations: Equations, contact: Contact, point: Point) -> Numbers:
    """∂g/∂q, or ∂g/∂v of a gap that is a velocity."""
    kind = "v" if contact.is_velocity else "x"
    return np.array([derivative([contact.gap], point, {(kind, j): 1.0})[0] for j in range(equations.n_v)])


def _at_gap(equations: Equations, contact: Contact, point: Point, gap: float) -> Point | None:
    """The inputs moved until the rows that always act hold and the gap has a value; velocities made consistent."""
    rows, n = list(equations.bilateral), equations.n_v
    values = [equations.rows[k].value for k in rows]
    B_nodes = [entry for line in constraint_jacobian(equations, rows) for entry in line]
    for _ in range(60):
        h = np.append(at(values, point) if rows else [], at([contact.gap], point)[0] - gap)
        if np.abs(h).max() < 1e-12:
            return point
        B = np.vstack([at(B_nodes, point).reshape(len(rows), n), _slope(equations, contact, point)])
        change = np.linalg.lstsq(B, -h, rcond=1e-10)[0]
        if not np.isfinite(change).all():
            return None
        change *= min(1.0, 0.5 / max(float(np.abs(change).max()), 1e-300))
        point = point | {("q", k): point["q", k] + float(change[k]) for k in range(n)}
    return None


# runs ---------------------------------------------------------------------------------------------------------------
def _starts(findings: Findings, model: Any, equations: Equations, seed: int) -> Iterator[tuple[str, Any]]:
    """Consistent starts: on each contact at rest, and above it moving towards it; or any, without contacts."""
    names = [contact.name for contact in equations.contacts]
    asked: list[tuple[str, dict[str, Any]]] = [] if names else [("the model's own posture, at rest", {})]
    for contact in equations.contacts:
        if contact.kind == "unilateral":
            others = [name for name in names if name != contact.name]
            asked.append((f"'{contact.name}' closed, at rest", {"closed": [contact.name], "open": others}))
        if contact.is_velocity:
            slope = _slope(equations, contact, inputs(equations, seed) | {("t", 0): 0.0})
            for sign, how in (0.5, "open"), (-0.5, "closed"):
                rates = sign * slope / (slope @ slope)
                speed = {name: float(each) for name, each in zip(equations.velocity_names, rates, strict=True)}
                label = f"'{contact.name}' {how} at {sign:g} {contact.unit}"
                asked.append((label, {"velocity": speed, how: [contact.name]}))
            continue
        above = _falling(equations, contact, seed)
        if above is not None:
            place, speed = above
            values: dict[str, Any] = {"position": place, "velocity": speed, "open": names, "project": True}
            asked.append((f"a gap of '{contact.name}' of 0.01, closing (seed {seed})", values))
    for label, values in asked:
        try:
            yield label, mbd.assemble(model, **values)
        except MbdError as error:
            findings.note(f"run from {label}: {str(error).splitlines()[0]}")


def _falling(equations: Equations, contact: Contact, seed: int) -> tuple[dict[str, float], dict[str, float]] | None:
    """Coordinates and rates by name, a little above a contact and moving towards it."""
    point = inputs(equations, seed, spread=0.3) | {("t", 0): 0.0}
    placed = _at_gap(equations, contact, point, 0.01)
    if placed is None:
        return None
    slope = _slope(equations, contact, placed)
    speed = -0.5 * slope / (slope @ slope)
    place = {coordinate.name: placed["q", k] for k, coordinate in enumerate(equations.coordinates)}
    return place, {name: float(value) for name, value in zip(equations.velocity_names, speed, strict=True)}


def _along(
    findings: Findings, model: Any, equations: Equations, start: Any, integrator: Any, dt: float, until: float
) -> None:
    """The laws of one run, and the run again."""
    run = mbd.simulate(model, start, integrator, dt=dt, until=start.time + until, on_failure="return")
    findings.holds("the run goes through", run.success, str(run.message), "the message says what to try")
    if not run.success:
        return
    label = findings.where
    run_laws(findings, run, equations)
    findings.where = label
    again = mbd.simulate(model, start, integrator, dt=dt, until=start.time + until, on_failure="return")
    same = again.final.q.tobytes() == run.final.q.tobytes() and again.final.v.tobytes() == run.final.v.tobytes()
    hint = "nothing may be kept between runs, and nothing drawn at random"
    findings.holds("determinism: a run repeated gives the same bits", same, "the ends differ", hint)
