"""What a constraint is to the rest: the contract between a word and the equations, the active-set manager and results.

A constraint enters the balance ``M a + f + Bᵀ λ = 0`` in one of two ways::

    rows      h(q, t) = 0 or a(q, t) · v + b(q, t) = 0, held by a multiplier λ (the mechanism feels −λ along the row);
              with a `limit` only while |λ| ≤ limit, and beyond it λ = limit · sign of the rate (dry friction)
    a force   p along ∂g/∂q, pushing where p > 0, and forces along velocities (friction of a sole)

Laws without a `contact` act at all times. The others open and close: the active-set manager watches a gap g, closes the
contact as g falls through zero, stores what the law holds from that instant (a place, an approach speed), and opens it
by its rule. Rows close with an impact, ``γ⁺ = −e γ⁻``; a force law takes time for its impacts.

A constraint of one's own is a frozen dataclass with a `name`, derived from `mbd.constraints.Constraint`; it gives
`kind`, `mentions` and `act`, which returns a `Law`::

    def act(self, scope, hold):
        gap = self.measure.gap(scope)
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        return Law(contact=Closing(gap), push=k * mbd.maximum(-gap, 0.0))

`scope` is what forces have too (`mbd.bodies.scope.Scope`); ``scope.rate(gap)`` is ġ. ``hold(values)`` gives the values
as they were at the instant of closing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Literal, TypeAlias

from mbd.constraints.measure import Measure
from mbd.constraints.rules import When
from mbd.dataclass import dataclass
from mbd.tape.node import Node, Scalar

Hold: TypeAlias = "Callable[[Sequence[Scalar]], Sequence[Scalar]]"


@dataclass(frozen=True)
class Equation:
    """A row: ``value = 0`` of a function of the posture and t, or of one linear in velocities.

    part : its name within the law, '' for a single one; of rows of a contact 'normal' is the first, g = 0
    unit : 'm' or 'rad', of positions; that of a row on velocities times seconds
    level : 'position', or 'velocity' for a row that holds velocities only
    limit : of dry friction, ``|λ| ≤ limit`` [N, N m]: a scalar ≥ 0, or a function of the normal force p of the contact;
        None: the row holds whatever its multiplier is. A row on positions is held at its rate then
    reaction : further name of its multiplier in results: 'drive' for the force or torque −λ, 'tension' for λ; 'force':
        none
    may_fold : whether it may turn out to be 0 whatever the motion, and is left out then
    wraps : whether it compares angles modulo a turn, so that it needs no count of turns
    sliding : limit while it slides, of p and the speed; it tends to `limit` at rest. None: `limit` at every speed
    """

    value: Scalar
    part: str = ""
    unit: str = "m"
    level: Literal["position", "velocity"] = "position"
    limit: Scalar | Callable[[Scalar], Scalar] | None = None
    reaction: str = "force"
    may_fold: bool = False
    wraps: bool = False
    sliding: Callable[[Scalar, Scalar], Scalar] | None = None


@dataclass(frozen=True)
class Drag:
    """A force on the mechanism along a velocity while a contact is closed: its power is force · velocity.

    part : its name in results, 'friction', or 'friction.forward'; drags that have it up to the point are one effect, in
        the ledger of the kind 'friction', under another name of the kind 'penalty'
    may_fold : whether the mechanism may have no motion along it; it is left out then
    """

    velocity: Scalar
    force: Scalar
    part: str = "friction"
    may_fold: bool = False


@dataclass(frozen=True)
class Rubbing:
    """Smooth friction of a contact by rows: forces along the velocities of its slips, as functions of those and of p.

    slips : tangents of the contact as rows would have them, on positions (held at the place of now) or on velocities
    forces : of p, the normal force of the contact, and of the velocities of the slips: one on the mechanism along each
    """

    slips: Sequence[Equation]
    forces: Callable[[Scalar, Sequence[Scalar]], Sequence[Scalar]]


@dataclass(frozen=True)
class Closing:
    """When a law acts.

    gap : g [unit]: open where g > 0, closes as it falls through zero. A force law may watch a velocity
    unit : 'm' or 'rad', of the gap (times seconds, of a velocity)
    opens_on : 'pull' (as the multiplier or force would attract), 'gap' (a force law: as g > 0 again), or 'when' (by the
        rules alone)
    releases : `When` another contact closes
    only_while : name of a contact that must be closed, or a measure that must be positive, for the gap to be watched
    restitution : e of the impact with which rows close
    """

    gap: Scalar
    unit: str = "m"
    opens_on: Literal["pull", "gap", "when"] = "pull"
    releases: tuple[When, ...] = ()
    only_while: str | Measure | None = None
    restitution: float = 0.0


@dataclass(frozen=True)
class Law:
    """What a constraint does; see the module.

    rows : held by multipliers; of a contact the normal row first
    contact : when it acts; None: at all times
    push : p ≥ 0 along ∂g/∂q of a force law [N, N m]; along the velocity, where the gap is one
    drags : its forces along velocities
    rubbing : smooth friction of a contact by rows
    elastic : energy that the force law can give back [J], which the ledger books apart from losses; None: not told
    while_closed : name of a contact by rows that must be closed for rows on velocities to hold
    rates : (z, ż) of its first-order states ``scope.state(self.name, field, initial)``. They follow their rates at all
        times, also while a contact is open; forces, limits and `elastic` may depend on z, rows and gaps may not
    foot : places (x, y, z) of what touches while closed and while open, if no body tells them: 'name.foot.x' in results
    rates_while_open : of a force law, the rates of its states while it is open, one for each; True: the same as while
        it is closed, False: they stand still. Steps look ahead through the surface, where these must be smooth
    """

    rows: Sequence[Equation] = ()
    contact: Closing | None = None
    push: Scalar | None = None
    drags: Sequence[Drag] = field(default=())
    rubbing: Rubbing | None = None
    elastic: Scalar | None = None
    while_closed: str | None = None
    rates: Sequence[tuple[Node, Scalar]] = field(default=())
    rates_while_open: bool | Sequence[Scalar] = True
    foot: tuple[Sequence[Scalar], Sequence[Scalar]] | None = None
