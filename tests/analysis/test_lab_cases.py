"""The lab on cases with published answers: its reference meets them to its bound, its errors are those against them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.analysis.accuracy import choices, lab as laboratory, points
from mbd.analysis.accuracy.truth import MIN_REPORTED_OVER_BOUND
from mbd.cli import Script
from mbd.hardcases.knees import leg as knee_leg
from tests.analysis.test_numerical import ALL as OSCILLATING, DISCRETE, Unsquared, spring_and_dashpot
from tests.cases.double_pendulums import FORMS as DOUBLE
from tests.cases.flexible import NAMES, flexible_slider_crank
from tests.cases.walkers import compass, kneed, standing, strikes
from tests.problems import Case, case

SCHEMES = (mbd.HHT(alpha=0.05), mbd.RadauIIA(), mbd.RungeKutta853())


@pytest.fixture(autouse=True, scope="module")
def quick():
    """Small scenes need few rows of the reference; nothing is timed twice."""
    patch = pytest.MonkeyPatch()
    for place, name, value in ((choices, "MIN_ROWS", 150), (choices, "MAX_ROWS", 300), (points, "MAX_REPEATS", 1),
                               (laboratory, "MAX_TIMING_SECONDS", 0.0)):  # fmt: skip
        patch.setattr(place, name, value)
    yield
    patch.undo()


@dataclass(frozen=True, eq=False)
class Scene:
    """A model that is run until a time, and what is published of its end: quantity → (value, accuracy)."""

    model: Any
    start: mbd.State
    until: float
    end: Mapping[str, tuple[float, float]]
    dt: float
    schemes: Sequence[Any] = SCHEMES
    options: Mapping[str, Any] = field(default_factory=dict)

    def measured(self) -> mbd.Accuracy:
        """Each scheme with the step; those of high order with one eight times longer would have no clear error."""
        return mbd.accuracy(
            self.model, self.start, self.until, list(self.end), self.schemes, [self.dt], **self.options
        )  # fmt: skip


def assert_ends_agree(scene: Scene) -> mbd.Accuracy:
    """The reference against published ends, and every told error of an end against the true one."""
    found = scene.measured()
    truth = found.reference
    assert truth is not None, found.notes
    for name, (value, accuracy) in scene.end.items():
        scale = truth.scales[name]
        assert abs(truth.run[name][-1] - value) <= truth.bound[name] * scale + accuracy, name
        for scheme, point in zip(scene.schemes, found.points, strict=True):
            assert not point.failure, point.failure
            run = mbd.simulate(scene.model, scene.start, scheme, dt=scene.dt, until=scene.until, **scene.options)
            true, room = abs(run[name][-1] - value), truth.bound_of(scheme)[name] * scale + accuracy
            told = point.end_errors.get(name)
            if told is None:
                assert true <= MIN_REPORTED_OVER_BOUND * truth.bound_of(scheme)[name] * scale + room, (name, scheme)
            else:
                assert told * scale == pytest.approx(true, abs=1.001 * room), (name, scheme)
    return found


def ends(reference: Any, names: Sequence[str], which: int | None = None) -> dict[str, tuple[float, float]]:
    """The published values of some names, of the `which`-th instant."""
    values = np.atleast_1d(reference.value if which is None else reference.value[which])
    return {name: (float(value), reference.accuracy) for name, value in zip(names, values, strict=True)}


# motions that end at a time -----------------------------------------------------------------------------------------
A1, A2, A3, A4 = (case(name) for name in ("a1-simple-pendulum", "a2-double-pendulum", "a3-physical-pendulum-damper",
                                          "a4-coulomb-pendulum"))  # fmt: skip


@pytest.mark.parametrize("which", [0, 1, 2])
def test_a2_a_double_pendulum(which: int) -> None:
    swing, reference = DOUBLE["Lagrange"](), A2["[theta1, theta2"]
    start = swing.start([A2.start[name] for name in ("theta1", "theta2", "thetadot1", "thetadot2")])
    until = float(reference.t[which])
    names = ["upper", "lower", "upper.rate", "lower.rate"]
    assert_ends_agree(Scene(swing.model, start, until, ends(reference, names, which), 2e-3))


# events -------------------------------------------------------------------------------------------------------------
def assert_instants_agree(
    scene: Scene, wanted: Sequence[float], accuracy: float, of: Any, all_published: bool = True
) -> mbd.Accuracy:
    """Published instants against those of the reference, and the largest shift that is reported against the true one.

    of : (run) → the instants of a run that are published; all_published : whether it has no others
    """
    found = scene.measured()
    truth = found.reference
    assert truth is not None, found.notes
    assert of(truth.run) == pytest.approx(np.asarray(wanted), abs=truth.event_bound + accuracy)
    for scheme, point in zip(scene.schemes, found.points, strict=True):
        assert not point.failure and point.same_events, (scheme, point)
        run = mbd.simulate(scene.model, scene.start, scheme, dt=scene.dt, until=scene.until, **scene.options)
        true = float(np.max(np.abs(np.array(of(run)) - wanted)))
        room = truth.event_bound + accuracy
        assert point.event_time >= true - 1.001 * room
        if all_published:
            assert point.event_time == pytest.approx(true, abs=1.001 * room)
    return found


GAITS = {"f2-compass-gait-3deg": (compass, False), "f3-kneed-walker-chen": (kneed, True)}


@pytest.mark.parametrize("name", GAITS)
def test_f2_f3_a_step_of_a_walker(name: str) -> None:
    build, knees = GAITS[name]
    reference: Case = case(name)
    slope, fixed = reference.definition["slope"], np.asarray(reference["fixed point"].value)
    model, period = build(reference.definition), float(reference["step period"].value)
    instants = [period, *([float(reference["knee strike"].value)] if knees else [])]
    quantities = {"left hip.angle": (0.0, 0.0), "right hip.rate": (0.0, 0.0)}
    scene = Scene(model, standing(model, fixed, slope), 1.1 * period, quantities, 1e-3)

    def published(run: mbd.Trajectory) -> list[float]:
        (strike,) = strikes(run, slope)
        return [strike.time, *([strike.knee] if strike.knee is not None else [])]

    found = assert_instants_agree(scene, instants, reference["step period"].accuracy, published)
    truth = found.reference
    assert truth is not None
    (strike,) = strikes(truth.run, slope)
    before = reference["state just before"]
    rates = max(np.abs(fixed[2:]).max(), np.abs(np.asarray(before.value)[2:]).max(), 10.0)  # [1/s] of change
    room = rates * truth.event_bound + 10.0 * truth.error
    assert strike.after == pytest.approx(fixed, abs=room + reference["fixed point"].accuracy)
    assert strike.before == pytest.approx(before.value, abs=room + before.accuracy)


@pytest.mark.parametrize(
    ("name", "release"),
    [pytest.param("h1-knee-stop-gap-law", "gap", marks=pytest.mark.slow), ("h1b-knee-stop-unilateral", "pull")],
)
def test_h1_a_knee_stop_with_two_laws_of_release(name: str, release: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choices, "MIN_ROWS", 1500)  # a contact lasts 13 ms, and runs are polynomials between rows
    monkeypatch.setattr(choices, "MAX_ROWS", 1500)
    reference = case(name)
    p, s, times = reference.definition, reference.start, reference["event times"]
    model = knee_leg((p["m1"], p["m2"]), (p["L1"], p["L2"]), p["g"], p["k"], p["c"], release)
    start = mbd.assemble(
        model,
        position={"hip.angle": s["theta1"], "knee.angle": s["theta2"] - s["theta1"]},
        velocity={"hip.angle": s["w1"], "knee.angle": s["w2"] - s["w1"]},
    )  # fmt: skip
    scene = Scene(model, start, float(times.value[-1]) + 0.05, {"knee.rate": (0.0, 0.0)}, 2e-4)
    names = {each.name for each in model.constraints if isinstance(each, mbd.Penalty)}
    assert_instants_agree(
        scene, times.value, times.accuracy, lambda run: [event.time for event in run.events if event.name in names],
        all_published=False,
    )  # fmt: skip


# mechanisms of the IVP test set -------------------------------------------------------------------------------------
LATER = [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)]


@pytest.mark.parametrize("which", LATER)
def test_c1_andrews_squeezing_mechanism(which: int) -> None:
    pytest.importorskip("benchmarks")
    from benchmarks.peers.models import posed
    from benchmarks.peers.scenes import SCENES

    reference, scene = case("c1-ivp-andrews")["[beta,theta"], posed(SCENES["S3b"])
    names = [f"{name}.angle" for name in ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")]
    schemes = (mbd.HHT(alpha=0.05), mbd.RadauIIA(), mbd.RungeKutta853(), mbd.HHT(alpha=0.05, formulation="index3"))
    published = ends(reference, names, which)
    assert_ends_agree(Scene(scene.model, scene.start, float(reference.t[which]), published, 2e-5, schemes))


@pytest.mark.slow
@pytest.mark.parametrize("which", range(3))
def test_c2_a_slider_crank_with_an_elastic_rod(which: int) -> None:
    reference = case("c2-ivp-slider-crank-flexible")
    model, start = flexible_slider_crank(reference.definition, reference.start["y0"])
    rigid, elastic, rates = reference["[phi1"], reference["[q1..q4]"], reference["rates of"]
    published = ends(rigid, NAMES[:3], which) | ends(elastic, NAMES[3:], which)
    published |= ends(rates, ["rod.rate", "slider.rate"], which)
    assert_ends_agree(Scene(model, start, float(rigid.t[which]), published, 2e-5))


# linear oscillators -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", DISCRETE)
def test_i4_the_error_of_fifty_steps_is_that_of_the_discrete_solution(name: str) -> None:
    reference = case("i4-discrete-exactness")
    w, xi, dt, steps = (reference.definition[each] for each in ("w", "xi", "dt", "steps"))
    model = spring_and_dashpot(w, xi, mass=3.7)
    start = mbd.assemble(model, position={"guide.displacement": reference.start["u0"]})
    exact, discrete = reference["exact u"].value, reference[f"[u, v, a] after 50 steps | {name}"].value[0]
    end = {"guide.displacement": (float(exact), 1e-14)}
    found = assert_ends_agree(Scene(model, start, steps * dt, end, dt, [DISCRETE[name], mbd.RungeKutta853()]))
    told = found.points[0].end_errors["guide.displacement"] * found.reference.scales["guide.displacement"]
    assert told == pytest.approx(abs(discrete - exact), abs=1e-8)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    "name", ["HHT alpha = 0.05 (chapter text)", "generalized-alpha rho_inf 0.5", "WBZ rho_inf 0.7"]
)
def test_i1_i2_the_error_is_that_of_the_published_period_and_damping(name: str) -> None:
    """After 20¼ periods with ω dt = 0.1 the phase is off by 0.1; the start, off by (ω dt)², leaves a few per cent."""
    spectral, limits = case("i1-spectral-properties"), case("i2-asymptotic-coefficients")
    w, turn, scheme = 2.0, 0.1, OSCILLATING[name]
    longer = spectral[f"relative period elongation T_bar/T - 1 at Omega = [0.1, 0.5, 1.0, 2.0] | {name}, xi=0"].value[0]
    damping = spectral[f"algorithmic damping ratio at Omega = [0.1, 0.5, 1.0, 2.0] | {name}, xi=0"].value[0]
    assert longer / turn**2 == pytest.approx(limits[f"lim of (T_bar/T - 1)/Omega^2 | {name}"].value, rel=0.01)
    model = spring_and_dashpot(w, 0.0, mass=1.3)
    start = mbd.assemble(model, position={"guide.displacement": 1.0})
    until = 20.25 * 2.0 * np.pi / w
    steps = round(until / (turn / w))
    found = mbd.accuracy(model, start, until, "guide.displacement", [scheme], [until / steps])
    phase = w * until / (1.0 + longer * (w * until / steps / turn) ** 2)
    predicted = np.exp(-damping * phase) * np.cos(phase)
    told = found.points[0].end_errors["guide.displacement"] * found.reference.scales["guide.displacement"]
    assert told == pytest.approx(abs(predicted), rel=0.03)


def radius(run: mbd.Trajectory) -> float:
    """The spectral radius of the steps of a linear oscillator: u₃ = c₂ u₂ + c₁ u₁ + c₀ u₀ along the run, its roots."""
    four = np.lib.stride_tricks.sliding_window_view(run["guide.displacement"], 4)
    four = four / np.max(np.abs(four), axis=1, keepdims=True)
    ahead = np.linalg.lstsq(four[:, :3], four[:, 3], rcond=None)[0]
    return float(np.max(np.abs(np.roots([1.0, *-ahead[::-1]]))))


def test_i3_the_square_of_beta_decides_whether_stiff_modes_decay_or_grow() -> None:
    """With ω dt = 1e4 the motion is not resolved, which the runs say; what they tell of their steps is published."""
    unsquared, squared = case("i3-hht-beta").quantities.values()
    alpha = case("i3-hht-beta").definition["alpha"]
    model = spring_and_dashpot(1e4, 0.0, mass=1.0)
    start = mbd.assemble(model, position={"guide.displacement": 1.0})
    known = {"radius": mbd.Known(squared.value, squared.accuracy, of=radius)}
    found = mbd.accuracy(
        model, start, 40.0, integrators=[mbd.HHT(alpha), Unsquared(alpha)], dts=[1.0], target=1e-6, known=known
    )  # fmt: skip
    right, wrong = found.points
    assert right.at_most < 1e-8 and right.reaches(1e-6) and "numerical energy gain" in right.note
    assert wrong.error == pytest.approx(unsquared.value / squared.value - 1.0, abs=1e-8)
    assert found.recommendation[0].startswith("For an error of 1e-6 use HHT(alpha=0.05) with dt = 1 s")


# very long times ----------------------------------------------------------------------------------------------------


def long_lab(periods: int, steps: Sequence[int], integrators: Any = None, store: int | None = None) -> mbd.Accuracy:
    """The example's scene and known values, over some of its periods."""
    names = Script.load("long-pendulum").names
    return mbd.accuracy(
        names["model"], names["start"], periods * names["period"], dts=[names["period"] / count for count in steps],
        integrators=integrators or names["integrators"], known=names["known"], store=store or names["store"],
    )  # fmt: skip


