"""Laws of schemes behind `mbd.simulate`: those of machine code, and those with a step in Python."""

from collections.abc import Callable
from dataclasses import field
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.arrays import Matrix
from mbd.bodies.scope import Scope
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL, ROUND_OFF_RTOL
from mbd.errors import CapabilityError, MbdError, ModelError
from mbd.forces.base import Action, Force
from mbd.integrators.base import Integrator
from mbd.joints.base import Joint
from mbd.simulation.simulate import prepared
from mbd.state import State
from mbd.testing.findings import Findings, Verdict
from mbd.testing.integrators import observed_order

WITHIN, HIGH = 0.15, 0.75
"""How near the observed order must come to the promised one, and so above 5, where few halvings reach round-off."""
RUN_LENGTH = 0.6
"""Length of the runs [s]."""
STEPS = {1: 0.01, 2: 0.01, 4: 0.04, 5: 0.06}
"""The largest step by the promised order [s]; `LARGE_STEP` for higher ones."""
LARGE_STEP = 0.2
PYTHON_STEP = 0.05
"""Step of the runs in Python [s]."""
TOLERANCES = (1e-3, 1e-5)
MAX_ERROR_BETWEEN_ROWS = 0.5
"""The same between rows and at events, where errors of several signs meet."""
MORE_HALVINGS = 3
"""More halvings, where the order is not reached yet."""
MAX_INSTANTS = 8
"""Times between rows at which a run is looked at, at most."""
PARTS = ("time", "q", "v", "z", "a", "s", "lam")
HELD = ("q", "y", "rate", "lam", "anchors", "aux", "slope", "lam_slope", "shift", "shift_change", "past_stages")
"""Arrays of the accepted state and of what schemes remember, which a step leaves as they are."""


def check_scheme(
    integrator: Integrator | Callable[[], Integrator], *, dt: float | None = None, halvings: int = 3
) -> Verdict:
    """A scheme keeps its promises in runs of `mbd.simulate`: in trees, with rows, through impacts, cut and repeated.

    Three mechanisms are run: a double pendulum with a servo that has a first-order state (a tree), a slider-crank (rows
    on positions), a pendulum that hits a stop (an event, an impact, a restart). The laws:

    - the error at the end falls with the power `order()` of the step, within 0.15, and so it does behind an impact;
      between rows it falls with that power or the fourth, whichever is less; the impact comes when it should;
    - a run repeated gives the same bits, and so does one that is cut in two, at a row and behind the impact;
    - a step leaves the accepted state alone, and gives the same bits again from what is kept of it;
    - machine code and the steps in Python agree, within the lengths of memory that the entry gives;
    - ``tol=`` bounds the error where `check_tolerance` allows it, and is refused by name where it does not;
    - a force that is not a number ends the run by an error.

    Parameters
    ----------
    integrator : a scheme, or a function that makes one
    dt : the largest step [s]; by default one that suits the order
    halvings : how often it is halved

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    CapabilityError
        for an entry that the kernel cannot take, such as one whose memory is too short.
    """
    scheme = integrator if isinstance(integrator, Integrator) else integrator()
    if not isinstance(scheme, Integrator):
        raise ModelError(f"check_scheme takes an integrator or a function that makes one, not {scheme!r}")
    findings = Findings(f"scheme {scheme!r}")
    largest = dt if dt is not None else STEPS.get(scheme.order(), LARGE_STEP)
    scenes = [tree(), rows(), stopped()]
    for scene in scenes:
        refusal = scheme.check(scene.rows) if scene.rows else None
        if refusal:
            findings.note(f"{scene.title}: {refusal}")
            continue
        findings.where = scene.title
        plain = _in_python(findings, scheme, scene)
        if plain is None:
            continue
        if scheme.compiled_scheme:
            _compiled(findings, scheme, scene, plain)
        _orders(findings, scheme, scene, largest, halvings)
        _bits(findings, scheme, scene, largest)
        _tolerance(findings, scheme, scene)
    findings.where = "a torque that is no number after 0.3 s"
    _failure(findings, scheme, largest)
    return findings.verdict()


