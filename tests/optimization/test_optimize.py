"""Optima of runs and gaits: in closed form, at constraints, beside trials that fail; gradients by differences."""

import math
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.optimization.formula import formula
from mbd.optimization.points import FunctionSource, GaitSource, slope_by_differences
from mbd.optimization.runs import RunSource
from tests.gait.walkers import simplest
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start


@cache
def pendulum():
    """A rod of radius of gyration 0.5 m, which passes its lowest point."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=2.0, length=1.0, center=0.8, inertia=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
    model.constrain(mbd.Event("below", mbd.measure(lambda a: a, "pin.angle"), terminal=True))
    return model, mbd.assemble(model, {"pin.angle": 0.01})


@cache
def throw():
    """A ball thrown over level ground, and a wall that ends its flight 11 m ahead."""
    model = mbd.Model("throw")
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, ball.origin))
    model.constrain(mbd.Event("lands", mbd.height(ball.origin), direction=-1, terminal=True))
    model.constrain(mbd.Event("wall", mbd.measure(lambda x: x - 11.0, "place.x"), terminal=True))
    return model, mbd.assemble(model, {"place.y": 1e-6}, {"place.x": 5.0, "place.y": 5.0})


def thrown(guess=(5.0, 5.0), high=20.0, **settings):
    model, start = throw()
    speeds = {"place.x.rate": (guess[0], 0.1, high), "place.y.rate": (guess[1], 0.1, 20.0)}
    return mbd.optimize(model, speeds, start, mbd.RungeKutta853(), 0.05, until="lands", **settings)


ENERGY = {"effort": (lambda n: n["place.x.rate"] ** 2 + n["place.y.rate"] ** 2, None, 72.0)}


def test_a_pendulum_is_quickest_at_its_radius_of_gyration():
    model, start = pendulum()
    found = mbd.optimize(
        model, {"rod.center": (0.8, 0.1, 1.0)}, start, mbd.RungeKutta853(), 0.02, until="below", minimize="time"
    )
    run = mbd.sensitivities(
        model, start, mbd.RungeKutta853(), 0.02, until="below", wrt=["rod.center"], of=["time"],
        parameters={"rod.center": found["rod.center"]},
    )  # fmt: skip
    assert found.success and abs(run["time", "rod.center"]) < 1e-6 and found.slope < 1e-6
    free = mbd.optimize(
        model.without("pin loss"), {"rod.center": (0.8, 0.1, 1.0)}, start, mbd.RungeKutta853(), 0.02, until="below",
        minimize="time",
    )  # fmt: skip
    assert free["rod.center"] == pytest.approx(0.5, abs=1e-6)
    assert free["time"] == pytest.approx(math.pi / 2.0 * math.sqrt(2.0 * 0.5 / 9.81), rel=1e-4)


@pytest.mark.parametrize("method", ["SLSQP", "trust-constr"])
def test_a_ball_of_given_energy_flies_farthest_at_45_degrees(method):
    """x = 2 v_x v_y/g; with v² = 72 it is 7.3394 m, and more energy adds dx/d(v²) = 1/g."""
    found = thrown((5.0, 4.0), maximize="place.x", constraints=ENERGY, method=method)
    assert found["place.x.rate"] == pytest.approx(6.0, rel=2e-5)
    assert found.objective == pytest.approx(72.0 / 9.81, rel=1e-6)
    assert found.violation < 1e-6
    if method == "SLSQP":
        (active,) = found.active
        assert found.success and (active.name, active.side) == ("effort", "highest")
        assert active.price == pytest.approx(1.0 / 9.81, rel=1e-6) and found.slope < 1e-6
        assert "price 0.102" in repr(found) and "effort" in found._repr_html_()


def test_a_bound_is_active_where_it_holds_the_optimum():
    found = thrown((2.0, 4.0), high=3.0, maximize="place.x", constraints=ENERGY)
    assert {each.name for each in found.active} == {"place.x.rate", "effort"}
    assert found["place.y.rate"] == pytest.approx(math.sqrt(63.0), rel=1e-7)


def test_a_trial_that_fails_shortens_the_step_and_is_kept():
    """Beyond 11 m there is a wall: with twice the energy the optimum lies at it."""
    more = {"effort": (ENERGY["effort"][0], None, 160.0)}
    found = thrown((3.0, 3.0), maximize="place.x", constraints=more, most=100)
    assert found.failed and "ends by 'wall'" in found.failed[0].outcome and "failed" in repr(found)
    assert not found.success and "fail" in found.message
    assert 10.8 < found.objective < 11.0 + 1e-9
    assert found.objective == max(trial.objective for trial in found.trials if not trial.outcome)


def test_a_sum_of_squares_is_a_fit_and_passes_by_trials_that_fail():
    target = [lambda n: n["place.x"] - 8.0, lambda n: n["time"] - 1.0]
    for method in ("least_squares", "SLSQP"):
        found = thrown((3.0, 3.0), minimize=target, method=method)
        assert found["place.x.rate"] == pytest.approx(8.0, rel=1e-5)
        assert found["place.y.rate"] == pytest.approx(9.81 / 2.0, rel=1e-5)
        assert found.success


@pytest.mark.parametrize("method", ["SLSQP", "least_squares"])
def test_sums_of_squares_have_their_optimum_in_any_unit(method):
    """Of random functions, with a constraint that does not act where the method takes one."""
    rng = np.random.default_rng(7)
    compared = 0
    for _ in range(3):
        A, b = rng.normal(size=(3, 2)), rng.normal(size=3)
        exact = np.linalg.lstsq(A, b, rcond=None)[0]

        def numbers(given, A=A, b=b):
            x = np.array([given["x"], given["y"]])
            return dict(zip("abc", A @ x - b, strict=True))

        unknowns = {name: (x + 0.8, x - 2.0, x + 3.0) for name, x in zip("xy", exact, strict=True)}
        limits = {} if method == "least_squares" else {"x": (exact[0] - 1.0, None)}
        for unit in (1e-6, 1.0, 1e6):
            parts = [lambda n, name=name, unit=unit: unit * n[name] for name in "abc"]
            found = mbd.optimize(numbers, unknowns, minimize=parts, constraints=limits, method=method)
            assert found.success
            np.testing.assert_allclose([found["x"], found["y"]], exact, rtol=0.0, atol=1e-5)
            compared += 1
    assert compared == 9


def test_a_function_of_the_unknowns_may_give_numbers_derivatives_or_nothing():
    def valley(x):
        if x["a"] > 2.0:
            raise mbd.SimulationError("falls at 0.4 s", None)
        return {"height": (x["a"] - 1.0) ** 2 + 10.0 * (x["b"] - x["a"] ** 2) ** 2}

    found = mbd.optimize(valley, {"a": (-1.2, -3.0, 3.0), "b": 1.0}, minimize="height", accuracy=1e-9)
    assert found.success and [found["a"], found["b"]] == pytest.approx([1.0, 1.0], abs=1e-4)
    model = throw()[0]

    def flight(x):
        begin = mbd.assemble(model, {"place.y": 1e-6}, {"place.x": x["place.x.rate"], "place.y": 4.0})
        return mbd.sensitivities(
            model, begin, mbd.RungeKutta853(), 0.05, until="lands", of=["place.x"],
            wrt=["place.x.rate"],
        )  # fmt: skip

    one = mbd.optimize(flight, {"place.x.rate": (4.0, 1.0, 5.0)}, maximize="place.x")
    assert one["place.x.rate"] == pytest.approx(5.0) and one.active[0].side == "highest"


def test_the_gradient_is_that_of_differences_also_of_starts_and_functions():
    model, start = throw()
    functions = {"slope": lambda s: {"gravity.x": 9.81 * mbd.sin(s), "gravity.y": -9.81 * mbd.cos(s)}}
    plain = {"slope": lambda s: {"gravity.x": 9.81 * math.sin(s), "gravity.y": -9.81 * math.cos(s)}}
    values = {"slope": 0.1, "place.y.rate": 6.0, "place.x": 0.3}
    own = dict(zip(values, np.eye(3), strict=True))
    points = []
    for given in (functions, plain):
        source = RunSource(model, start, mbd.RungeKutta853(), 0.05, None, "lands", given, values, "auto")
        points.append(source.at(values, ["place.x", "time"]))
        reach = formula(lambda n: n["place.x"] ** 2 / n["time"] + n["slope"], "objective", lambda name: None)
        assert reach.names == ("place.x", "time", "slope")
        point = points[-1]
        slope = reach.slope({**point.numbers, **values}, lambda n, p=point: own[n] if n in own else p.slope_of(n), 3)
        for k, name in enumerate(values):
            h = 1e-5
            ends = [source.at({**values, name: values[name] + s * h}, ["place.x", "time"]) for s in (1.0, -1.0)]
            numbers = [{**end.numbers, **end.values} for end in ends]
            difference = (reach.value(numbers[0]) - reach.value(numbers[1])) / (2.0 * h)
            assert slope[k] == pytest.approx(difference, rel=1e-7)
    assert points[0].slope_of("place.x") == pytest.approx(points[1].slope_of("place.x"), rel=1e-9)


@pytest.mark.parametrize("value", [0.0, 1e-30, 1e-15, -1e-12, 1e-9, -1e-6, 1e-3, 1.0, 1e3])
def test_differences_beside_zero_are_no_round_off(value):
    """A thousandth of a value of 1e-12 changes 9.81 + x by nothing; x alone and its logarithm need no more."""
    numbers = [(lambda x: 9.81 + x, 1.0), (lambda x: 3.0 * x, 3.0), (lambda x: 5.0, 0.0)]
    numbers += [(lambda x: 2.0 + math.sin(x), math.cos(value))] * (abs(value) <= 1.0)
    numbers += [(math.log, 1.0 / (value or 1.0))] * (value > 0.0)
    for number, slope in numbers:
        for share, order in ((1e-5, 2), (1e-3, 4), (1e-3, 6)):
            assert slope_by_differences(number, value, 1.0, share, order) == pytest.approx(slope, rel=3e-7, abs=1e-12)
    source = FunctionSource(lambda u: {"y": 9.81 + u["x"]}, {"x": 1.0})
    assert source.at({"x": value}, ["y"]).slope_of("y") == pytest.approx([1.0], rel=3e-7)


@cache
def long_gait():
    model, start = simplest()
    return mbd.limit_cycle(model, start, section="heel strike")


def test_a_gait_of_a_given_period_is_found_on_its_own_branch():
    """The short gait of the simplest walker is near at every slope, and of another period."""
    found = mbd.optimize(long_gait(), {"gamma": (0.009, 0.002, 0.03)}, minimize=[lambda n: n["period"] - 3.85])
    assert found.success and found["period"] == pytest.approx(3.85, abs=1e-7) and found.gait.stability == "stable"
    point = GaitSource(long_gait(), {"gamma": 0.009}).at({"gamma": 0.008}, ["period"])
    source = GaitSource(long_gait(), {"gamma": 0.009})
    ends = [source.at({"gamma": 0.008 + h}, ["period"]).numbers["period"] for h in (1e-5, -1e-5)]
    assert point.slope_of("period") == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-5)


@pytest.mark.slow
def test_the_steepest_slope_at_which_a_push_dies_out_by_a_fifth_each_step():
    found = mbd.optimize(
        long_gait(), {"gamma": (0.009, 0.002, 0.03)}, maximize="gamma", constraints={"largest multiplier": (None, 0.8)}
    )
    (active,) = found.active
    assert found.success and active.name == "largest multiplier"
    there = long_gait().at({"gamma": found["gamma"]})
    assert there.largest_multiplier == pytest.approx(0.8, abs=1e-7)
    h = 1e-5
    ends = [long_gait().at({"gamma": found["gamma"] + s * h}).largest_multiplier for s in (1.0, -1.0)]
    assert active.price == pytest.approx(2.0 * h / (ends[0] - ends[1]), rel=1e-3)


def test_ctrl_c_keeps_the_best_trial():
    count = 0

    def slow(x):
        nonlocal count
        count += 1
        if count > 12:
            raise KeyboardInterrupt
        return {"height": (x["a"] - 3.0) ** 4 + x["b"] ** 2}

    found = mbd.optimize(slow, {"a": 0.0, "b": 1.0}, minimize="height")
    assert not found.success and found.message.startswith("interrupted")
    assert found.objective == min(trial.objective for trial in found.trials)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"minimize": "place.xx"}, "did you mean 'place.x'"),
        ({"maximize": "time"}, "either minimize= or maximize="),
        ({"minimize": lambda n: math.sin(n["time"])}, "use mbd.sin"),
        ({"minimize": lambda n: n["tme"]}, "'tme'"),
        ({"minimize": 3.0}, "must be the name of a number"),
        ({"constraints": {"time": "small"}}, "limits of 'time'"),
        ({"constraints": {"time": (2.0, 1.0)}}, "limits of 'time'"),
        ({"parameters": {"ball.mas": 1.0}}, "did you mean 'ball.mass'"),
        ({"parameters": {"place.y.rate": (5.0, 6.0, 7.0)}}, "guess, lowest, highest"),
        ({"method": "BFGS"}, "'trust-constr'"),
        ({"method": "least_squares"}, "takes a list"),
        ({"until": None}, "needs until="),
        ({"until": 3.0}, "ends by 'lands'"),
        ({"functions": 3}, "functions must map"),
        ({"start": 3}, "start must be"),
        ({"problem": 3}, "problem must be"),
        ({"problem": lambda x: 3}, "start, dt, until: for the runs of a model"),
    ],
    ids=lambda given: given if isinstance(given, str) else next(iter(given)),
)
def test_faults_have_names(change, text):
    model, start = throw()
    given = {
        "problem": model, "parameters": {"place.y.rate": 5.0}, "start": start, "dt": 0.05, "until": "lands",
        "minimize": "time", **change,
    }  # fmt: skip
    with pytest.raises(mbd.MbdError, match=text):
        mbd.optimize(**given)


def test_runs_end_with_the_event_that_was_asked_for_whatever_else_happens_then():
    """The strike of a kneed walker's right foot releases the left foot and knee at the same instant."""
    model = kneed_walker()
    start, begin = kneed_walker_start(model), {"hip.mass": (0.5, 0.4, 0.6)}
    found = mbd.optimize(
        model, begin, start, mbd.RungeKutta853(), 0.005, until=("right foot", 2.0), minimize="time", most=3
    )
    first = found.trials[0]
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.005, until=("right foot", 2.0))
    assert run.events[-1].name != "right foot" and first.objective == pytest.approx(run.time[-1], rel=1e-9)
    with pytest.raises(mbd.GaitError, match=r"'right foot' does not happen by 0\.4 s"):
        mbd.optimize(model, begin, start, mbd.RungeKutta853(), 0.005, until=("right foot", 0.4), minimize="time")
