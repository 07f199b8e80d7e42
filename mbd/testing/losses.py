"""Laws of losses."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbd.joints.losses.base import DissipationFunction, Loss
from mbd.tape.derivatives import jvp
from mbd.testing.findings import Findings, Verdict
from mbd.testing.scope import FreeScope

LOSS_NAME = "knee loss"

Numbers = np.ndarray[Any, np.dtype[np.float64]]


def check_loss(loss: Loss | Callable[[], Loss], *, rates: int = 60, fastest: float = 50.0, seed: int = 0) -> Verdict:
    """A loss takes energy out at every rate, is smooth enough for Newton's method, and declares its parameters.

    Parameters
    ----------
    loss : a loss, or a function that makes one
    rates : how many rates are tried, of both signs and from 10⁻⁶ of the fastest up
    fastest : the largest rate [rad/s or m/s]

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws, with the rates that show them.
    """
    made = loss if isinstance(loss, Loss) else loss()
    findings = Findings(f"loss {made!r}")
    rng = np.random.default_rng(seed)
    sizes = fastest * 10.0 ** rng.uniform(-6.0, 0.0, rates)
    sizes[: rates // 2] = rng.uniform(0.0, fastest, rates // 2)
    _declared(findings, made)
    findings.equal("no force at rest", "F(0)", force_at(made, 0.0), 0.0, "a loss that pushes at rest feeds energy in")
    for rate in map(float, sizes * rng.choice([-1.0, 1.0], rates)):
        findings.where = f"rate {rate!r} (seed {seed})"
        _power(findings, made, rate, fastest)
        _tangent(findings, made, rate)
    findings.where = f"seed {seed}"
    _dry(findings, made, rng)
    if made.has_states:
        for size in (0.01, 0.1, 1.0):
            _memory(findings, made, size * fastest, rng)
    return findings.verdict()


def force_at(loss: Loss, rate: float) -> float:
    """F(v) as a number [N or N m]."""
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    return scope.value(loss.force(v, scope, LOSS_NAME), given={v: rate})[0]


def dry_at(loss: Loss, load: float) -> float:
    """What truly sticks, at a force in the joint [N or N m]."""
    scope = FreeScope()
    value = scope.tape.input("lam", 0)
    return scope.value(loss.dry(value, scope, LOSS_NAME), given={value: load})[0]


def sliding_at(loss: Loss, speed: float) -> float:
    """The same while it slides at a speed, without a force in the joint."""
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    return scope.value(loss.sliding(0.0, v, scope, LOSS_NAME), given={v: speed})[0]


def _dry(findings: Findings, loss: Loss, rng: np.random.Generator) -> None:
    """Set-valued friction has a limit ≥ 0 that grows in proportion to the force in the joint, or not at all.

    While it slides it is that at rest to begin with.
    """
    rest = dry_at(loss, 0.0)
    hint = "sliding() must tend to dry() as the speed falls to zero: friction does not jump as sliding begins"
    findings.equal("sliding begins with the friction at rest", "sliding at 0", sliding_at(loss, 0.0), rest, hint, 1e-12)
    law = "dry friction has a limit ≥ 0"
    for load in map(float, 10.0 ** rng.uniform(-3.0, 4.0, 8)):
        limit = dry_at(loss, load)
        sentence = f"expected dry ≥ 0, found {limit:.6g} at a force of {load:.6g} N"
        findings.holds(law, limit >= 0.0, sentence, "a negative limit feeds energy in; give the size of the friction")
        doubled = dry_at(loss, 2.0 * load)
        hint = "a constant, or a constant times the force: the balance is solved for friction of that form"
        findings.equal(
            "dry friction follows the force in proportion", "dry(2 N)", doubled, 2.0 * limit - rest, hint, 1e-12
        )
        again = dry_at(loss, load)
        findings.equal(
            "determinism of dry friction", "dry asked again", again, limit, "it may depend on its load alone", 0.0
        )
        if not loss.needs_reaction:
            hint = "needs_reaction must be True, so that the joint is cut and its rows carry the force"
            findings.equal("a limit that follows the force asks for it", "dry", limit, rest, hint, 0.0)


def _declared(findings: Findings, loss: Loss) -> None:
    scope = FreeScope()
    loss.force(scope.tape.input("v", 0), scope, LOSS_NAME)
    loss.dry(scope.tape.input("lam", 0), scope, LOSS_NAME)
    loss.sliding(scope.tape.input("lam", 0), scope.tape.input("v", 1), scope, LOSS_NAME)
    _ = loss.rates(scope.tape.input("v", 0), scope, LOSS_NAME), loss.elastic(scope, LOSS_NAME)
    law = "parameters are declared before they are used"
    hint = "fields() must name every scope.parameter(owner, field, value) with the same value"
    declared = loss.parameters(LOSS_NAME)
    findings.holds(law, scope.recorded == declared, f"used {scope.recorded}, declared {declared}", hint)
    faults = loss.faults(LOSS_NAME)
    findings.holds("it finds no fault with itself", not faults, "; ".join(faults), "its own faults() complains")


def _power(findings: Findings, loss: Loss, rate: float, fastest: float) -> None:
    force = force_at(loss, rate)
    whole = force + math.copysign(sliding_at(loss, abs(rate)), rate)
    sentence = f"power taken out F(v) v: expected ≥ 0 W, found {whole * rate:.6g} W (F = {whole:.6g})"
    hint = "F opposes the motion and has the sign of the rate: it stands on the left-hand side of M a + f = 0"
    findings.holds("passivity: it never feeds energy in", whole * rate >= 0.0, sentence, hint)
    findings.equal(
        "determinism", "F(v) asked again", force_at(loss, rate), force, "F may depend on its rate alone", 0.0
    )
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    turned = scope.value(loss.force(-v, scope, LOSS_NAME), given={v: rate})[0]
    hint = "write the force for any scalar, not for an input: a rate may arrive as −v, or as a number"
    findings.equal("any scalar may be the rate", "F(−v)", turned, force_at(loss, -rate), hint, 1e-12)
    nearby = force_at(loss, rate + 1e-8 * fastest)
    allowed = 1e-3 * (1.0 + abs(force))
    sentence = f"F jumps from {force:.6g} to {nearby:.6g} between rates {1e-8 * fastest:.1g} apart"
    hint = "Newton's method needs a continuous force; smooth the jump"
    findings.holds("continuity", abs(nearby - force) <= allowed, sentence, hint)


def _memory(findings: Findings, loss: Loss, fastest: float, rng: np.random.Generator) -> None:
    """Along a motion from rest, what it took since then is at least what its states store: ``∫ F v dt ≥ U(z) ≥ 0``.

    The motion is a sum of sines that begins and ends where it is at rest: with small swings, which bend states only.
    """
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    pairs = [(z, scope.tape.lift(rate)) for z, rate in loss.rates(v, scope, LOSS_NAME)]
    force, stored = scope.tape.lift(loss.force(v, scope, LOSS_NAME)), scope.tape.lift(loss.elastic(scope, LOSS_NAME))
    missing = [name for name, node in scope.states.items() if all(node is not z for z, _ in pairs)]
    law = "every state has a rate"
    findings.holds(law, not missing, f"without a rate: {', '.join(missing)}", "list it in what rates() returns")
    if missing:
        return
    states = [z for z, _ in pairs]
    frequencies, sizes = rng.uniform(1.0, 6.0, 3), rng.uniform(-1.0, 1.0, 3) * fastest / 3.0

    def rates(t: float, y: Numbers) -> list[float]:
        speed = float(sizes @ np.sin(frequencies * t))
        given = dict(zip(states, map(float, y[:-1]), strict=True)) | {v: speed}
        values = scope.value(*(rate for _, rate in pairs), force, given=given)
        return [*values[:-1], values[-1] * speed]

    begin = np.array([*(scope.numbers[z] for z in states), 0.0])
    from scipy.integrate import solve_ivp

    motion = solve_ivp(rates, (0.0, 3.0), begin, method="LSODA", rtol=1e-8, atol=1e-10 * fastest)
    given = [dict(zip(states, map(float, line), strict=True)) for line in motion.y[:-1].T]
    energy = np.array([scope.value(stored, given=each)[0] for each in given])
    left = motion.y[-1] + energy[0] - energy
    worst, size = float(left.min()), float(np.max(np.abs(motion.y[-1])))
    sentence = f"it gave {-worst:.6g} J more than its states stored, of {size:.6g} J that went through it"
    hint = "F v ≥ dU/dt must hold along every motion, with U(z) = elastic()"
    findings.holds("passivity of its memory", worst >= -1e-6 * size, sentence, hint)


def _tangent(findings: Findings, loss: Loss, rate: float) -> None:
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    scope.numbers[v] = rate
    (slope,) = scope.value(*jvp([scope.tape.lift(loss.force(v, scope, LOSS_NAME))], {v: 1.0}))
    step = 1e-5 * max(abs(rate), 1e-2)
    right, left = ((force_at(loss, rate + side * step) - force_at(loss, rate)) / (side * step) for side in (1.0, -1.0))
    if abs(right - left) <= 1e-2 * (1.0 + abs(slope)):  # no kink here
        found = 0.5 * (right + left)
        hint = "the exact derivative of the recorded force differs from its values; build it from mbd's functions"
        findings.equal("tangent: ∂F/∂v is the slope of F", "∂F/∂v", slope, found, hint, 1e-4)
    if isinstance(loss, DissipationFunction):
        (lost, rest, slope) = _dissipation(loss, rate)
        hint = "force() must be the derivative of dissipation(), or be left to the base class"
        findings.equal("F = ∂D/∂v", "F(v)", force_at(loss, rate), slope, hint, 1e-9)
        sentence = f"D({rate:.6g}) = {lost:.6g} W is less than D(0) = {rest:.6g} W"
        findings.holds("D is least at rest", lost >= rest, sentence, "a dissipation function rises on both sides of 0")


def _dissipation(loss: DissipationFunction, rate: float) -> tuple[float, float, float]:
    """D(v), D(0), ∂D/∂v."""
    scope = FreeScope()
    v = scope.tape.input("v", 0)
    lost = scope.tape.lift(loss.dissipation(v, scope, LOSS_NAME))
    value, slope = scope.value(lost, *jvp([lost], {v: 1.0}), given={v: rate})
    return value, scope.value(lost, given={v: 0.0})[0], slope