# scenes -------------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Scene:
    """A mechanism, its start, and its end by other schemes in small steps."""

    title: str
    model: Any
    start: State
    rows: int
    events: bool = False
    exact: dict[bool, Any] = field(default_factory=dict)

    def reference(self, high: bool) -> Any:
        """A fine run of another scheme than the one that is checked: of order 8, or 5 for one of high order."""
        if high not in self.exact:
            other = mbd.RadauIIA(1e-13) if high else mbd.RungeKutta853()
            self.exact[high] = self.run(other, dt=RUN_LENGTH / (1200 if high else 120))
        return self.exact[high]

    def run(self, scheme: Integrator, **settings: Any) -> Any:
        """A run of the scene."""
        return mbd.simulate(self.model, self.start, scheme, **{"until": RUN_LENGTH, **settings})


@dataclass(frozen=True)
class Servo(Force):
    """A torque T on a joint that lags: ``τ Ṫ = k (sin 3t − q) − T``, k = 3 N m/rad, τ = 0.3 s."""

    name: str
    joint: Joint

    kind = "applied"

    def mentions(self) -> list[Any]:
        return [self.joint]

    def parameters(self) -> dict[str, float]:
        return {}

    def act(self, scope: Scope) -> Action:
        motion = scope.joint(self.joint.name)
        torque = scope.state(self.name, "torque", 0.0)
        error = mbd.sin(3.0 * scope.time) - motion.coordinates[0]
        return Action(pairs=((motion.rates[0], torque),), rates=((torque, (3.0 * error - torque) / 0.3),))


@cache
def tree() -> Scene:
    """A double pendulum whose second joint has a servo."""
    model = mbd.Model("servo")
    upper = mbd.Link("upper", mass=1.2, length=0.5, center=0.2, inertia=0.1)
    lower = mbd.Link("lower", mass=0.8, length=0.4, center=0.2, inertia=0.05)
    elbow = mbd.Revolute("elbow", upper.end, lower.start)
    model.connect(mbd.Revolute("shoulder", model.ground.origin, upper.start), elbow)
    model.apply(Servo("servo", elbow))
    start = mbd.assemble(model, position={"shoulder.angle": 0.8, "elbow.angle": -0.5})
    return Scene("a double pendulum with a servo", model, start, 0)


