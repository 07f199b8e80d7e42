"""The accuracy lab: its errors are the true ones, its reference is right to its bound, its advice follows."""

import csv
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import mbd
import mbd.analysis.accuracy.lab as lab
from mbd import cli
from mbd.analysis.accuracy import Point, choices, points
from mbd.analysis.accuracy.advice import advice, cheapest
from mbd.analysis.accuracy.lab import folds, retimed, with_orders
from mbd.analysis.accuracy.reference import RungeKuttaReference
from mbd.integrators import Integrator, StepReport, StepResult
from mbd.integrators.base import consistent_rates
from mbd.results.matching import aligned
from mbd.view.accuracy import clear, frontier
from tests.helpers import one_body
from tests.simulation.test_energy import chain

G = 9.81


@pytest.fixture(autouse=True, scope="module")
def quick():
    """A coarse reference is enough for small scenes; nothing is timed twice."""
    patch = pytest.MonkeyPatch()
    for place, name, value in ((choices, "MIN_ROWS", 150), (choices, "MAX_ROWS", 300), (points, "MAX_REPEATS", 1),
                               (lab, "MAX_TIMING_SECONDS", 0.0)):  # fmt: skip
        patch.setattr(place, name, value)
    yield
    patch.undo()


@dataclass(frozen=True)
class SymplecticEuler(Integrator):
    """Of first order: velocities first, positions with the new ones; gives up on steps above a limit."""

    limit: float = 1.0

    def order(self, system=None):
        return 1

    def start(self, system, state, mode, dt):
        return None

    def step(self, system, state, dt, mode, memory):
        rates, _ = consistent_rates(system, state.time, state.q, np.concatenate([state.v, state.z]), mode)
        v = state.v + dt * rates[: len(state.v)]
        after = replace(state, time=state.time + dt, q=state.q + dt * v, v=v)
        return StepResult(after, None, StepReport(dt <= self.limit, residual=1.0))


def pendulum(angle=2.0):
    """A point mass on a rod of 1 m, released from rest."""
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=1.0), mbd.Revolute, "pin", title="pendulum")
    return model, mbd.assemble(model, position={"pin.angle": angle})


def swing(t, angle=2.0):
    """θ(t) of the pendulum by Jacobi's elliptic function (Landau & Lifshitz, Mechanics, §11)."""
    k = np.sin(angle / 2)
    return 2 * np.arcsin(k * ellipj(ellipk(k**2) - np.sqrt(G) * np.asarray(t), k**2)[0])


def ball(speed=0.0, restitution=0.5):
    model, mass = one_body(mbd.PointMass("ball", mass=2.0), mbd.Translation, "fall", axes="y")
    model.constrain(mbd.Unilateral("floor", mbd.height(mass.origin), restitution=restitution))
    return model, mbd.assemble(model, position={"fall.y": 1.0}, velocity={"fall.y": speed})


@pytest.fixture(scope="module")
def found(quick):
    model, start = pendulum()
    return mbd.accuracy(
        model, start, 3.0, integrators=[mbd.Newmark(), mbd.HHT(alpha=0.05), SymplecticEuler()], dts=[0.01, 0.02, 0.005],
        target=1e-3,
    )  # fmt: skip


def test_the_reference_of_a_pendulum_is_right_to_its_bound(found):
    run = found.reference.run
    true = np.max(np.abs(run["pin.angle"] - swing(run.time))) / np.ptp(run["pin.angle"])
    assert true <= found.reference.bound["pin.angle"] < 1e-8
    assert found.reference.error < 1e-8 and found.reference.growth < 100.0


