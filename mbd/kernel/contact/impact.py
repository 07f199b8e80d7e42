"""Impact laws over all closed and closing contacts together.

``M (v⁺ − v⁻) + R λ̂ = 0``, bilateral and held rows ``B v⁺ + h_t = 0``, contacts push (−λ̂ ≥ 0), friction obeys Coulomb's
law on impulses. Kinetic energy changes by ``½ Σ λ̂ (γ⁻ + γ⁺)``, whatever the law.

Newton        ``0 ≤ γ⁺ + e γ⁻ ⟂ −λ̂ ≥ 0`` (Moreau 1988)
Poisson       compression with e = 0 to −λ̂_c; then e times that impulse, and more where contacts would penetrate
              (Pfeiffer & Glocker 1996, Multibody Dynamics with Unilateral Contacts, ch. 8)
sequential    one contact after the other, the fastest first, until none approaches; equally fast ones together
              (Han & Gilmore 1993, J. Mech. Design 115:412)
Stronge       as Poisson, with one factor on all impulses of the second phase, so that it gives back e² of the work that
              the normal impulses of the first took (Stronge 1990, Proc. R. Soc. Lond. A 431:169), never energy in all:
              taken where another law would create energy or, with restitution and friction, has no solution
"""

from mbd.equal import LAW_RTOL, ROUND_OFF_RTOL
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import CONFLICT, ENERGY_GAIN, NO_IMPACT, PULL
from mbd.kernel.contact.impact_solve import (
    energy_gain,
    gather,
    is_held_through,
    let_rebound,
    loosen,
    prepare,
    relative_gain,
    restitution_of,
    solve_impact,
    speed,
    start_over,
)
from mbd.kernel.records import ContactForces, Contacts, Switching
from mbd.kernel.stepping.restart import row_speed
from mbd.kernel.tangent_rules import note_order, note_zero

MAX_IMPACTS = 1000
"""Impacts of the sequential law at one instant [-]."""


def impact(K: Switching, slow: bool) -> int:
    """The velocities in K.y jump, by K.jump; impulses, negative where they push, are left in K.impulse.

    A slow impact (below the rest speed) sticks; in non-smooth steps, whose speeds are of the size of dt, only where
    that takes no pull. Afterwards K.active says which contacts are closed.
    """
    prepare(K)
    status = 0
    if slow or K.impact_law == 0 or K.plastic_impact == 1:
        over_step = K.strategy == 1 and K.n_cones > 0  # impulses of the whole step, none of which pulls
        status = newton_law(K, slow, not over_step)
        if slow and K.strategy == 1 and status == 0 and not over_step and would_hold_back(K):
            start_over(K)
            status = newton_law(K, slow, False)
    elif K.impact_law == 1:
        status = poisson_law(K, False)
    else:
        status = sequential_law(K)
    unsolved = status == CONFLICT or status == NO_IMPACT
    if status != 0 and not (unsolved and not slow and rebounds(K)):
        return status
    if not slow and (unsolved or energy_gain(K) > ROUND_OFF_RTOL):
        for c in range(K.n_contacts):
            if K.closing[c] > 0 and K.restitution[c] > 1.0:
                return status if unsolved else ENERGY_GAIN
        K.n_energetic_impacts += 1
        start_over(K)
        status = poisson_law(K, True)
        if status != 0:
            return status
        if energy_gain(K) > ROUND_OFF_RTOL:
            return ENERGY_GAIN
    if slow and K.strategy == 0:
        rest(K)
    for i in range(K.n):
        K.y[i] += K.jump[i]
    K.n_impacts += 1
    return 0


def rebounds(K: Contacts) -> bool:
    """Whether a contact closes with a restitution, without which other rows and friction may allow a solution."""
    found = False
    for c in range(K.n_contacts):
        found = found or (K.kind[c] == 0 and K.closing[c] > 0 and restitution_of(K, c) > 0.0)
    return found


def would_hold_back(K: ContactForces) -> bool:
    """Whether a contact that opens on pull would have to pull in the impact just found, its smooth step included."""
    for c in range(K.n_contacts):
        row = K.normal[c]
        if K.kind[c] == 0 and K.active[c] == 1 and K.opens[c] == 0:
            largest = 0.0
            for k in range(K.n_rows):
                if K.cluster[K.n + k] == K.cluster[K.n + row]:
                    largest = max(largest, abs(K.impulse[k] + K.past[k]))
            if K.impulse[row] + K.past[row] > PULL * largest:
                return True
    return False


