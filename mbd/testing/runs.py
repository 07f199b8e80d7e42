"""Laws along a run: complementarity, impacts, what is held stays held, energy."""

from typing import Any

import numpy as np

from mbd.equal import HALF_PRECISION_RTOL, NOMINAL_RTOL
from mbd.equations.equations import Contact, Equations, Friction
from mbd.results.ledger import SPENT
from mbd.testing.findings import Findings

LEDGER_RTOL = 1e-2
"""Largest share of the energy's swing that the books may miss at the step of a check; a missing work is of size 1."""


def run_laws(findings: Findings, run: Any, equations: Equations) -> None:
    """The laws of one trajectory, added to what was found before."""
    before = findings.where
    flags = run.columns.record.closed.astype(bool)
    for k, contact in enumerate(equations.contacts):
        _complementarity(findings, run, contact, flags[:, k], before)
        _impacts(findings, run, contact, before)
    for friction in equations.frictions:
        _friction(findings, run, friction, before)
    findings.where = before
    if equations.rows:
        _held(findings, run)
    _energy(findings, run, equations)


def _instant(findings: Findings, where: str, run: Any, wrong: Any) -> int:
    """The first row at which something is wrong, put into the message."""
    row = int(np.argmax(wrong)) if np.any(wrong) else 0
    findings.where = f"t = {run.time[row]:.6g} s of the run from {where}"
    return row


def _complementarity(findings: Findings, run: Any, contact: Contact, closed: Any, where: str) -> None:
    """g ≥ 0, p ≥ 0, g p = 0 of a unilateral contact; p ≥ 0 of a penalty."""
    title = f"'{contact.name}'"
    gap, force = run[f"{contact.name}.gap"], run[f"{contact.name}.force"]
    size = 1.0 + float(np.max(np.abs(force), initial=0.0))
    if contact.kind == "penalty":
        if contact.opens_on == "pull":
            row = _instant(findings, where, run, force < -HALF_PRECISION_RTOL * size)
            sentence = f"{title} pulls: expected p ≥ 0, found {force[row]:.6g} N at a gap of {gap[row]:.3g}"
            hint = "a stop pushes; with release='pull' it must open as its force falls to zero"
            findings.holds("a penalty pushes", bool(np.all(force >= -HALF_PRECISION_RTOL * size)), sentence, hint)
        return
    if contact.only_while is None and not contact.when:
        row = _instant(findings, where, run, gap < -HALF_PRECISION_RTOL)
        sentence = f"{title} is penetrated: expected g ≥ 0, found {gap[row]:.6g} {contact.unit}"
        hint = "gap() must be continuous and fall through zero as the contact closes"
        findings.holds("complementarity: gap ≥ 0", bool(np.all(gap >= -HALF_PRECISION_RTOL)), sentence, hint)
    if contact.opens_on == "pull":
        row = _instant(findings, where, run, force < -HALF_PRECISION_RTOL * size)
        sentence = f"{title} pulls: expected p ≥ 0, found {force[row]:.6g}"
        hint = "a contact that would attract must open"
        findings.holds("complementarity: force ≥ 0", bool(np.all(force >= -HALF_PRECISION_RTOL * size)), sentence, hint)
    wrong = (np.abs(gap) > HALF_PRECISION_RTOL) & (np.abs(force) > HALF_PRECISION_RTOL * size)
    row = _instant(findings, where, run, wrong)
    sentence = f"{title}: gap {gap[row]:.3g} and force {force[row]:.3g} at once"
    findings.holds("complementarity: gap × force = 0", not wrong.any(), sentence, "only a closed contact pushes")
    row = _instant(findings, where, run, closed & (np.abs(gap) > HALF_PRECISION_RTOL))
    sentence = f"{title} is closed with a gap of {gap[row]:.6g} {contact.unit}"
    stays = bool(np.all(np.abs(gap[closed]) <= HALF_PRECISION_RTOL))
    findings.holds("a closed contact stays closed", stays, sentence, "the rows must hold the gap at zero")


