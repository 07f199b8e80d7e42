"""Impact laws over all closed and closing contacts together.

``M (v⁺ − v⁻) + R λ̂ = 0``, bilateral and held rows ``B v⁺ + h_t = 0``, contacts push (−λ̂ ≥ 0), friction obeys Coulomb's
law on impulses. Kinetic energy changes by ``½ Σ λ̂ (γ⁻ + γ⁺)``, whatever the law.

Newton        ``0 ≤ γ⁺ + e γ⁻ ⟂ −λ̂ ≥ 0`` (Moreau 1988)
Poisson       compression with e = 0 to −λ̂_c; then e times that impulse, and more where contacts would penetrate
              (Pfeiffer & Glocker 1996, Multibody Dynamics with Unilateral Contacts, ch. 8)
sequential    one contact after the other, the fastest first, until none approaches; equally fast ones together
              (Han & Gilmore 1993, J. Mech. Design 115:412)
Stronge       as Poisson, with one factor on all impulses of the second phase, so that it gives back e² of the work that
              the normal impulses of the first took (Stronge 1990, Proc. R. Soc. Lond. A 431:169)
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.complementarity import complementarity
from mbd.kernel.fields import ENERGY_GAIN, IMPACTS, NO_IMPACT, NOW, PAST_TIME, PLASTIC, STRONGE
from mbd.kernel.restart import capture, evaluate, evaluate_loaded, limit_of, row_speed

__all__ = ["impact"]

MOST_BLOWS = 1000
"""Blows of the sequential law at one instant [-]."""
APPROACH = 1e-11
"""Approach speed, relative to the fastest, that counts as none [-]."""


def impact(K: Any, slow: bool) -> int:
    """The velocities in K.y jump, by K.jump; impulses, negative where they push, are left in K.impulse.

    A slow impact (below the rest speed) sticks. Afterwards K.active says which contacts are closed.
    """
    prepare(K)
    status = 0
    if slow or K.impact_law == 0 or K.state[PLASTIC] == 1:
        status = newton_law(K, slow)
    elif K.impact_law == 1:
        status = poisson_law(K, False)
    else:
        status = sequential_law(K)
    if status != 0:
        return status
    if not slow and gains_energy(K):
        K.counts[STRONGE] += 1
        start_over(K)
        status = poisson_law(K, True)
        if status != 0:
            return status
        if gains_energy(K):
            return ENERGY_GAIN
    for i in range(K.n):
        K.y[i] += K.jump[i]
    K.counts[IMPACTS] += 1
    return 0


def prepare(K: Any) -> None:
    """K.acc at the instant, directions of sliding where contacts are now, force zero; all frictions begin stuck."""
    evaluate(K, K.clock[NOW], K.q, K.y)
    if K.n_frictions > 0:
        for f in range(K.n_frictions):
            c = K.friction_contact[f]
            if c >= 0 and (K.closing[c] > 0 or (K.closed[c] == 1 and K.sticks[f] == 0)):
                capture(K, c)
        for k in range(K.n_rows):
            K.given[k] = 0.0
        evaluate(K, K.clock[NOW], K.q, K.y)
        evaluate_loaded(K, K.given)
        for f in range(K.n_frictions):
            K.base_limit[f] = limit_of(K, f)  # no impulse comes from a force that stays finite
        if K.strategy == 1:
            evaluate_loaded(K, K.past)
            for f in range(K.n_frictions):
                K.past_limit[f] = limit_of(K, f) + (K.detail[PAST_TIME] - 1.0) * K.base_limit[f]
    start_over(K)


def start_over(K: Any) -> None:
    """No jump and no impulse yet."""
    for i in range(K.n):
        K.total_jump[i] = 0.0
    for k in range(K.n_rows):
        K.total[k] = 0.0


def gather(K: Any, slow: bool) -> None:
    """All closed and closing contacts take part; those that open on pull may choose."""
    for c in range(K.n_contacts):
        both = K.closed[c] == 1 or K.closing[c] > 0
        K.active[c] = 1 if (both and K.kind[c] == 0) else 0
        K.free[c] = 1 if (K.active[c] == 1 and K.opens[c] == 0 and not slow) else 0
    loosen(K)


def loosen(K: Any) -> None:
    """Frictions of this blow may choose, from sticking."""
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        K.loose[f] = 1 if (c < 0 or K.active[c] == 1) else 0
        if K.loose[f] == 1:
            K.sticks[f] = 1
            K.slip[f] = 0.0


def speed(K: Any, row: int) -> float:
    """γ of a row after the jumps so far."""
    o_B = K.n * K.n + K.n + K.n * K.n_rows
    value = row_speed(K, row)
    for j in range(K.n):
        value += K.acc[o_B + row * K.n + j] * K.total_jump[j]
    return value


def blow(K: Any) -> int:
    """The next jump and its impulses, beside the impulses in K.given: bias is in place, contacts have been gathered."""
    for k in range(K.n_rows):
        K.impulse[k] = 0.0
    status = complementarity(K, 1)
    if status != 0:
        return status
    for i in range(K.n):
        K.total_jump[i] += K.jump[i]
        K.jump[i] = K.total_jump[i]
    for k in range(K.n_rows):
        K.total[k] += K.impulse[k] + K.given[k]
        K.impulse[k] = K.total[k]
        K.given[k] = 0.0
    for c in range(K.n_contacts):
        K.parting[c] = 0
    return 0


def newton_law(K: Any, slow: bool) -> int:
    """One blow that reverses the gap rates of closing contacts by their restitutions."""
    gather(K, slow)
    for k in range(K.n_rows):
        c = K.row_contact[k]
        K.given[k] = 0.0
        K.bias[k] = row_speed(K, k)
        if c >= 0 and K.closing[c] > 0 and not slow and K.row_normal[k] == 1:
            K.bias[k] += restitution_of(K, c) * (K.before[c] if K.strategy == 1 else K.bias[k])
    status = blow(K)
    if status == 0 and not slow:
        let_rebound(K)
    return status


def restitution_of(K: Any, c: int) -> float:
    """e, or 0 at the end of impacts without end."""
    return 0.0 if K.state[PLASTIC] == 1 else float(K.restitution[c])


def let_rebound(K: Any) -> None:
    """Contacts that closed with a restitution leave again."""
    for c in range(K.n_contacts):
        rests = K.strategy == 1 and K.before[c] >= 0.0
        if K.closing[c] > 0 and restitution_of(K, c) > 0.0 and not rests:
            K.active[c] = 0


def poisson_law(K: Any, energetic: bool) -> int:
    """Compression, then restitution of its impulses (Poisson) or of their work (Stronge)."""
    gather(K, False)
    for k in range(K.n_rows):
        K.given[k] = 0.0
        K.bias[k] = row_speed(K, k)
    status = blow(K)
    if status != 0:
        return status
    work = 0.0  # of the normal impulses in compression, each counted with its e²
    for c in range(K.n_contacts):
        if K.closing[c] > 0 and K.kind[c] == 0 and K.active[c] == 1:
            row = K.normal[c]
            K.given[row] = K.restitution[c] * K.total[row]
            work += 0.5 * K.restitution[c] * K.restitution[c] * K.total[row] * (row_speed(K, row) + speed(K, row))
    if energetic and work > 0.0:
        status = scale_to_work(K, work)
        if status != 0:
            return status
    let_part(K, 2)
    status = blow(K)
    if status == 0:
        let_rebound(K)
    return status


def let_part(K: Any, free: int) -> None:
    """Contacts that are given an impulse part under it, their tangents stay; `free` tells who may choose."""
    for c in range(K.n_contacts):
        row = K.normal[c]
        parts = K.kind[c] == 0 and K.given[row] != 0.0
        K.parting[c] = 1 if parts else 0
        if parts or free == 0:
            K.free[c] = free
    for k in range(K.n_rows):
        K.bias[k] = speed(K, k)
    loosen(K)


def scale_to_work(K: Any, work: float) -> int:
    """Scale K.given so that it does this work: its rows move by σ d under σ K.given, hence ½ σ² Σ given · d = work."""
    for i in range(K.n):
        K.trial_jump[i] = K.total_jump[i]
    for k in range(K.n_rows):
        K.trial[k] = K.total[k]
        K.trial_given[k] = K.given[k]
    for c in range(K.n_contacts):
        K.trial_free[c] = K.free[c]
    let_part(K, 0)
    status = blow(K)
    done = 0.0
    for k in range(K.n_rows):
        if K.trial_given[k] != 0.0:
            moved = speed(K, k)
            for j in range(K.n):
                moved -= K.acc[K.n * K.n + K.n + K.n * K.n_rows + k * K.n + j] * K.trial_jump[j]
            done -= 0.5 * K.trial_given[k] * (moved - row_speed(K, k))
    for i in range(K.n):
        K.total_jump[i] = K.trial_jump[i]
    factor = (work / done) ** 0.5 if done > 0.0 else 0.0
    for k in range(K.n_rows):
        K.total[k] = K.trial[k]
        K.given[k] = factor * K.trial_given[k]
    for c in range(K.n_contacts):
        K.free[c] = K.trial_free[c]
    return status


def sequential_law(K: Any) -> int:
    """Blow after blow of the contacts that approach fastest, each as if the others were not there."""
    gather(K, False)
    for c in range(K.n_contacts):
        K.touched[c] = K.active[c]  # takes part
    fastest = 0.0
    for _ in range(MOST_BLOWS):
        most = 0.0
        for c in range(K.n_contacts):
            if K.touched[c] == 1 and K.opens[c] == 0:
                most = max(most, -speed(K, K.normal[c]))
        fastest = max(fastest, most)
        if most <= APPROACH * fastest or most < 1e-14:
            end_sequence(K, fastest)
            return 0
        for c in range(K.n_contacts):
            strikes = K.opens[c] != 0 or -speed(K, K.normal[c]) >= (1.0 - 1e-9) * most if K.kind[c] == 0 else False
            K.active[c] = 1 if (K.touched[c] == 1 and strikes) else 0
            K.free[c] = 1 if (K.active[c] == 1 and K.opens[c] == 0) else 0
        loosen(K)
        for k in range(K.n_rows):
            c = K.row_contact[k]
            K.given[k] = 0.0
            K.bias[k] = speed(K, k)
            if c >= 0 and K.free[c] == 1 and K.row_normal[k] == 1:
                K.bias[k] *= 1.0 + K.restitution[c]
        status = blow(K)
        if status != 0:
            return status
    return NO_IMPACT


def end_sequence(K: Any, fastest: float) -> None:
    """Contacts that neither approach nor part stay closed."""
    for c in range(K.n_contacts):
        K.active[c] = 0
        if K.touched[c] == 1:
            leaves = K.opens[c] == 0 and speed(K, K.normal[c]) > 1e-9 * fastest
            stays = not leaves and (K.closed[c] == 1 or K.restitution[c] == 0.0)
            K.active[c] = 1 if stays else 0
        K.touched[c] = 0


def gains_energy(K: Any) -> bool:
    """Whether impulses do work on the mechanism, −½ Σ Λ (γ⁻ + γ⁺) < 0: restitution that sticks can (Kane's paradox)."""
    n = K.n
    o_B = n * n + n + n * K.n_rows
    loss = 0.0
    size = 0.0
    for k in range(K.n_rows):
        if K.impulse[k] != 0.0:
            half = 0.0
            for j in range(n):
                half += 0.5 * K.acc[o_B + k * n + j] * K.jump[j]
            before = row_speed(K, k)
            loss += K.impulse[k] * (before + half)
            size += abs(K.impulse[k]) * (abs(before) + abs(half))
    return bool(loss < -1e-9 * size)