def test_errors_of_a_pendulum_are_those_against_its_elliptic_function(found):
    model, start = pendulum()
    instants = found.reference.instants
    for scheme in (mbd.Newmark(), mbd.HHT(alpha=0.05)):
        for point in found.of(repr(scheme)):
            run = mbd.simulate(model, start, scheme, dt=point.dt, until=3.0)
            gaps = np.abs(run.at(instants)["pin.angle"] - swing(instants)) / found.reference.scales["pin.angle"]
            assert point.errors["pin.angle"] == pytest.approx(np.max(gaps), abs=2.0 * found.reference.error)
            assert point.end_errors["pin.angle"] == pytest.approx(gaps[-1], abs=2.0 * found.reference.error)
            assert point.energy == pytest.approx(np.max(np.abs(run.energy.numerical)), rel=1e-9)
            assert point.steps == 3.0 / point.dt and point.tangents > 0 and point.factorizations > 0


def test_schemes_show_the_orders_they_promise(found):
    for scheme, order in (
        ("Newmark(beta=0.25, gamma=0.5)", 2),
        ("HHT(alpha=0.05)", 2),
        ("SymplecticEuler(limit=1.0)", 1),
    ):
        each = found.of(scheme)
        assert [point.dt for point in each] == [0.02, 0.01, 0.005] and each[0].order is None
        assert [point.order for point in each[1:]] == pytest.approx([order, order], abs=0.15), scheme