@cache
def rows() -> Scene:
    """A slider-crank that swings under its weight."""
    model = mbd.Model("slider-crank")
    arm = mbd.Link("crank", mass=1.0, length=0.3, center=0.15, inertia=0.01)
    rod = mbd.Link("rod", mass=0.8, length=1.0, center=0.5, inertia=0.07)
    slider = mbd.PointMass("slider", mass=1.5)
    model.connect(
        mbd.Revolute("main", model.ground.origin, arm.start),
        mbd.Revolute("crank pin", arm.end, rod.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("slider pin", slider.origin, rod.end),
    )
    start = mbd.assemble(model, position={"main.angle": 0.6}, velocity={"main.angle": 1.5})
    return Scene("a slider-crank", model, start, len(mechanism_of(model).equations.rows))


@cache
def stopped() -> Scene:
    """A pendulum that hits a stop, and leaves it again."""
    model = mbd.Model("pendulum with a stop")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.constrain(mbd.Unilateral("stop", mbd.measure("hinge.angle", unit="rad"), restitution=0.6, friction=0.0))
    start = mbd.assemble(model, position={"hinge.angle": 0.9}, velocity={"hinge.angle": 0.0})
    return Scene("a pendulum that hits a stop", model, start, 1, events=True)


# laws ---------------------------------------------------------------------------------------------------------------
def _states(run: Any) -> Matrix:
    return np.hstack([run.record.q, run.record.v, run.record.z])


def _orders(findings: Findings, scheme: Integrator, scene: Scene, dt: float, halvings: int) -> None:
    """Order at the end and between rows; the instants of events."""
    exact, promised = scene.reference(scheme.order() > 5), scheme.order(_prepared(scene, scheme, dt).stepper.system)
    errors: list[tuple[float, float, float]] = []
    within = HIGH if promised > 5 else WITHIN
    for k in range(halvings + 1 + MORE_HALVINGS):
        errors.append(_errors(findings, scene.run(scheme, dt=dt / 2**k), exact, 2**k))
        order = observed_order([each[0] for each in errors], ROUND_OFF_RTOL)
        if k >= halvings and not (abs(order - promised) > within and errors[-1][0] > 1e3 * ROUND_OFF_RTOL):
            break
    hint = "order() must tell what the scheme reaches; check its start, its formula and Newton's tolerance"
    for place, what, least, most in (
        (0, "order as promised", promised - within, promised + within),
        (1, "order between rows, as promised up to 4", min(promised, 4) - MAX_ERROR_BETWEEN_ROWS, np.inf),
        (2, "order of the instants of events", promised - MAX_ERROR_BETWEEN_ROWS, np.inf),
    ):
        law, found = f"{what}: within {MAX_ERROR_BETWEEN_ROWS if place else within}", [each[place] for each in errors]
        order = observed_order(found, ROUND_OFF_RTOL if place == 0 else 10.0 * ROUND_OFF_RTOL)
        if place == 2 and not scene.events:
            continue
        if np.isnan(order):
            findings.note(f"{law}, on {scene.title}: every error is below {ROUND_OFF_RTOL:g}; give a larger dt")
            continue
        shown = ", ".join(f"{error:.3g}" for error in found)
        sentence = f"promised {promised}, observed {order:.2f}; errors at dt = {dt:g}, dt/2, …: {shown}"
        findings.holds(law, least <= order <= most, sentence, hint)


def _errors(findings: Findings, run: Any, exact: Any, every: int) -> tuple[float, float, float]:
    """Of the state at some rows or behind events, of coordinates between some rows, of the instants of events."""
    starts = np.flatnonzero(np.diff(run.time) > 0.0)
    starts = starts[:: -(-len(starts) // MAX_INSTANTS)]
    moments = 0.5 * (run.time[starts] + run.time[starts + 1])
    here, there = run.at(moments), exact.at(moments)
    apart = [here[each.name] - there[each.name] for each in run.columns.equations.coordinates]
    found, expected = ([event.time for event in each.events] for each in (run, exact))
    law, hint = "events: as many as in a fine run", "guards must see its candidates: q1, y1 and the block at t1"
    if not findings.equal(law, "events", len(found), len(expected), hint):
        return np.nan, np.nan, np.nan
    late = np.max(np.abs(np.subtract(found, expected)), initial=0.0)
    rows = slice(None, None, every) if not expected else slice(-1, None)
    places = np.searchsorted(exact.time, run.time[rows] - 1e-9)
    off = _states(run)[rows] - _states(exact)[places if not expected else rows]
    return float(np.sqrt(np.mean(off**2))), float(np.max(np.abs(apart))), float(late)


def _prepared(scene: Scene, scheme: Integrator, dt: float, backend: str = "auto", until: float = RUN_LENGTH) -> Any:
    options = {"contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6}
    return prepared(scene.model, scene.start, scheme, dt, until, {}, {**options, "backend": backend})


def _bits(findings: Findings, scheme: Integrator, scene: Scene, dt: float) -> None:
    """A run repeated, and cut in two, is the same run."""
    whole = scene.run(scheme, dt=dt)
    hint = "a scheme may depend on what is kept alone: `kept=True` in mbd.kernel.records, such as past_stages"
    _same(findings, "determinism: a run repeated gives the same bits", whole, 0, scene.run(scheme, dt=dt), hint)
    places = {len(whole.time) // 2, *(event.row for event in whole.events[:1])}
    for row in sorted(places):
        first = scene.run(scheme, dt=dt, until=float(whole.time[row]))
        second = mbd.simulate(scene.model, first.final, scheme, dt=dt, until=RUN_LENGTH)
        law = "restart: a run that is cut in two is the same to the bit"
        _same(findings, law, whole, len(whole.time) - len(second.time), second, hint)


def _same(findings: Findings, law: str, whole: Any, begin: int, part: Any, hint: str) -> None:
    for name in PARTS:
        found, expected = getattr(part.record, name), getattr(whole.record, name)[begin:]
        findings.equal(law, f"'{name}' of all rows", found, expected, hint, 0.0)


def _twice(findings: Findings, stepper: Any) -> Callable[[Any, float, float], int]:
    """The hook `step` of the interpreted kernel, taken twice from the same accepted state."""
    own = stepper.scheme.step

    def step(K: Any, h: float, t1: float) -> int:
        kept = stepper.reals.copy(), stepper.integers.copy()
        held = {name: getattr(K, name).copy() for name in HELD}
        status = own(K, h, t1)
        law = "transaction: a step leaves the accepted state"
        hint = "a step fills q1, y1, rate1, aux1, lam1 alone; `accept` moves them to q, y, …, and fills past_stages"
        for name, before in held.items():
            findings.equal(law, f"K.{name} after step()", getattr(K, name), before, hint, 0.0)
        first = np.concatenate([K.q1, K.y1, K.rate1, K.lam1])
        stepper.reals[:], stepper.integers[:] = kept
        again = int(own(K, h, t1))
        law, hint = "determinism: a step taken again gives the same bits", "what is not kept changed it"
        findings.holds(law, again == status, f"status {status}, then {again}", hint)
        if status == 0:
            found = np.concatenate([K.q1, K.y1, K.rate1, K.lam1])
            findings.equal(law, "the candidate", found, first, hint, 0.0)
        return again

    return step


def _in_python(findings: Findings, scheme: Integrator, scene: Scene) -> Any:
    """A run of some steps in Python, each taken twice; None where it fails."""
    run = _prepared(scene, scheme, PYTHON_STEP, "python", _few(scene))
    run.stepper.scheme.step = _twice(findings, run.stepper)
    with np.errstate(all="ignore"):
        plain, problem = run.complete()
    law, hint = "it steps in Python", "the same functions run in both kernels"
    return plain if findings.holds(law, not problem, problem, hint) else None


def _few(scene: Scene) -> float:
    return (8.0 if scene.events else 4.0) * PYTHON_STEP


def _compiled(findings: Findings, scheme: Integrator, scene: Scene, plain: Any) -> None:
    """Machine code and Python have the same numbers."""
    fast = scene.run(scheme, dt=PYTHON_STEP, until=_few(scene))
    if not fast.stats["compiled"]:
        findings.note("machine code: there is none here (llvmlite is not installed)")
        return
    law, hint = "machine code and Python agree", "its step in Python and its entry are one scheme; see backend='python'"
    for name in ("time", "q", "v", "z"):
        found, expected = getattr(fast.record, name), getattr(plain.record, name)
        findings.equal(law, f"'{name}' of all rows", found, expected, hint, NOMINAL_RTOL)


def _tolerance(findings: Findings, scheme: Integrator, scene: Scene) -> None:
    """A tolerance is kept, or refused in words."""
    if scheme.check_tolerance(scene.rows):
        try:
            scene.run(scheme, tol=TOLERANCES[0])
        except CapabilityError:
            findings.holds("a tolerance is refused where it cannot be kept", True, "", "")
        return
    exact = scene.reference(scheme.order() > 5)
    for tol in TOLERANCES:
        run = scene.run(scheme, tol=tol)
        error = float(np.max(np.abs(run.record.q[-1] - exact.record.q[-1])))
        sentence = f"tol = {tol:g}: error of a coordinate at the end {error:.3g}"
        hint = "`error` of its entry must leave the local error of x and (v, z) in K.error, and error_order() its power"
        findings.holds("a tolerance is kept", error <= 2.0 * tol, sentence, hint)  # by a factor of two


def _failure(findings: Findings, scheme: Integrator, dt: float) -> None:
    """A force that is not a number ends the run by an error."""
    model = mbd.Model("a torque that ends")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.apply(mbd.Motor("motor", hinge, torque=lambda t: mbd.sqrt(0.3 - t)))
    start = mbd.assemble(model, position={"hinge.angle": 0.9})
    sentence = "the run ended as if nothing had been wrong"
    try:
        run = mbd.simulate(model, start, scheme, dt=dt, until=RUN_LENGTH)
        found = bool(np.isfinite(_states(run)[-1]).all())
        sentence += "" if found else ", in a state that is no number"
    except MbdError:
        sentence = ""
    hint = "answer a code of mbd.kernel.codes, such as NOT_FINITE, where rates are not finite"
    findings.holds("a failed step says so", not sentence, sentence, hint)