def test_j12_the_example_has_the_numbers_of_the_case() -> None:
    names, j12 = Script.load("long-pendulum").names, case("j12-long-time-1e5-periods")
    assert names["until"] == pytest.approx(j12["end time"].value, rel=1e-15)
    assert names["count"] == j12.definition["n_periods"] and names["theta0"] == j12.start["theta0"]
    assert names["known"]["energy"].value == j12["energy above"].value
    assert [names[name] for name in "Lgm"] == [j12.definition[name] for name in "Lgm"]


@pytest.mark.parametrize("periods", [1000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_j12_energy_is_bounded_and_phase_adds_up_by_the_published_values(periods: int) -> None:
    """As the case wants: energy at the end within five times what it did in the first ten periods, and the phase error
    periods × error of one × 2π within 5 %; HHT loses energy all the time."""
    found = long_lab(periods, (50, 100))
    assert found.is_published and found.notes == ()
    undamped, damped, eighth = (found.of(scheme) for scheme in found.schemes)
    few = long_lab(10, (50, 100), [mbd.Newmark()], store=1).points
    for long, short in zip(undamped, few, strict=True):
        assert long.errors["energy"] < 5.0 * short.errors["energy"]
        assert long.errors["period"] == pytest.approx(short.errors["period"], rel=0.05)
    assert undamped[-1].order == pytest.approx(2.0, abs=0.05)
    assert all(point.end_errors["energy"] > 5.0 * undamped[-1].errors["energy"] for point in damped)
    assert all(point.at_most < 1e-3 * undamped[-1].error for point in eighth)