def test_text_tables_and_page_say_the_same(found, tmp_path):
    text = repr(found)
    assert "Dormand–Prince" in text and "HHT(alpha=0.05)" in text and "For an error of 1e-3 use" in text
    frame = found.to_dataframe()
    assert len(frame) == 9 and frame["error"].max() == max(point.error for point in found.points)
    with found.to_csv(tmp_path / "table.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["error of pin.angle"]) == found.points[0].errors["pin.angle"]
    page = found.page(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "http://www.w3.org/2000/svg" in page and page.count("://") == 1 and "src=" not in page
    found.plot(tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")


def test_an_oscillator_with_a_row_is_judged_by_its_exact_motion():
    omega = 3.0
    model = mbd.Lagrangian(
        "two masses that move as one", ["x", "y"],
        kinetic=lambda x_rate, y_rate: (x_rate**2 + y_rate**2) / 4, potential=lambda x: omega**2 * x**2 / 2,
        constraints={"tie": lambda x, y: x - y},
    )  # fmt: skip
    start = mbd.assemble(model, position={"x": 1.0, "y": 1.0})
    result = mbd.accuracy(model, start, 2.0, "x", [mbd.GeneralizedAlpha(rho_inf=0.5)], [0.02, 0.01])
    run = result.reference.run
    assert np.max(np.abs(run["x"] - np.cos(omega * run.time))) < 1e-9
    assert run.violation.length + run.violation.rate < 1e-12
    for point in result.points:
        other = mbd.simulate(model, start, mbd.GeneralizedAlpha(rho_inf=0.5), dt=point.dt, until=2.0)
        instants = result.reference.instants
        true = np.max(np.abs(other.at(instants)["x"] - np.cos(omega * instants))) / result.reference.scales["x"]
        assert point.error == pytest.approx(true, abs=1e-8)


def test_a_bouncing_ball_is_exact_for_schemes_of_order_two_and_the_lab_says_so():
    model, start = ball()
    result = mbd.accuracy(model, start, 1.5, None, [mbd.Newmark(), SymplecticEuler()], [0.01, 0.005])
    first = np.sqrt(2.0 / G)
    hits = [event.time for event in result.reference.run.events if event.kind == "closed"]
    flights = first + np.concatenate([[0.0], np.cumsum([2.0 * first * 0.5 ** (k + 1) for k in range(len(hits) - 1)])])
    assert hits == pytest.approx(flights, abs=1e-10)
    newmark, euler = result.of("Newmark(beta=0.25, gamma=0.5)"), result.of("SymplecticEuler(limit=1.0)")
    assert all(p.error is None and p.at_most < 1e-8 and p.event_time < 1e-9 for p in newmark)
    assert "no clear error" in newmark[0].note and newmark[1].order is None
    assert euler[0].error > 1e-3 and euler[0].event_time > 1e-4


def test_impacts_do_not_hide_the_order():
    """A pendulum rebounds from a wall: without matching of its hits, errors would be those of the jumps."""
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=1.0), mbd.Revolute, "pin")
    pin = model.joints[0]
    model.constrain(mbd.Unilateral("wall", mbd.extension(pin), restitution=0.8))
    start = mbd.assemble(model, position={"pin.angle": 0.5})
    result = mbd.accuracy(model, start, 3.0, None, [mbd.HHT(alpha=0.05)], [0.02, 0.01, 0.005])
    assert [point.order for point in result.points[1:]] == pytest.approx([2.0, 2.0], abs=0.1)
    assert result.points[-1].error < 1e-3 and all(point.same_events for point in result.points)
    times = [point.event_time for point in result.points]
    assert times[0] / times[1] == pytest.approx(4.0, rel=0.1)


def test_the_end_may_be_an_event():
    model, start = ball()
    result = mbd.accuracy(model, start, "floor", None, [SymplecticEuler()], [0.01, 0.005])
    assert result.reference.run.time[-1] == pytest.approx(np.sqrt(2.0 / G), abs=1e-10)
    assert result.points[1].order == pytest.approx(1.0, abs=0.3)
    with pytest.raises(mbd.UnknownNameError, match="floor"):
        mbd.accuracy(model, start, "flor")


def test_a_growing_error_is_reported():
    model, start = pendulum(np.pi - 1e-3)
    result = mbd.accuracy(model, start, 3.0, None, [mbd.HHT(alpha=0.05)], [0.01])
    assert result.reference.growth > 1e3
    assert any("grows" in note for note in result.notes)


def test_a_step_too_large_is_listed_and_the_others_go_on():
    model, start = pendulum()
    result = mbd.accuracy(model, start, 3.0, None, [SymplecticEuler(0.05)], [0.2, 0.01], target=1e-9)
    assert result.points[0].failure and result.points[0].error is None and result.points[1].error < 0.1
    assert "failed: " in repr(result) and "1 point failed" in " ".join(result.notes)
    assert "not reached; the best is SymplecticEuler(limit=0.05) with dt = 0.01 s" in result.recommendation[0]


def test_a_quantity_that_a_run_has_no_number_for_has_no_small_error():
    """What is left of the last hundredth of the energy has no root any more where a scheme damps."""
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=1.0), mbd.Revolute, "pin", title="pendulum")
    least = 0.99 * G * (1.0 - np.cos(0.6))
    model.observe(
        "margin",
        lambda a, v: a + 1e-3 * mbd.sqrt(v * v / 2.0 + G * (1.0 - mbd.cos(a)) - least),
        "pin.angle",
        "pin.rate",
    )
    start = mbd.assemble(model, {"pin.angle": 0.6})
    schemes = {"damps": mbd.HHT(0.3), "keeps": mbd.RungeKutta4()}
    study = mbd.accuracy(model, start, 4.0, quantities=["margin"], integrators=schemes, dts=[0.1])
    lost, kept = study.points
    assert "is no number" in lost.failure and lost.at_most is None and not kept.failure
    assert kept.error < 0.1


def test_every_wrong_argument_is_named_at_once():
    model, start = pendulum()
    with pytest.raises(mbd.UnknownNameError, match=r"pin\.angel[^\n]*did you mean 'pin\.angle'[\s\S]*rods\.end"):
        mbd.accuracy(model, start, 1.0, ["pin.angel", "rods.end.x", "pin.angle"])
    with pytest.raises(mbd.ModelError) as caught:
        mbd.accuracy(model, start, 1.0, integrators=["HHT"], dts=[-1.0, 1e-3])
    assert len(caught.value.faults) == 2
    with pytest.raises(mbd.ModelError) as caught:
        mbd.accuracy(model, start, 1.0, target=0.0, tolerances=[1e-3])
    assert len(caught.value.faults) == 2
    with pytest.raises(mbd.ModelError) as caught:
        mbd.accuracy(model, start, 1.0, dts="0.1", tols=[0.0, float("nan")])
    assert len(caught.value.faults) == 3
    with pytest.raises(mbd.ModelError, match="after the start"):
        mbd.accuracy(model, start, -1.0)