def rest(K: ContactForces) -> None:
    """What holds a contact at rest that would leave more slowly than the rest speed is no impulse of the contact."""
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.active[c] == 1 and K.opens[c] == 0 and K.impulse[K.normal[c]] > 0.0:
            for k in range(K.n_rows):
                if K.row_contact[k] == c:
                    K.impulse[k] = 0.0


def newton_law(K: Switching, slow: bool, held: bool) -> int:
    """One impact that reverses the gap rates of closing contacts by their restitutions; a slow one may be `held`."""
    gather(K, slow, slow and held)
    for k in range(K.n_rows):
        c = K.row_contact[k]
        K.given[k] = 0.0
        K.bias[k] = row_speed(K, k)
        if c >= 0 and K.closing[c] > 0 and not slow and K.normal[c] == k:
            K.bias[k] += restitution_of(K, c) * (K.before[c] if K.strategy == 1 else K.bias[k])
    status = solve_impact(K)
    if status == 0 and not slow:
        let_rebound(K)
    return status


def poisson_law(K: Switching, energetic: bool) -> int:
    """Compression, then restitution of its impulses (Poisson) or of their work (Stronge)."""
    gather(K, False, False)
    for k in range(K.n_rows):
        K.given[k] = 0.0
        K.bias[k] = row_speed(K, k)
    status = solve_impact(K)
    if status != 0:
        return status
    K.trial_jump[: K.n] = K.total_jump[: K.n]
    for k in range(K.n_rows):
        K.trial[k] = K.total[k]
        K.trial_given[k] = 0.0
    for c in range(K.n_contacts):
        if K.closing[c] > 0 and K.kind[c] == 0 and K.active[c] == 1:
            row = K.normal[c]
            K.trial_given[row] = K.restitution[c] * K.total[row]
            if not energetic:
                note_zero(K, c, K.trial_given[row])
    status = give_back_work(K) if energetic else give_back(K, -1, 1.0)
    fastest = 0.0
    for c in range(K.n_contacts):
        K.touched[c] = 1 if (K.kind[c] == 0 and (K.closed[c] == 1 or K.closing[c] > 0)) else 0
        if K.touched[c] == 1:
            fastest = max(fastest, abs(row_speed(K, K.normal[c])))
    end_together(K, fastest)
    return status


def give_back(K: Switching, cluster: int, factor: float) -> int:
    """The second phase with this factor on the impulses K.trial_given of a cluster, from the end of the first.

    Contacts that are given an impulse part under it, unless they would approach; their tangents stay.
    """
    gather(K, False, False)
    K.total_jump[: K.n] = K.trial_jump[: K.n]
    for k in range(K.n_rows):
        K.total[k] = K.trial[k]
        K.given[k] = K.trial_given[k] * (factor if K.cluster[K.n + k] == cluster else 1.0)
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.trial_given[K.normal[c]] != 0.0:
            K.parting[c] = 1
            K.free[c] = 2
    for k in range(K.n_rows):
        K.bias[k] = speed(K, k)
    return solve_impact(K)


def work_given_back(K: ContactForces, row: int) -> float:
    """Work of a normal impulse in the second phase, ½ Λ (γ_c + γ⁺)."""
    before = row_speed(K, row)
    for j in range(K.n):
        before += K.acc[K.acc_B + row * K.n + j] * K.trial_jump[j]
    return float(-0.5 * (K.total[row] - K.trial[row]) * (before + speed(K, row)))


def work_to_give_back(K: ContactForces, row: int) -> float:
    """e² of the work of a normal impulse in compression."""
    rate = row_speed(K, row)
    for j in range(K.n):
        rate += 0.5 * K.acc[K.acc_B + row * K.n + j] * K.trial_jump[j]
    e = K.restitution[K.row_contact[row]]
    return float(e * e * K.trial[row] * rate)


