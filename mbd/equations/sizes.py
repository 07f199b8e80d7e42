"""How large the equations of a model become, predicted from its joints before anything is derived.

Each pair of coordinates on one path from the ground has an entry in the mass matrix, which straight-line code works
out where pairs are few, and a loop where they are many (`mbd.equations.composite_mass`): code then grows with the
bodies, arrays with the square of the coordinates.
"""

from mbd.errors import ModelError
from mbd.free_memory import available, size_in_words
from mbd.topology.plan import Plan

OF_PAIR = {True: 10.0, False: 40.0}
"""Operations for each pair of coordinates on one path, of planar and of spatial models [-]."""
OF_COORDINATE = {True: 285.0, False: 920.0}
"""Operations for each coordinate beside that [-]."""
BYTES, SECONDS = 800.0, 25e-6
"""Memory and time of an operation as it is derived and compiled; both measured, on chains of 30 to 1000 links."""
BYTES_OF_TANGENT = 550.0
"""Memory for each of these operations beside that as the tangent of implicit steps is derived and compiled."""
MIN_CHECKED_OPERATIONS = 1e6
"""Operations below which the free memory is not asked for [-]."""
MIN_LOOP_ENTRIES = 2000
"""Pairs of coordinates from which on M is filled by a loop: straight-line code takes 2 ns of each pair in place of 4,
elimination more than either, and making straight-line code 30 µs."""
MIN_JOINTS = 12
"""Fewer joints make no tree of so many operations: with two floating bodies each, 18 coordinates a joint at most."""


def is_surely_small(bodies: int) -> bool:
    """Whether no tree of so many bodies has operations enough to be checked, whatever its joints are."""
    most = 6 * bodies  # coordinates, on a single path
    return 0.5 * max(OF_PAIR.values()) * most * (most + 1) < MIN_CHECKED_OPERATIONS


def pairs_on_paths(plan: Plan) -> int:
    """Pairs of coordinates on one path from the ground, each coordinate with itself among them."""
    depth: dict[str, int] = {}
    pairs = 0
    for joint in plan.edges:
        above, own = depth.get(joint.parent.body.name, 0), len(joint.freedoms)
        pairs += own * above + own * (own + 1) // 2
        depth[joint.child.body.name] = above + own
    return pairs


def operations(plan: Plan) -> float:
    """About how many operations assembling derives: ``a pairs + b n``, and b n alone where a loop does the pairs."""
    pairs = pairs_on_paths(plan)
    return OF_PAIR[plan.planar] * (pairs if pairs < MIN_LOOP_ENTRIES else 0) + OF_COORDINATE[plan.planar] * plan.dof


def require_room(plan: Plan) -> None:
    """Refuse, before anything is derived, what would not fit into the memory that is free.

    Raises
    ------
    ModelError
        with the numbers of bodies and joints, the memory and the time predicted, and what to try.
    """
    expected, pairs = operations(plan), pairs_on_paths(plan)
    if expected < MIN_CHECKED_OPERATIONS and OF_PAIR[plan.planar] * pairs < MIN_CHECKED_OPERATIONS:
        return
    # of the two entries of a pair in the arrays that a run has for matrices
    needed, free = BYTES * expected + 80.0 * pairs, available()
    if needed <= free:
        return
    time = f"{SECONDS * expected / 60.0:.2g} minutes"
    joints = len(plan.edges) - len(plan.floating) + len(plan.cut)
    raise ModelError(
        f"{len(plan.bodies)} bodies and {joints} joints with {plan.dof} coordinates make about {expected:.2g} "
        f"operations: their equations need at least {size_in_words(needed)} and {time}, "
        f"and {size_in_words(free)} of memory is free; describe fewer bodies, branches in place of one long chain, or "
        "cut='all', whose bodies do not follow each other"
    )


def tangent_refused(derived: int) -> str:
    """Why Newton's matrix of `derived` operations is not derived: the free memory, what to try; '' where it fits."""
    if derived < MIN_CHECKED_OPERATIONS:
        return ""
    needed, free = BYTES_OF_TANGENT * derived, available()
    if needed <= free:
        return ""
    return (
        f"the equations take {derived:.2g} operations: the tangent of implicit steps needs at least "
        f"{size_in_words(needed)}, and {size_in_words(free)} of memory is free; use mbd.RungeKutta853(), which "
        "needs none, describe fewer bodies, branches in place of one long chain, or cut='all'"
    )


def require_room_for_tangent(derived: int) -> None:
    """Refuse Newton's matrix of `derived` operations where it would not fit into the memory that is free.

    Raises
    ------
    ModelError
        with the memory predicted, and what to try.
    """
    refused = tangent_refused(derived)
    if refused:
        raise ModelError(refused)