def test_an_interrupted_lab_keeps_its_points():
    def stop(done, total):
        if done > 5.5:
            raise KeyboardInterrupt

    model, start = pendulum()
    result = mbd.accuracy(model, start, 1.0, None, [mbd.HHT(alpha=0.05)], [0.04, 0.02, 0.01, 0.005], progress=stop)
    assert not result.complete and 1 <= len(result.points) < 4
    assert "interrupted" in result.notes[0] and result.points[0].error > 0.0


def test_a_scene_too_stiff_for_one_method_goes_to_the_other(monkeypatch):
    monkeypatch.setattr("mbd.analysis.accuracy.reference.MOST_STRIDES", {"DOP853": 0, "Radau": 4000})
    model, start = pendulum()
    result = mbd.accuracy(model, start, 0.5, None, [mbd.HHT(alpha=0.05)], [0.02])
    assert "Radau" in result.reference.method and result.points[0].error > 0.0
    assert np.max(np.abs(result.reference.run["pin.angle"] - swing(result.reference.run.time))) < 1e-8
    monkeypatch.setattr("mbd.analysis.accuracy.reference.MOST_STRIDES", {"DOP853": 0, "Radau": 0})
    result = mbd.accuracy(model, start, 0.5, None, [mbd.HHT(alpha=0.05)], [0.02])
    assert result.reference is None and "there is no reference" in " ".join(result.notes)
    assert result.points[0].error is None and result.points[0].steps == 25
    assert RungeKuttaReference().order() == 8 and RungeKuttaReference(method="Radau").order() == 5


# published values in place of a reference ---------------------------------------------------------------------------
def test_known_values_judge_in_place_of_a_reference():
    """A row of numbers is judged at its worst and at its end; other numbers at the end."""
    model, start = pendulum()
    exact, energy = float(swing(1.6)), -G * np.cos(2.0)
    known = {
        "pin.angle": mbd.Known(exact, accuracy=1e-12), "place": mbd.Known(exact, of="pin.angle"),
        "energy": mbd.Known(energy, of=lambda run: run.energy.total),
    }  # fmt: skip
    result = mbd.accuracy(model, start, 1.6, integrators=[mbd.Newmark()], dts=[0.02, 0.01], known=known, store=5)
    assert result.is_published and result.quantities == ("pin.angle", "place", "energy")
    assert "published values: pin.angle = " in repr(result) and result.reference.growth is None
    for point in result.points:
        run = mbd.simulate(model, start, mbd.Newmark(), dt=point.dt, until=1.6, store=5)
        assert point.errors["pin.angle"] == pytest.approx(abs(run["pin.angle"][-1] / exact - 1.0), rel=1e-9)
        assert point.errors["pin.angle"] == point.errors["place"]
        assert point.errors["energy"] == pytest.approx(np.max(np.abs(run.energy.total / energy - 1.0)), rel=1e-9)
        assert point.end_errors["energy"] <= point.errors["energy"] and "energy" in point.note
    assert result.points[1].order == pytest.approx(2.0, abs=0.15)


