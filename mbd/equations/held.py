"""Contacts that never open, and wheels that roll, as pictures show them: where the ground pushes, and which way."""

from collections.abc import Iterable
from functools import partial
from typing import Any

from mbd.bodies.algebra import total
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.disks import DiskTouchdown
from mbd.constraints.rolling import Rolling
from mbd.constraints.sphere_touchdown import SphereTouchdown
from mbd.constraints.touchdown import Touchdown
from mbd.topology.description import Description

WAYS = ("arm", "normal", "forward", "sideways")
"""Vectors of each: from the center to where it touches [m], and three directions of the ground."""

HELD_BY = ("normal", "grip")
"""What holds: a `Bilateral` along the normal, a `Rolling` along the ground."""


def held_contacts(model: Description) -> Iterable[tuple[str, Frame, str]]:
    """Name of the constraint, the frame that touches, and which of `HELD_BY`."""
    for word in model.constraints:
        if isinstance(word, Rolling):
            yield word.name, word.center, "grip"
        elif isinstance(word, Bilateral) and isinstance(word.measure, Touchdown | SphereTouchdown | DiskTouchdown):
            yield word.name, _frame(word.measure), "normal"


def offer_held(offer: Any, scope: Scope, model: Description) -> None:
    """Their vectors, as results that are not listed."""
    names = {name for name, _, _ in held_contacts(model)}
    for word in model.constraints:
        if word.name in names:
            what = word if isinstance(word, Rolling) else getattr(word, "measure", None)
            for k, way in enumerate(WAYS):
                offer(word.name, way, partial(_part, scope, what, k))


def _part(scope: Scope, what: Any, k: int) -> Triple:
    """Arm, normal, forward or sideways in ground axes."""
    arm = _arm(scope, what)
    if k == 0:
        return arm
    place = total(scope.frame(_frame(what)).position, arm)
    if k == 1:
        found: Triple = what.ground.normal_at(place, scope)
        return found
    way: Triple = what.ground.turned(what.ground.directions(place, scope)[k - 2], scope)
    return way


def _frame(what: Any) -> Frame:
    found: Frame = what.point if isinstance(what, Touchdown) else what.center
    return found


def _arm(scope: Scope, what: Any) -> Triple:
    if isinstance(what, Touchdown):
        return (0.0, 0.0, 0.0)
    if isinstance(what, SphereTouchdown):
        return what.arm(scope)
    if isinstance(what, DiskTouchdown):
        return what.edge_arm(scope)
    arm: Triple = what.arm(scope)
    return arm