def _friction(findings: Findings, run: Any, friction: Friction, where: str) -> None:
    """|λ_T| ≤ limit, against the motion, and none where its contact is open."""
    columns, record = run.columns, run.columns.record
    values = columns.evaluate([friction.rate, friction.sliding], columns.rows)
    rate, limit = (np.broadcast_to(value, run.time.shape) for value in values)
    along = record.lam[:, friction.row]
    on = record.closed[:, friction.contact].astype(bool) if friction.contact >= 0 else np.ones(len(along), dtype=bool)
    size = 1.0 + np.max(np.abs(record.lam), axis=1, initial=0.0)
    limit = np.where(on, limit, 0.0)
    wrong = np.abs(along) > limit + NOMINAL_RTOL * size
    row = _instant(findings, where, run, wrong)
    sentence = f"'{friction.name}' resists with {along[row]:.6g} of at most {limit[row]:.6g}"
    hint = "the friction of a contact is at most μ times its force, and none where it is open"
    findings.holds("friction stays within its limit", not wrong.any(), sentence, hint)
    wrong = along * rate < -NOMINAL_RTOL * size
    row = _instant(findings, where, run, wrong)
    sentence = f"'{friction.name}' drives with {-along[row] * rate[row]:.6g} W at a speed of {rate[row]:.6g}"
    findings.holds(
        "friction opposes sliding", not wrong.any(), sentence, "its rate must be the one that it slides with"
    )


def _impacts(findings: Findings, run: Any, contact: Contact, where: str) -> None:
    for event in run.events:
        if event.kind != "closed" or event.name != contact.name or not len(event.impulse):
            continue
        findings.where = f"t = {event.time:.6g} s of the run from {where}"
        push = float(event.impulse[0])
        sentence = f"'{contact.name}' takes an impulse of {push:.6g}; expected ≥ 0"
        findings.holds(
            "impact: impulses push", push >= -HALF_PRECISION_RTOL, sentence, "the gap grows away from the surface"
        )
        sentence = f"'{contact.name}' gives {-event.energy_loss:.6g} J in an impact; expected ≤ 0"
        slack = -HALF_PRECISION_RTOL * (1.0 + abs(event.energy_loss))
        hint = "restitution lies between 0 and 1"
        findings.holds("impact: no energy is made", event.energy_loss >= slack, sentence, hint)


def _held(findings: Findings, run: Any) -> None:
    held, hint = run.violation, "the rows of the start were consistent, and drift along the run"
    findings.equal("rows hold along the run", f"|h| of {held.worst}", max(held.length, held.angle), 0.0, hint, 1e-7)


def _energy(findings: Findings, run: Any, equations: Equations) -> None:
    """Losses and penalties take, and the books close."""
    ledger = run.energy
    swing = float(np.ptp(ledger.kinetic)) + 1e-12
    acting = {contact.name for contact in equations.contacts if contact.kind == "penalty"}
    for part in ledger.parts:
        given = part.energy - part.energy[0]
        worst = float(np.max(given)) if part.kind == "penalty" else float(np.max(np.diff(given), initial=0.0))
        sentence = f"'{part.name}' gave {worst:.6g} J in all, {worst / swing:.2g} of the swing of kinetic energy"
        hint = "a stop that compresses must push more than one that opens: damping ≥ 0"
        if part.kind == "penalty" and part.name in acting and run[f"{part.name}.force"][0] == 0.0:
            law = "passivity: a penalty gives back no more than it took"
            findings.holds(law, worst <= LEDGER_RTOL * swing, sentence, hint)
        elif part.kind in SPENT and part.kind != "penalty":
            law = f"passivity: a{'n' if part.kind == 'impact' else ''} {part.kind} takes energy along the run"
            findings.holds(law, worst <= 1e-6 * (1.0 + swing), sentence, "its power on the mechanism is ≤ 0")
    hint = "an effect does work that neither its power nor its potential tells"
    missing = float(np.max(np.abs(ledger.numerical), initial=0.0)) / (swing + float(np.ptp(ledger.potential)))
    findings.equal("energy books close", "energy unaccounted for, of the swing", missing, 0.0, hint, LEDGER_RTOL)