def test_every_wrong_known_value_is_named_at_once_and_a_function_that_raises_fails_its_points(tmp_path):
    model, start = pendulum()
    with pytest.raises(mbd.ModelError, match="known must be a dictionary"):
        mbd.accuracy(model, start, 1.0, known=[1.0])
    with pytest.raises(mbd.ModelError, match=r"store"):
        mbd.accuracy(model, start, 1.0, dts=[0.1], store=2)
    known = {"a": mbd.Known("1", of=len), "b": mbd.Known(1.0, -1.0, of=3), "pin.angel": 1.0, "rod.end": 1.0}
    with pytest.raises(mbd.ModelError) as caught:
        mbd.accuracy(model, start, 1.0, dts=[0.1], known=known)
    assert len(caught.value.faults) == 5 and "did you mean 'pin.angle'" in str(caught.value)
    with pytest.raises(mbd.ModelError, match="either quantities or known"):
        mbd.accuracy(model, start, 1.0, "pin.angle", dts=[0.1], known={"pin.angle": 1.0})
    for answer, said in ((lambda run: run.nothing, "AttributeError"), (lambda run: np.nan, "no finite 'x'"),
                         (lambda run: "a", "must be a number")):  # fmt: skip
        known = {"x": mbd.Known(1.0, of=answer)}
        result = mbd.accuracy(model, start, 1.0, integrators=[mbd.HHT()], dts=[0.1], known=known)
        assert said in result.points[0].failure and "No run succeeded" in result.recommendation[0]
        result.page(tmp_path / "page.html")
        result.plot(tmp_path / "plot.png")


def test_a_run_that_ends_without_its_energy_is_judged_by_known_values_but_not_by_a_reference():
    model, start = chain(1e5)
    known = {"end": mbd.Known(0.03, of=lambda run: run.time[-1])}
    judged = mbd.accuracy(model, start, 0.03, integrators=[mbd.Newmark()], dts=[1e-2], known=known).points[0]
    assert judged.at_most < 1e-12 and not judged.failure and "numerical energy gain" in judged.note
    compared = mbd.accuracy(model, start, 0.03, integrators=[mbd.Newmark()], dts=[1e-2]).points[0]
    assert "numerical energy gain" in compared.failure


def test_errors_above_a_tenth_are_told_where_no_others_are():
    given = [Point("a", 1.0, error=0.4, at_most=0.4, seconds=1.0), Point("b", 1.0, failure="fell")]
    (said,) = advice(given, None, 0.0)
    assert said == "No point has an error below a tenth; the best is a with dt = 1 s (error 0.4, 1 s)."


def test_a_wrong_name_is_told_before_a_run_that_takes_too_long(monkeypatch):
    monkeypatch.setattr(choices, "PROBES", (5,))
    model, start = pendulum()
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'pin.angle'"):
        mbd.accuracy(model, start, 1e4, "pin.angel")
    with pytest.raises(mbd.SimulationError, match="known values and dts to do without"):
        mbd.accuracy(model, start, 1e4)


