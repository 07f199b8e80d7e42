"""What a failed run has met: a table of causes, each with its condition, its sentence and what to try.

Sentences name what `Words` tells of the failed step, such as ``{x.closed}``; it is worked out where it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.inertia import lost_inertia
from mbd.assembly.not_finite import first_cause, tape_inputs
from mbd.assembly.pose import Posture
from mbd.dataclass import dataclass
from mbd.integrators.base import Point
from mbd.kernel import codes
from mbd.kernel.schemes.iteration import MAX_ITERATIONS
from mbd.results.record import EventRecord
from mbd.simulation.diagnostics.grip import lost_grip
from mbd.simulation.diagnostics.painleve import consistent_forces
from mbd.simulation.diagnostics.redundant import clash
from mbd.simulation.diagnostics.residuals import residuals_of
from mbd.simulation.diagnostics.round_off import Remainder, remainder
from mbd.simulation.run.plain import PlainScheme
from mbd.simulation.run.stepper import Stepper
from mbd.tape.evaluate import evaluate

MAX_RATE_CHANGE = 3.0
"""Change of a rate in a step over the largest so far, above which dt is reported not to resolve the motion [-]."""


@dataclass(frozen=True)
class Cause:
    """A row of the table.

    status : codes of the kernel that it is for
    sentence, cure : what happened and what to try, with what `Words` tells as ``{x.…}``
    when : whether it is this one; the first row that holds counts
    """

    status: tuple[int, ...]
    sentence: str
    cure: str = ""
    when: Callable[[Words], Any] = lambda x: True

    def text(self, x: Words) -> str:
        """The sentence with the cure."""
        return (f"{self.sentence}; {self.cure}" if self.cure else self.sentence).format(x=x)


class Words:
    """What can be told of a failed step.

    Parameters
    ----------
    status : of the kernel
    events : of the run so far
    places : the frames that forces act on, by their names
    swiftest : largest rate of a coordinate in any row so far [m/s, rad/s]
    """

    def __init__(
        self, stepper: Stepper, status: int, events: Sequence[EventRecord], places: Mapping[str, str], swiftest: float
    ) -> None:
        self.stepper, self.status, self.events, self.places, self.swiftest = stepper, status, events, places, swiftest
        self.v = v = stepper.kernel
        names = sorted(stepper.manager.mode(v.closed[: v.n_contacts]).closed)
        self.closed = f" with {', '.join(map(repr, names))} closed" if names else ""
        self.residual, self.step, self.growth = float(v.failure_size), float(v.failure_step), float(v.unforeseen_change)
        self.tenth_of_dt, self.twentieth_of_step = v.dt / 10.0, 0.05 * float(v.step)
        self.dt_below_growth = 0.1 * float(v.step) / max(self.growth, 1.0)
        self.integrator = type(stepper.integrator).__name__
        own = stepper.scheme
        self.scheme = type(own.integrator).__name__ if isinstance(own, PlainScheme) else ""
        self.message = own.report.message if isinstance(own, PlainScheme) else ""
        self.own_message = f" ({self.message})" if self.message else ""
        self.as_shorter_ones = "" if v.explicit else ", as do steps down to a tenth of dt"
        self.last_events = last_events(events)

    @property
    def contact(self) -> str:
        """The name of the contact that failed."""
        return self.stepper.manager.names[int(self.v.failure_index)]

    @property
    def left(self) -> Remainder:
        """What Newton's method leaves, and could reach."""
        return remainder(self.stepper)

    @property
    def stagnated(self) -> str:
        """What residual a step has come down to, and what round-off allows where that is more than was asked for."""
        left, asked = self.left, float(self.v.tolerance)
        size = self.residual * asked if self.residual > 1.0 else left.residual  # of all stages and rows
        if left.attainable < asked:
            what = f"stagnated: residual {size:.3g} of forces or rows, where {asked:.3g} was asked for"
        else:
            what = f"stagnated at round-off: residual {size:.3g}, attainable {left.attainable:.3g} of the forces"
        return what + self.closed + self.worst

    @property
    def passing(self) -> str:
        """What passes singular configurations where a scheme did not."""
        return (
            "mbd.GeneralizedAlpha or mbd.RadauIIA" if self.v.explicit else "formulation='index3' with a damped scheme"
        )

    @property
    def schemes_over_poses(self) -> str:
        """Schemes that step over them where round-off is too large for this one."""
        return f"mbd.GeneralizedAlpha{', mbd.HHT or mbd.RadauIIA' if self.v.explicit else ' or mbd.HHT'}"

    @property
    def source_of_noise(self) -> str:
        misfit = self.v.misfit
        return f"round-off, or the {misfit:.1g} by which redundant rows do not fit," if misfit > 1e-14 else "round-off"

    @property
    def change(self) -> str:
        """Which rate a step has changed, from what to what."""
        who = int(self.v.failure_index)
        return (
            f"a step of {self.step:.2g} s takes the rate of {self.mover} from {self.v.y[who]:.3g} to "
            f"{self.v.y1[who]:.3g}{self.closed}"
        )

    @property
    def mover(self) -> str:
        """The coordinate of a motion."""
        return self.unknown.removeprefix("the motion of ")

    @cached_property
    def grip(self) -> str:
        """What has lost its grip, '' if nothing has."""
        return lost_grip(self.stepper, self.events)

    @cached_property
    def consistent_forces(self) -> tuple[str, str]:
        """How many forces the sliding contact that failed may have, and a clause with the numbers."""
        return consistent_forces(self.stepper, int(self.v.failure_index))

    @property
    def switches(self) -> str:
        most = self.v.max_switches
        many = max(self.v.n_switches, self.v.n_repeats) > most
        return f"more than {most} switches" if many else "the same switches again and again"

    @cached_property
    def lost_inertia(self) -> str:
        """A motion without inertia at the accepted state with the constraints that are active, '' if there is none."""
        K, stepper = self.v, self.stepper
        q, y, flags, anchors = (
            K.q[: K.n_q].copy(),
            K.y[: K.n].copy(),
            K.closed[: K.n_contacts],
            K.anchors[: K.n_anchors],
        )
        return lost_inertia(
            Posture(stepper.mechanism, stepper.manager, K.params, q, y, flags, anchors.copy(), time=float(K.time))
        )

    @property
    def undamped(self) -> str:
        """What to try where nothing damps contact forces that alternate from step to step."""
        v = self.v
        if v.explicit or v.estimates or v.gamma != 0.5 or v.alpha_m != v.alpha_f:
            return ""
        return "nothing in the scheme damps forces that alternate: take mbd.HHT(0.05); "

    @property
    def pressing(self) -> str:
        """What to try where impulses of the user's press contacts on after their strikes."""
        orders = {impulse.order for impulse in self.stepper.mechanism.equations.impulses}
        return "let the impulse act with order='before' or 'with'; " if 2 in orders else ""

    @property
    def why_singular(self) -> str:
        """What makes a Newton matrix singular, and what to try: rows, the mass matrix, or the step."""
        v, system, stepper = self.v, self.stepper.system, self.stepper
        if int(v.n_active) > 0:
            return "rows depend on each other: leave one out, or try another dt"
        mode = stepper.manager.mode(v.closed[: v.n_contacts])
        zero, y, layout = np.zeros(v.n_v), v.y[: v.n], stepper.mechanism.layout
        time, q = float(v.time), v.q[: v.n_q]
        if v.block_time > time:  # what the step was tried at
            y, time = v.block[layout.v : layout.a].copy(), float(v.block_time)
            q = system.compose(v.block[layout.q : layout.x].copy(), v.block[layout.x : layout.v].copy())
        with np.errstate(all="ignore"):
            terms = system.evaluate(Point(time, q, zero, y, np.zeros(v.n), np.zeros(0)), mode, (0.0, 0.0))
            M = np.asarray(terms.S)
            size = np.sqrt(np.abs(np.diag(M)))
            sizes = np.linalg.svd(M / np.outer(size, size), compute_uv=False) if np.all(size > 0.0) else np.zeros(1)
        if not np.isfinite(sizes).all() or sizes[-1] < 1e-12:
            return "no row acts there, so its mass matrix is: nothing resists that motion; give what it moves a mass"
        return (
            "no row acts there and its mass matrix is regular: dt is too large for a force that grows along the motion "
            "(a negative stiffness or damping); use a smaller dt"
        )

    @property
    def clashing(self) -> str:
        """Which rows depend on each other or conflict."""
        clashing = clash(self.stepper.mechanism.equations.rows, self.v)
        what = "depend on each other" if self.status == codes.DEPENDENT else "conflict"
        return f"rows {what}: {clashing}" if clashing else f"rows {what} at {self.unknown}"

    @property
    def worst(self) -> str:
        """Where the residual of the step that failed is largest, in words; without one the largest acceleration."""
        values = self.v
        if values.block_time != values.failure_time:
            return f", with the largest acceleration at {self._largest(values.rate)}" if values.n_v else ""
        sizes = {
            name: abs(size) for name, size in residuals_of(self.stepper, values.block).items() if np.isfinite(size)
        }
        if not sizes:
            return ""
        worst = max(sizes, key=lambda name: sizes[name])
        return f", furthest from balance at {worst if worst.startswith(chr(39)) else repr(worst)}"

    @property
    def sticking(self) -> str:
        """A clause on a contact that opens and closes alternately and sticks whatever its force, '' if none does."""
        equations, manager = self.stepper.mechanism.equations, self.stepper.manager
        limited = {friction.contact for friction in manager.frictions}
        for name in dict.fromkeys(event.name for event in self.events[-6:] if event.kind == "opened"):
            contact = manager.names.index(name)
            if len(equations.contacts[contact].rows) > 1 and contact not in limited:
                return (
                    f"{name!r} sticks whatever its force, and may pull closed and sink in open: with friction=mu it "
                    "slips there; else "
                )
        return ""

    @property
    def undoing(self) -> tuple[str, str]:
        """The modes that leave states and enter them again at the instant, with these, and what to try; '' for none."""
        equations, states = self.stepper.mechanism.equations, dict[str, dict[str, None]]()
        taken = {guard.name: guard.transition for guard in equations.guards}
        for event in self.events:
            change = taken.get(event.name)
            if change is not None and event.time == self.events[-1].time:
                machine = equations.machines[change.machine]
                states.setdefault(machine.name, {})[machine.states[change.target]] = None
        found = [f"{' and '.join(map(repr, of))} of {name!r}" for name, of in states.items() if len(of) > 1]
        if not found:
            return "", ""
        return (
            f", since the states {', and '.join(found)} undo each other",
            "restrict a transition with only_while=, or put a state between that lasts (after=); else ",
        )

    @property
    def touching(self) -> str:
        """The contacts that are closed or about to close, and the frictions of joints, in words."""
        values, manager = self.v, self.stepper.manager
        near = [name for c, name in enumerate(manager.names) if values.closed[c] == 1 or values.closing[c] != 0]
        near += dict.fromkeys(friction.name for friction in manager.frictions if friction.contact < 0)
        return f" at {', '.join(map(repr, near))}" if near else ""

    @property
    def unknown(self) -> str:
        """The coordinate or row behind a column of the KKT matrix."""
        equations, values = self.stepper.mechanism.equations, self.v
        column, n = int(values.failure_index), values.n
        if column < equations.n_v:
            return f"the motion of {equations.velocity_names[column].removesuffix('.rate')!r}"
        if column < n:
            return f"the state {equations.states[column - equations.n_v].name!r}"
        row = equations.rows[int(values.rows[min(column - n, values.n_rows - 1)])]
        return row.title

    @property
    def not_finite(self) -> str:
        """The first cause whose force is not finite where the step failed."""
        equations, values = self.stepper.mechanism.equations, self.v
        inputs = tape_inputs(self.stepper.mechanism, values.block, values.params)
        cause = first_cause(equations, inputs, self.places)
        if cause is None and not np.isfinite(evaluate(list(equations.balance), inputs)).all():
            fastest = self._largest(values.block[self.stepper.mechanism.layout.v :])
            return f"the inertia forces are not finite: {fastest} has run away; use a smaller dt or a weaker force"
        for impulse in equations.impulses if cause is None else ():
            if not np.isfinite(evaluate(list(impulse.vector), inputs)).all():
                return f"the size of impulse {impulse.name!r} is not finite; check its roots, logarithms, divisions"
        return cause or "a derivative of a force or constraint is not finite"

    def _largest(self, values: Vector) -> str:
        """The name of the rate that has the largest of these values, or the first one that is none."""
        sizes = np.nan_to_num(np.abs(values[: self.v.n_v]), nan=np.inf)
        return repr(self.stepper.mechanism.equations.velocity_names[int(np.argmax(sizes))])

    @cached_property
    def rushing(self) -> str:
        """What a fixed step makes of velocities, where that is far more than any has been so far; '' elsewhere."""
        values = self.v
        if values.adaptive or self.swiftest < 1e-3:  # a start from rest is no motion that runs away
            return ""
        gains = np.abs(values.rate[: values.n_v]) * values.dt
        times = float(np.max(gains, initial=0.0)) / self.swiftest
        if not MAX_RATE_CHANGE < times < np.inf:
            return ""
        name = self.stepper.mechanism.equations.velocity_names[int(np.argmax(gains))]
        return (
            f"; in a step of dt {name!r} changes by {times:.2g} times the largest rate so far: dt does not resolve the "
            f"motion, or a force lets it run away; try dt = {0.1 * values.dt / times:.1g} s"
        )


