"""Steps near the end of sliding in a plane or in space, where the direction of γ turns fast and then is none.

Far from rest λ_T follows γ within a step. No step can go through ‖γ‖ = 0 like that: beyond it nothing slides on. So

- where γ turns, or falls, by much of itself, steps are shortened, ``h ≤ ½ ‖γ‖/‖γ̇‖``;
- where it runs straight into zero, ``γ̇ ∥ −γ``, the step holds one direction e, and ``e · γ`` passes zero with a change
  of sign, which is located as any other. The direction is corrected until γ itself is zero there: it is the mean
  direction of what is left of the motion.

A motion that only comes close to rest turns around it in shortened steps, and slides on.
"""

from mbd.equal import EQUAL_RTOL, MIN_DIVISOR, REST_SPEED
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import STICK
from mbd.kernel.contact.cone_turns import MIN_STEPS_TO_REST, STABILITY_SHARE, estimated_turn_rate
from mbd.kernel.contact.cones import (
    HOLD_AT_ONSET,
    HOLD_DIRECTION,
    MIN_DIRECTION_SPEED,
    across,
    aim,
    along,
    away,
    leads_group,
    product_of,
    set_hold,
    speed_of,
)
from mbd.kernel.events.guard_sides import REST_RATE_RTOL
from mbd.kernel.events.guards import judge
from mbd.kernel.events.locate import locate
from mbd.kernel.records import Frictions, Guards, Kernel, Switching
from mbd.kernel.stepping.trial_step import try_step, turns

MAX_STEP_SHARE = 0.5
"""Part of the time in which γ would reach zero, or turn by a radian, that a step may take [-]."""
ONSET_STEP_RATIO = 0.1
"""Part of a step that is tried where Newton's method fails as sliding begins, four times at most [-]."""
ONSET_STEP_GROWTH = 3.0
"""Each of the steps that follow over the one before [-]."""
MIN_ONSET_STEP_RATIO = 1e-7
"""Part of dt below which no such step is tried, and none is shortened for a turn [-]."""
REACHES_ZERO_SHARE = 0.8
"""Part of a step within which γ reaches zero if a direction is held in it [-]."""
HEAD_ON_SINE = 0.05
"""Sine of the angle between γ̇ and −γ below which γ runs into zero [-]."""
MIN_REST_STEP_RATIO = 1e-5
"""Part of dt below which no step is shortened for this; where γ asks for less it runs into zero at any angle [-]."""
MAX_HELD_TURN = 0.25
"""Turn of the direction that is held, from γ at the start of the step, beyond which γ turns away before zero [rad]."""
SLIDES_ON = -2
"""Of `come_to_zero`: what seemed to come to rest slides on."""
COMMON_REST_SHARE = 0.02
"""Part of its speed before the step at which another group rests at the same instant [-]."""


def approached_end(K: Switching, t1: float) -> float:
    """Where the step that was to end at t1 ends; K.hold tells which directions are held in it."""
    end = t1
    rest = 0.0  # time until all that is held is at rest, if it is known
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0:
            speed = speed_of(K, f, K.guards0, K.at_slip)
            change = speed_of(K, f, K.guards0, K.at_slip_rate)
            fall = -product_of(K, f, K.guards0, K.at_slip, K.at_slip_rate)
            h = t1 - K.time
            if K.hold[f] == HOLD_AT_ONSET and (speed <= REST_SPEED or fall < 0.0):
                continue
            set_hold(K, f, 0.0)
            if speed < MIN_DIRECTION_SPEED:  # it came to rest at the end of the last step: held, it is found to
                set_hold(K, f, HOLD_DIRECTION)
                continue
            if not change * MIN_STEPS_TO_REST * h > speed:
                continue
            turns_at = turning_of(K, f)
            slow = MAX_STEP_SHARE * speed <= MIN_REST_STEP_RATIO * change * K.dt
            straight = fall > 0.0 and (turns_at <= HEAD_ON_SINE * speed * change or slow)
            ends = fall > 0.0 and speed * speed < REACHES_ZERO_SHARE * h * fall
            line = turns_at <= EQUAL_RTOL * speed * change
            if straight and (ends or line or h < MIN_REST_STEP_RATIO * K.dt):
                set_hold(K, f, HOLD_DIRECTION)
                rest = max(rest, speed * speed / fall)
            elif fall > 0.0 or turns_at * h > MAX_STEP_SHARE * speed * speed:
                end = min(end, K.time + max(MAX_STEP_SHARE * speed / change, MIN_REST_STEP_RATIO * K.dt))
    # what is held needs a step in which it comes to rest
    if 0.0 < ONSET_STEP_GROWTH * K.begun_step < MIN_STEPS_TO_REST * rest and not turns(K):
        K.begun_step = 0.0
    if K.begun_step > 0.0:
        K.begun_step *= ONSET_STEP_GROWTH
        if K.begun_step < end - K.time:
            end = K.time + K.begun_step
        else:
            K.begun_step = 0.0
    if K.explicit == 1:
        rate = estimated_turn_rate(K)
        K.turning_step = max(STABILITY_SHARE / rate, MIN_ONSET_STEP_RATIO * K.dt) if rate > 0.0 else 0.0
        if 0.0 < K.turning_step < end - K.time:
            end = K.time + K.turning_step
    return end


def speeds_up(K: Guards) -> bool:
    """Whether what slides in a direction that turns gets faster, as all does that has begun to slide."""
    found = True
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION:
            found = found and product_of(K, f, K.guards0, K.at_slip, K.at_slip_rate) >= 0.0
    return found