# tolerances --------------------------------------------------------------------------------------------------------
def test_a_tolerance_is_a_point_with_the_error_of_its_coordinates_and_its_trial_runs(tmp_path):
    model, start = pendulum()
    schemes = [mbd.Newmark(), mbd.RungeKutta853(), SymplecticEuler()]
    result = mbd.accuracy(model, start, 2.0, None, schemes, [0.01], tols=[1e-6, 1e-4], target=1e-5)
    assert [(p.dt, p.tol) for p in result.of("RungeKutta853()")] == [(0.01, None), (None, 1e-4), (None, 1e-6)]
    instants = result.reference.instants
    for scheme in schemes[:2]:
        for point in result.of(repr(scheme))[1:]:
            run = mbd.simulate(model, start, scheme, tol=point.tol, until=2.0)
            true = np.max(np.abs(run.at(instants)["pin.angle"] - swing(instants)))
            assert point.achieved == pytest.approx(true, abs=1e-9) and true < point.tol
            assert point.estimated == run.stats["tolerance"]["estimated"] and point.order is None
            assert point.runs == len(run.stats["tolerance"]["runs"]) > 1 and 0.0 < point.trials < 1.0
            assert point.steps == run.stats["steps"]
    assert [p.tol for p in result.of("SymplecticEuler(limit=1.0)")] == [None]
    assert any("SymplecticEuler(limit=1.0) follows no tolerance" in note for note in result.notes)
    missed = [point for point in result.points if point.tol is not None and point.achieved > point.tol]
    assert sum("more than asked" in note for note in result.notes) == len(missed)
    text = repr(result)
    assert "tol 1e-06" in text and "achieved" in text and "trials" in text
    rows = list(csv.DictReader(result.to_csv(tmp_path / "t.csv").open(encoding="utf-8")))
    assert {row["tol"] for row in rows} == {"", "1e-06", "0.0001"}
    page = result.page(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<td>tol 1e-06</td>" in page and '"tol": 1e-06' in page.replace('":1', '": 1')
    result.plot(tmp_path / "plot.png")


def test_index_3_with_rows_follows_no_tolerance_and_the_lab_says_why():
    model = mbd.Lagrangian(
        "bead on a circle", ["x", "y"], kinetic=lambda x_rate, y_rate: (x_rate**2 + y_rate**2) / 2,
        potential=lambda y: G * y, constraints={"circle": lambda x, y: x**2 + y**2 - 1.0},
    )  # fmt: skip
    start = mbd.assemble(model, position={"x": 1.0, "y": 0.0})
    schemes = [mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3")]
    result = mbd.accuracy(model, start, 0.5, "x", schemes, tols=[1e-3])
    assert [(p.scheme, p.tol) for p in result.points] == [("HHT(alpha=0.05)", 1e-3)]
    assert any("index 3 follows no tolerance here" in note and "ggl" in note for note in result.notes)


def test_a_tolerance_out_of_reach_fails_with_the_best_that_was_reached_and_why():
    model, start = pendulum(3.0)
    result = mbd.accuracy(model, start, 3.0, None, [mbd.RungeKutta853()], tols=[1e-6, 1e-15], target=1e-18)
    good, bad = result.points
    assert good.failure == "" and good.achieved < 1e-5
    assert "tol = 1e-15 was not reached: the best run has an estimated error of" in bad.failure
    assert "round-off" in bad.failure and bad.estimated > 1e-15 and not bad.reaches(1.0)
    assert "An error of 1e-18 is not reached; the best is RungeKutta853() with tol = 1e-06" in result.recommendation[0]
    assert "so no run can be shown to do better" in result.recommendation[1]


def test_a_tolerance_is_recommended_where_it_is_cheapest():
    given = [*GIVEN, Point("eighth", None, error=1e-7, at_most=1e-7, seconds=0.0015, tol=1e-6)]
    text = advice(given, 1e-3, 1e-12)
    assert "use eighth with tol = 1e-06 (error 1e-07, 1.5 ms)" in text[0]
    assert "It is ten times more accurate already; ten times more than that" in text[2]


# what is left out, and what is said ---------------------------------------------------------------------------------
def test_schemes_of_high_order_are_among_the_defaults_with_longer_steps_until_the_reference_ends_them():
    model, start = pendulum()
    result = mbd.accuracy(model, start, 2.0)
    steps = {scheme: [p.dt for p in result.of(scheme) if p.dt] for scheme in result.schemes}
    assert len(steps["HHT(alpha=0.05)"]) == 6
    for scheme in "RadauIIA()", "RungeKutta853()":
        assert steps[scheme][0] > 2.0 * steps["HHT(alpha=0.05)"][0]
        assert any(p.tol for p in result.of(scheme))
    high = [p for p in result.of("RungeKutta853()") if p.dt]
    assert len(high) < 6 and high[-1].error is None and all(p.error for p in high[:-1])


def test_a_judged_scheme_with_the_formulas_of_the_reference_is_named_and_bounded_by_another():
    model, start = pendulum()
    result = mbd.accuracy(model, start, 2.0, None, [mbd.RungeKutta853(), mbd.HHT(0.05)], [0.1])
    truth = result.reference
    assert truth.bound_of(mbd.HHT(0.05)) is truth.bound and truth.bound_of(mbd.RungeKutta853()) is truth.checked
    assert (
        all(truth.checked[name] >= bound for name, bound in truth.bound.items()) and max(truth.checked.values()) < 1e-7
    )
    assert any("RungeKutta853(): the reference has the same formulas" in note for note in result.notes)
    alone = mbd.accuracy(model, start, 2.0, None, [mbd.HHT(0.05)], [0.1])
    assert alone.reference.checked is None and not any("formulas" in note for note in alone.notes)


def test_a_reference_that_has_not_converged_is_said_and_not_used(monkeypatch):
    monkeypatch.setattr("mbd.analysis.accuracy.truth.LOOSE", 1e-2)
    model = mbd.Model("double pendulum")
    upper, lower = (mbd.Link(name, mass=1.0, length=1.0, center=1.0) for name in ("upper", "lower"))
    model.connect(mbd.Revolute("hip", model.ground.origin, upper.start), mbd.Revolute("knee", upper.end, lower.start))
    start = mbd.assemble(model, position={"hip.angle": 2.5, "knee.angle": 1.0})
    result = mbd.accuracy(model, start, 10.0, None, [mbd.HHT(0.05)], [0.02], target=1e-3)
    assert result.reference is None and all(p.error is None and p.at_most is None for p in result.points)
    assert any("it has not converged" in note and "of the range of" in note for note in result.notes)
    assert result.recommendation == ("No error is known, so nothing can be recommended.",)


def test_no_order_is_told_where_contacts_are_not_smooth():
    model, start = ball()
    result = mbd.accuracy(model, start, 0.8, None, [mbd.HHT(0.05)], [0.01, 0.005], contact="nonsmooth", tols=[1e-3])
    assert all(p.order is None for p in result.points) and result.points[0].error > 0.0
    assert any("no order can be observed" in note for note in result.notes)
    assert any("follows no tolerance" in note and "nonsmooth" in note for note in result.notes)


# advice ------------------------------------------------------------------------------------------------------------
def point(scheme, dt, error, seconds, **more):
    return Point(scheme, dt, error=error, at_most=error, seconds=seconds, **more)


GIVEN = [
    point("quick", 0.2, 4e-3, 0.001), point("quick", 0.1, 1e-3, 0.002), point("quick", 0.05, 2.5e-4, 0.004),
    point("slow", 0.2, 1e-3, 0.003), point("slow", 0.1, 1e-4, 0.006),
    point("wrong", 0.1, None, 0.0001, failure="it fell"),
]  # fmt: skip


def test_the_cheapest_point_is_recommended_and_what_ten_times_more_costs():
    given = with_orders(GIVEN, {"quick": None, "slow": None, "wrong": None})
    assert cheapest(given, 1e-3).scheme == "quick" and cheapest(given, 2e-4).scheme == "slow"
    text = advice(given, 1e-3, 1e-9)
    assert "use quick with dt = 0.1 s (error 0.001, 2 ms)" in text[0]
    assert "costs 3 times the time: slow with dt = 0.1 s (error 0.0001, 6 ms)" in text[2]
    choices, limit, more = advice(given, None, 1e-9)
    assert choices == (
        "For an error of 1e-3 use quick with dt = 0.1 s (error 0.001, 2 ms); "
        "of 1e-4 use slow with dt = 0.1 s (error 0.0001, 6 ms)."
    )
    assert "a tenth of the least of all would need dt = 0.05 s and 12 ms with slow, by its order" in limit
    assert more == "Take shorter steps where points failed (1 of 6)."
    assert "known to 1e-05" in advice(given, None, 1e-5)[1]
    many = [point("s", 1.0, 0.9 * 10.0**-k, 1.0 + k) for k in range(1, 13)]
    choices, _, more = advice(many, None, 1e-30)
    assert (
        choices.count("s with") == 3
        and "0.01 use s" in choices
        and "1e-12 use s" in choices
        and "simulate(…, tol=…)" in more
    )


def test_a_point_with_more_work_in_less_time_is_timed_again():
    counts = {"steps": 10, "iterations": 10, "tangents": 10, "residuals": 10, "factorizations": 10}
    more = {name: 2 * count for name, count in counts.items()}
    calm = [point("a", 0.2, 4e-3, 1.0, **counts), point("a", 0.1, 1e-3, 2.0, **more)]
    fewer = replace(calm[1], iterations=5, seconds=0.5)  # better predicted: no wonder that it is quicker
    assert folds(calm) == [] and folds([calm[0], fewer]) == []
    busy = [replace(calm[0], seconds=9.0), *calm[1:], point("b", 0.1, 1e-3, 1.0, **more)]
    assert folds(busy) == [(0, 1)]
    times = {"a": iter([8.0, 1.0] * 20), "b": iter([1.0] * 20)}  # of a machine that is busy now and then
    timed = retimed(
        busy, lambda each: next(times[each.scheme]) if each.dt == 0.2 else each.seconds, 60.0, lambda _: None
    )
    assert folds(timed) == [] and timed[0].seconds == 1.0 and timed[1] == busy[1]


def test_the_least_time_for_an_error_grows_as_errors_shrink():
    shown = [each for each in GIVEN if clear(each)]
    best = frontier(shown)
    assert [each.seconds for each in best] == sorted(each.seconds for each in best)
    assert [each.error for each in best] == sorted((each.error for each in best), reverse=True)
    for error in (4e-3, 1e-3, 2.5e-4, 1e-4):
        assert cheapest(best, error) is cheapest(shown, error)


def test_an_error_out_of_reach_is_said_with_the_step_it_would_need():
    given = with_orders(GIVEN, {"quick": None, "slow": None, "wrong": None})
    text = " ".join(advice(given, 1e-6, 1e-9))
    assert "not reached; the best is slow" in text
    assert "slow would need dt = 0.025 s and 24 ms" in text  # of order log2(10), a hundredth of the error
    assert "known to 1e-05 only" in " ".join(advice(given, 1e-6, 1e-5))


def test_events_are_matched_in_order_with_the_least_shifts():
    assert aligned([1.0, 2.0], [1.05, 2.05], 0.1) == ([(1.0, 1.05), (2.0, 2.05)], [])
    pairs, alone = aligned([1.0, 1.5, 1.501, 2.0], [1.01, 2.01], 0.05)
    assert pairs == [(1.0, 1.01), (2.0, 2.01)] and alone == [1.5, 1.501]
    pairs, alone = aligned([], [1.0], 0.05)
    assert pairs == [] and alone == [1.0]


# the command -------------------------------------------------------------------------------------------------------
SCRIPT = """
import mbd
model = mbd.Model("pendulum")
rod = mbd.Link("rod", mass=1.0, length=1.0, center=1.0)
model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
start = mbd.assemble(model, position={"pin.angle": 1.0})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.7), 1e-3, 1.0
"""


def test_the_command_measures_a_script(tmp_path, capsys):
    script = tmp_path / "swing.py"
    script.write_text(SCRIPT, encoding="utf-8")
    assert cli.main(["accuracy", str(script), "--target", "1e-3", "--out", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "GeneralizedAlpha(rho_inf=0.7)" in text and "For an error of 1e-3 use" in text
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"accuracy.csv", "accuracy.png", "accuracy.html"}
    more = ["--dt", "0.1", "--dt", "0.05", "--quantity", "pin.rate", "--until", "0.5"]
    assert cli.main(["accuracy", str(script), "--target", "1e-13", "--out", str(tmp_path), *more]) == 1
    assert "An error of 1e-13 is not reached" in capsys.readouterr().out
    assert cli.main(["accuracy", str(script), "--quantity", "pin.angel", "--out", str(tmp_path)]) == 1
    assert "did you mean 'pin.angle'" in capsys.readouterr().err