CAUSES = (
    Cause((codes.NOT_FINITE,), "{x.not_finite}{x.closed}", "nothing after the last accepted step is kept"),
    # Newton iterations that do not come to their end
    Cause((codes.STAGNATED, codes.TOO_TIGHT), "{x.stagnated}{x.rushing}", when=lambda x: x.rushing),
    Cause(
        (codes.STAGNATED, codes.TOO_TIGHT), "{x.stagnated}",
        "use a larger tolerance= of the integrator or a larger dt",
    ),
    Cause(
        (codes.NOT_CONVERGED,),
        "a step would miss an angle by more than half a radian, down to a tenth of dt{x.closed}{x.worst}: the motion "
        "is too fast to be resolved", "use a smaller dt", lambda x: x.residual < 0.0,
    ),
    Cause(
        (codes.NOT_CONVERGED,), "steps fail down to a tenth of dt; {x.scheme} says: {x.message}{x.closed}{x.worst}",
        "try a smaller dt{x.rushing}", lambda x: x.residual <= 1.0 and x.message,
    ),
    Cause(
        (codes.NOT_CONVERGED,),
        "steps fail down to a tenth of dt{x.closed}{x.worst}: a force changes too much within dt",
        "try a smaller dt, such as {x.tenth_of_dt:.1g} s{x.rushing}", lambda x: x.residual <= 1.0 and x.v.n_active == 0,
    ),
    Cause(
        (codes.NOT_CONVERGED,),
        "steps fail or leave the branch continuous in velocity, down to a tenth of dt{x.closed}{x.worst}: next to a "
        "singular configuration, or in a force too steep for dt",
        "try a smaller dt, or, at such a pose, {x.passing}{x.rushing}", lambda x: x.residual <= 1.0,
    ),
    Cause(
        (codes.NOT_CONVERGED,),
        f"Newton stalled at {{x.residual:.3g}} times the tolerance after {MAX_ITERATIONS} iterations"
        "{x.own_message}{x.closed}{x.worst}",
        "try a smaller dt or softer stiffness; a force that jumps with the state (mbd.where, sign) must be made "
        "continuous, or be switched by an Event or Controller{x.rushing}",
    ),
    Cause(
        (codes.NO_DERIVATIVE,),
        "the step converges, but its derivatives by wrt= do not{x.closed}: forces change too much within it",
        "use a smaller dt, tol= or a smoother force",
    ),
    # steps whose change cannot be that of the motion
    Cause(
        (codes.OUTGROWN,),
        "{x.change}, by forces that grow with the motion: in a step of dt a change that nothing predicted grows by "
        "{x.growth:.2g} of itself. dt does not resolve the motion, or a force lets it run away",
        "try a smaller dt, such as {x.dt_below_growth:.1g} s",
    ),
    Cause(
        (codes.UNSTABLE,),
        "{x.change}, by forces that are stiff there: ω dt = {x.growth:.3g}, but {x.integrator} is stable up to "
        "{x.stepper.own.abilities.stability:g}",
        "beyond that errors grow from step to step; use a smaller dt, tol= or mbd.RadauIIA()",
    ),
    Cause(
        (codes.LEAPT,),
        "{x.change}, over a place where forces are over a hundred times those before and after it, such as the pole of "
        "1/x: the scheme sees nothing of them",
        "use a smaller dt to see what happens there, or a force that is bounded wherever the motion goes",
    ),
    Cause(
        (codes.GAINED,),
        "{x.change}, more than the forces along the way can do{x.as_shorter_ones}: dt does not resolve a force that is "
        "steep there", "try a smaller dt, such as {x.twentieth_of_step:.1g} s, or a softer force",
    ),
    # steps for which no size is right
    Cause(
        (codes.SINGULAR, codes.TOO_NEAR), "the Newton matrix is singular at {x.unknown}{x.closed}", "{x.why_singular}"
    ),
    Cause(
        (codes.TOO_BRIEF,),
        "{x.contact!r} is so stiff that its impact asks for steps below {x.step:.2g} s, a millionth of dt{x.closed}",
        "use a softer stiffness, mbd.Unilateral, or a smaller dt",
    ),
    Cause(
        (codes.TOO_SMALL,),
        "steps fell below {x.step:.2g} s without an error of {x.v.allowed:.2g} per second{x.closed}",
        "a force that jumps with the state (mbd.where, sign) must be made continuous, or be switched by an Event or "
        "Controller; or ask for less by tol=",
    ),
    Cause(
        (codes.SINGULAR_ROWS_MOVE,),
        "a singular configuration, at {x.unknown}{x.closed}: {x.source_of_noise} would make {x.residual:.1g} of the "
        "velocities in a step of {x.step:.2g} s over it",
        "use {x.schemes_over_poses}, or longer steps (a larger dt= or tol=)",
    ),
    Cause(
        (codes.JUMPED,),
        "the angle of {x.contact!r} jumps past zero{x.closed}, as a twist does at half a turn: there is no instant at "
        "which it closes",
        "keep the motion away from there, stop it before, or measure an angle that does not jump",
    ),
    # rows and masses
    Cause(
        (codes.ILL_CONDITIONED,),
        "accelerations have no correct digits{x.closed}: ones that are known are found with a relative error of "
        "{x.v.lost_digits:.1g} at {x.mover}, as the inertia of some motion is a small difference of large ones",
        "give light and slender bodies an inertia about their own center, put fewer of them into one chain, or try "
        "cut='all'",
    ),
    Cause(
        (codes.DEPENDENT, codes.CONFLICT), "{x.lost_inertia}{x.closed}",
        when=lambda x: x.v.failure_index < x.v.n and x.lost_inertia,
    ),
    Cause(
        (codes.DEPENDENT, codes.CONFLICT), "neither mass nor rows determine {x.unknown}{x.closed}",
        "give it a mass, or lock it", lambda x: x.v.failure_index < x.v.n,
    ),
    Cause(
        (codes.DEPENDENT, codes.CONFLICT), "{x.clashing}{x.closed}",
        "leave one out, hold fewer contacts closed, or, where they do so in this singular configuration only, start "
        "beside it",
    ),
    # switches, contacts and frictions
    Cause(
        (codes.ENDLESS_TRANSITIONS,), "transitions follow each other without end at one instant: {x.last_events}",
        "one of the modes needs another cause, or an only_while= that ends them",
    ),
    Cause((codes.CHATTER, codes.NO_IMPACT), "{x.grip}", when=lambda x: x.grip),
    Cause(
        (codes.CHATTER,), "{x.switches} at one instant: {x.last_events}; they follow each other without motion"
        "{x.undoing[0]}",
        "{x.undamped}{x.sticking}{x.pressing}{x.undoing[1]}give a contact a release rule, friction or a penalty law, "
        "an event a reset that leaves zero, or a transition another cause",
    ),
    Cause(
        (codes.NO_IMPACT,),
        "no forces or impulses let every contact push or open{x.touching}: one that sticks whatever its force may have "
        "none, where it pulls closed and would sink in open",
        "give it friction=mu, with which it slips there, or 0, a release rule or a penalty contact",
    ),
    Cause(
        (codes.ENERGY_GAIN,),
        "the impact law would create energy{x.touching}, and Stronge's in its place as well: a restitution above 1 "
        "does",
        "use one from 0 to 1",
    ),
    Cause(
        (codes.NO_FORCE,),
        "Painlevé: {x.consistent_forces[0]} at {x.contact!r}, which slides with friction so that a push makes it "
        "approach{x.closed}{x.consistent_forces[1]}",
        "rigid bodies with Coulomb friction have no motion there: lower the friction coefficient, or make the contact "
        "compliant with mbd.Penalty",
    ),
    Cause(
        (codes.NO_LOCATION, codes.AT_POSE), "the instant of an event could not be isolated{x.closed}{x.worst}",
        "try a smaller dt",
    ),
)  # fmt: skip
"""What the kernel's failures mean, the special before the general."""


def cause_of(x: Words, status: int) -> str:
    """The sentence about a failure, with its cure."""
    found = next((cause for cause in CAUSES if status in cause.status and cause.when(x)), None)
    return (
        f"{x.integrator} returned the status {status}, which is none of mbd.kernel.codes"
        if not found
        else found.text(x)
    )


def last_events(events: Sequence[EventRecord]) -> str:
    """The last switches, oldest first."""
    shown = [f"{event.name!r} {'happened' if event.kind == 'event' else event.kind}" for event in events[-6:]]
    return ", ".join(shown) or "no contact changed"