def turning_of(K: Guards, f: int) -> float:
    """‖γ × γ̇‖ of the group of f at the accepted state."""
    square = 0.0
    for g in range(f, f + K.group_size[f]):
        for k in range(g + 1, f + K.group_size[f]):
            turned = K.guards0[K.at_slip + g] * K.guards0[K.at_slip_rate + k]
            turned -= K.guards0[K.at_slip + k] * K.guards0[K.at_slip_rate + g]
            square += turned * turned
    return sqrt(square)


def slides_at_first(K: Frictions, h: float) -> bool:
    """Whether something slides whose direction may turn too fast for a step of dt: one of h may follow it."""
    return not (K.adaptive == 1 or h < MIN_ONSET_STEP_RATIO * K.dt) and turns(K)


def slides_on(K: Guards) -> bool:
    """Whether a candidate with a held direction has not come to rest: it is taken again, and the direction let go."""
    found = False
    for f in range(K.n_frictions):
        if keeps_direction(K, f):
            forward = along(K, f, K.guards1, K.at_slip)
            if forward > 0.0 and away(K, f, K.guards1, K.at_slip) > EQUAL_RTOL * forward:
                set_hold(K, f, 0.0)
                found = True
    return found


def slides_until_event(K: Guards) -> bool:
    """Whether what was held to come to rest slides on at an event before its rest: its direction is let go.

    Not where steps can no longer follow how it turns.
    """
    found = False
    for f in range(K.n_frictions):
        if keeps_direction(K, f) and may_follow(K, f):
            forward = along(K, f, K.guards1, K.at_slip)
            if forward > 0.0 and away(K, f, K.guards1, K.at_slip) > EQUAL_RTOL * forward:
                set_hold(K, f, 0.0)
                found = True
    return found


def shorter_turn(K: Guards, h: float) -> float:
    """A step of at most h in which directions that are not held turn by no more than they may."""
    least = h
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION:
            change = speed_of(K, f, K.guards0, K.at_slip_rate)
            if change > 0.0:
                least = min(least, MAX_STEP_SHARE * speed_of(K, f, K.guards0, K.at_slip) / change)
    return max(least, MIN_REST_STEP_RATIO * K.dt)


def come_to_zero(K: Kernel, h: float, t1: float) -> int:
    """After sliding was found to end, at the candidate: correct directions that are held until γ is zero there.

    Feet of one body come to rest together: all directions turn by ω times what is left across them over γ before the
    step, with ω by Aitken's relaxation, which is the secant method for one (Irons & Tuck 1969). `SLIDES_ON` where no
    directions near those of γ lead to zero, and steps can still follow how they turn, and where another group that is
    held slides on: it is not held in a shorter step.
    """
    given_up = SLIDES_ON if may_follow(K, K.event_index) else 0
    relaxation = 1.0
    for turn in range(8):  # corrections of a direction that is held
        f = K.event_index
        product = 0.0
        square = 0.0
        largest = 0.0
        for g in range(K.n_frictions):
            if K.group_size[g] > 1 and K.slip[g] != 0.0 and K.hold[g] == HOLD_DIRECTION:
                speed = speed_of(K, g, K.guards0, K.at_slip)
                largest = max(largest, away(K, g, K.guards1, K.at_slip) / (REST_RATE_RTOL * speed + 1e-13))
                left = across(K, g, K.guards1, K.at_slip) / (speed + MIN_DIVISOR)
                change = left - K.across[g]
                product += K.across[g] * change
                square += change * change
                K.across[g] = left
        if largest <= 1.0:
            break
        if turn > 0 and square > 0.0:
            relaxation *= -product / square
        angle = relaxation * speed_of(K, f, K.across, 0)
        small = abs(angle) < 0.5
        if small:
            turn_directions(K, relaxation)
            small = given_up == 0 or away(K, f, K.guards0, K.at_slip) < MAX_HELD_TURN * speed_of(
                K, f, K.guards0, K.at_slip
            )
        if not small:
            if given_up != 0:
                set_hold(K, f, 0.0)
            return given_up
        status = try_step(K, h, t1)
        if status != 0:
            return status
        K.active[: K.n_contacts + K.n_guards + K.n_frictions] = 0
        if not judge(K, h):
            return 0
        status = locate(K, h)
        if status != 0:
            return status
        if K.event_kind != STICK or not keeps_direction(K, K.event_index):
            return 0
    return SLIDES_ON if given_up != 0 and another_slides_on(K, K.event_index) else 0


def may_follow(K: Guards, f: int) -> bool:
    """Whether steps can still be short enough to follow how γ of the group of f turns."""
    speed = speed_of(K, f, K.guards0, K.at_slip)
    return bool(MAX_STEP_SHARE * speed > MIN_REST_STEP_RATIO * K.dt * speed_of(K, f, K.guards0, K.at_slip_rate))


def keeps_direction(K: Frictions, f: int) -> bool:
    """Whether f stands for a group that slides in a direction that is held."""
    return bool(leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] == HOLD_DIRECTION)


def turn_directions(K: Frictions, relaxation: float) -> None:
    """Turn all that are held towards what is left across them."""
    for f in range(K.n_frictions):
        if keeps_direction(K, f):
            angle = abs(relaxation) * speed_of(K, f, K.across, 0)
            part = relaxation * (MAX_HELD_TURN / angle if angle > MAX_HELD_TURN else 1.0)
            for g in range(f, f + K.group_size[f]):
                K.slip[g] += part * K.across[g]
            aim(K, f)


def another_slides_on(K: Guards, event: int) -> bool:
    """Whether a group that is held slides on where another one has come to rest; it is held no longer then."""
    found = False
    for f in range(K.n_frictions):
        if keeps_direction(K, f) and f != event and may_follow(K, f):
            left = along(K, f, K.guards1, K.at_slip)
            if left > COMMON_REST_SHARE * speed_of(K, f, K.guards0, K.at_slip):
                set_hold(K, f, 0.0)
                found = True
    return found