def done_in(K: ContactForces, cluster: int) -> float:
    """Work that a cluster has been given back."""
    done = 0.0
    for k in range(K.n_rows):
        if K.trial_given[k] != 0.0 and K.cluster[K.n + k] == cluster:
            done += work_given_back(K, k)
    return done


def give_back_work(K: Switching) -> int:
    """The second phase, in which each of the clusters that nothing connects gives back its own work."""
    status = 0
    for cluster in range(K.n_clusters):
        found = False
        for k in range(K.n_rows):
            found = found or (K.trial_given[k] != 0.0 and K.cluster[K.n + k] == cluster)
        if found and status == 0:
            status = give_back_in(K, cluster)
    return status


def give_back_in(K: Switching, cluster: int) -> int:
    """The second phase with the largest factor that gives back no more than the work, and no energy in all.

    The work grows with the square of the factor while no branch changes; where one does, the factor is bisected. Less
    than the work is given back where friction would add to it, because it follows the direction at the end of a phase.
    Where friction jams, no factor gives any back: that work is lost, and impulses are Poisson's where all of it is.
    """
    status = give_back(K, cluster, 1.0)
    work = 0.0
    done = 0.0
    for k in range(K.n_rows):
        if K.trial_given[k] != 0.0 and K.cluster[K.n + k] == cluster:
            own = work_to_give_back(K, k)
            back = work_given_back(K, k)
            if abs(back) > ROUND_OFF_RTOL * own:
                work += own
                done += back
    if status != 0 or done == 0.0:
        return status
    work = max(work, 0.0)
    factor = sqrt(work / done) if done > 0.0 else 0.0
    status = give_back(K, cluster, factor)
    if status == 0 and (abs(done_in(K, cluster) - work) > 1e-12 * work or relative_gain(K, cluster) > 1e-13):
        low = 0.0
        high = max(2.0, 2.0 * factor)
        for _ in range(64):
            factor = 0.5 * (low + high)
            status = give_back(K, cluster, factor)
            if status != 0:
                return status
            if done_in(K, cluster) <= work and relative_gain(K, cluster) <= 1e-13:
                low = factor
            else:
                high = factor
        factor = low
        status = give_back(K, cluster, factor)
    for k in range(K.n_rows):
        if K.cluster[K.n + k] == cluster:
            K.trial_given[k] *= factor
    return status


def sequential_law(K: Switching) -> int:
    """Impact after impact of the contacts that approach fastest, each as if the others that push were not there."""
    gather(K, False, False)
    for c in range(K.n_contacts):
        K.touched[c] = K.active[c]  # takes part
    fastest = 0.0
    for _ in range(MAX_IMPACTS):
        most = 0.0
        for c in range(K.n_contacts):
            if K.touched[c] == 1:
                approach = -speed(K, K.normal[c])
                most = max(most, abs(approach) if is_held_through(K, c) else approach)
        fastest = max(fastest, most)
        if most <= LAW_RTOL * fastest or most < 1e-14:
            note_order(K, fastest, True)
            end_together(K, fastest)
            return 0
        for c in range(K.n_contacts):
            K.active[c] = 0
            K.free[c] = 0
            if K.touched[c] == 1:
                held = is_held_through(K, c)
                K.active[c] = 1 if held or -speed(K, K.normal[c]) >= (1.0 - 1e-9) * most else 0
                K.free[c] = 1 if (K.active[c] == 1 and not held) else 0
        note_order(K, fastest, False)
        loosen(K)
        for k in range(K.n_rows):
            c = K.row_contact[k]
            K.given[k] = 0.0
            K.bias[k] = speed(K, k)
            if c >= 0 and K.free[c] == 1 and K.normal[c] == k:
                K.bias[k] *= 1.0 + K.restitution[c]
        status = solve_impact(K)
        if status != 0:
            return status
    return NO_IMPACT


def end_together(K: ContactForces, fastest: float) -> None:
    """Contacts that took part, and neither part nor closed with a restitution, stay closed."""
    for c in range(K.n_contacts):
        K.active[c] = 0
        if K.touched[c] == 1:
            leaves = not is_held_through(K, c) and speed(K, K.normal[c]) > 1e-9 * fastest
            stays = not leaves and (K.closed[c] == 1 or K.restitution[c] == 0.0)
            K.active[c] = 1 if stays else 0
        K.touched[c] = 0
