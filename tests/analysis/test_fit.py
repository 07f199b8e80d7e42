"""Parameters from measured motion: those that made it are found, with honest errors, and faults have names."""

import json
import tracemalloc
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy

import mbd
from mbd.analysis.fitting.data import Data
from mbd.analysis.fitting.fit import _Search, instants_of
from mbd.assembly.changed_start import changed_start
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

TIMES = np.linspace(0.05, 2.0, 40)


@cache
def pendulum():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.2, length=1.3, center=1.3)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.2)))
    return model, mbd.assemble(model, {"pin.angle": 0.4})


def seen(**parameters):
    model, start = pendulum()
    run = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0, parameters=parameters)
    return np.array(run.at(TIMES)["pin.angle"])


def found(values, parameters, **more):
    model, start = pendulum()
    return mbd.fit(model, start, {"time": TIMES, "pin.angle": values}, parameters, mbd.Newmark(), 0.02, **more)


@pytest.mark.slow
def test_a_walker_is_found_from_angles_and_instants_of_its_heel_strikes():
    model = kneed_walker()
    start = kneed_walker_start(model)
    truth = {name: 1.05 * model.parameters[name] for name in ("hip.mass", "right shank.mass")}
    times = np.linspace(0.05, 0.59, 20)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.6, parameters=truth)
    data = {"time": times, "left hip.angle": run.at(times)["left hip.angle"]}
    events = {name: instants_of(run)[name] for name in ("right foot.time", "right knee lock.time")}
    guess = {name: model.parameters[name] for name in truth}
    fitted = mbd.fit(model, start, data, guess, mbd.HHT(0.05), 2e-3, events=events, until=0.6)  # fmt: skip
    assert fitted.converged and fitted.alike == ()
    np.testing.assert_allclose([fitted.values[name] for name in truth], list(truth.values()), rtol=1e-7)
    assert all(abs(residual).max() < 1e-6 for residual in fitted.residuals.values())


def test_derivatives_are_those_of_the_residuals_through_an_impact():
    model = kneed_walker()
    start = kneed_walker_start(model)
    times = np.linspace(0.011, 0.7, 45)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.8)
    data = {"time": times, "left hip.angle": np.zeros(45), "trunk.x": np.arange(45.0), "right hip.rate": np.ones(45)}
    known = Data.read(data, {"right foot.time": instants_of(run)["right foot.time"]}, None)
    search = _Search(model, start, known, ("hip.mass", "left thigh.mass"), mbd.HHT(0.05), 2e-3, None, 0.8, "auto")
    search.check()
    values, h = np.array([model.parameters[name] for name in search.names]), 1e-5
    exact = search.slopes(values)
    central = np.transpose([
        (search.residuals(values + h * unit) - search.residuals(values - h * unit)) / (2 * h) for unit in np.eye(2)
    ])  # fmt: skip
    away = np.ones(len(exact), dtype=bool)
    away[:-1] = np.tile(np.min(np.abs(times[:, None] - [event.time for event in run.events]), axis=1) > 4e-3, 3)
    np.testing.assert_allclose(exact[away], central[away], rtol=2e-5, atol=2e-5 * np.abs(central).max())


@cache
def swing():
    """The case of a measured swing: a shank at a fixed knee and a foot at its ankle, absolute angles."""
    case = json.loads((Path(__file__).parents[1] / "cases/data/n1-prosthesis-identification.json").read_text())
    known = {sympy.Symbol(name): value for name, value in case["definition"]["known"].items()}
    m2, l1, c2, J2, rest, g = known
    J1, S1, d1, k2, d2 = names = sympy.symbols("J1 S1 d1 k2 d2")
    shank, foot = mbd.Coordinate("shank"), mbd.Coordinate("foot")
    model = mbd.Lagrangian(
        "prosthesis",
        [shank, foot],
        kinetic=(J1 + m2 * l1**2) * shank.v**2 / 2
        + J2 * foot.v**2 / 2
        + m2 * l1 * c2 * shank.v * foot.v * sympy.cos(shank.q - foot.q),
        potential=-(S1 + m2 * l1) * g * sympy.cos(shank.q)
        - m2 * c2 * g * sympy.cos(foot.q)
        + k2 * (foot.q - shank.q - rest) ** 2 / 2,
        dissipation=d1 * shank.v**2 / 2 + d2 * (foot.v - shank.v) ** 2 / 2,
        parameters={**dict(zip(names, case["definition"]["start_guess"], strict=True)), **known},
    )
    return case, model, mbd.assemble(model, {"shank": 1.0, "foot": 2.3})


def identified(data, more=None, **settings):
    case, model, start = swing()
    values = np.array(case["definition"][data])
    table = {"time": case["definition"]["sample_times"], "shank": values[:, 0], "foot": values[:, 1]}
    guess = dict(zip(("J1", "S1", "d1", "k2", "d2"), case["definition"]["start_guess"], strict=True))
    sigma = {"shank": 0.005, "foot": 0.005}
    settings = settings or {"dt": 0.01}
    return mbd.fit(model, start, table, {**guess, **(more or {})}, mbd.RungeKutta853(), sigma=sigma, **settings)


@cache
def measured_swing():
    return identified("data_noisy")


def test_a_measured_swing_gives_the_numbers_of_the_case():
    case = swing()[0]
    angles, exact, noisy, deviation, errors, predicted, correlation = case["quantities"]
    clean, measured = identified("data_noise_free"), measured_swing()
    seen = np.column_stack([clean.run.at(angles["t"])[name] for name in ("shank", "foot")])
    np.testing.assert_allclose(seen, angles["value"], atol=angles["accuracy"])
    np.testing.assert_allclose(list(clean.values.values()), exact["value"], atol=exact["accuracy"])
    np.testing.assert_allclose(list(measured.values.values()), noisy["value"], atol=noisy["accuracy"])
    assert measured.noise * 0.005 == pytest.approx(deviation["value"], abs=deviation["accuracy"])
    np.testing.assert_allclose(list(measured.errors.values()), errors["value"], rtol=errors["accuracy"])
    np.testing.assert_allclose(list(clean.predicted.values()), predicted["value"], rtol=predicted["accuracy"])
    np.testing.assert_allclose(clean.correlation, correlation["value"], atol=correlation["accuracy"])
    assert [pair[:2] for pair in measured.together()] == [("J1", "S1")] and "J1 and S1 go together" in repr(measured)
    truth = case["definition"]["true_parameters"]
    assert np.all(np.abs(np.subtract(list(measured.values.values()), truth)) < 4.0 * np.array(errors["value"]))


def test_where_a_swing_began_is_found_with_the_parameters():
    begin = {"shank": 0.9, "foot": 2.4, "shank.rate": 0.1, "foot.rate": 0.1}
    found = identified("data_noise_free", begin)
    assert [found.values[name] for name in begin] == pytest.approx([1.0, 2.3, 0.0, 0.0], abs=1e-8)
    assert found.values["J1"] == pytest.approx(0.19, abs=1e-7) and found.alike == ()


@pytest.mark.slow
def test_steps_that_follow_a_tolerance_come_as_near_as_it_is():
    found, exact = identified("data_noisy", tol=1e-8), swing()[0]["quantities"][2]["value"]
    np.testing.assert_allclose(list(found.values.values()), exact, atol=1e-5)
    assert "tol=1e-08" in found.message


def test_the_start_of_a_walker_that_stands_is_found():
    """Its trunk moves as its hip angle changes, since its foot stands."""
    model = kneed_walker()
    start = kneed_walker_start(model)
    truth = {"right hip.rate": start["right hip.rate"], "left hip.angle": start["left hip.angle"]}
    times = np.linspace(0.05, 0.55, 12)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.6)
    data = {"time": times, "right hip.angle": run.at(times)["right hip.angle"], "trunk.x": run.at(times)["trunk.x"]}
    guess = {"right hip.rate": truth["right hip.rate"] + 0.02, "left hip.angle": truth["left hip.angle"] + 3e-3}
    found = mbd.fit(model, start, data, guess, mbd.HHT(0.05), 2e-3)
    assert found.values == pytest.approx(truth, abs=1e-7)


def test_a_picture_of_residuals_has_a_panel_for_each_column(tmp_path):
    figure = measured_swing().plot(tmp_path / "fit.svg")
    assert len(figure.axes) == 4 and (tmp_path / "fit.svg").stat().st_size > 1000


@pytest.mark.slow
def test_errors_of_estimates_are_those_of_the_noise():
    noise = 1e-3 * np.random.default_rng(7).standard_normal((12, len(TIMES)))
    fits = [found(seen() + each, {"rod.center": 1.0, "pin loss.coefficient": 0.3}, sigma={"pin.angle": 1e-3})
            for each in noise]  # fmt: skip
    off = np.array([(fit.values["rod.center"] - 1.3) / fit.errors["rod.center"] for fit in fits])
    assert np.abs(off).max() < 4.0 and 0.4 < np.std(off) < 1.9
    assert 0.8 < np.mean([fit.noise for fit in fits]) < 1.2
    low, high = fits[0].interval("rod.center")
    assert low < fits[0].values["rod.center"] < high and "rod.center" in repr(fits[0])


def test_what_the_data_cannot_tell_apart_is_named():
    """All forces of a pendulum grow with its mass: mass and damping count as their ratio alone."""
    both = found(seen(), {"rod.mass": 1.0, "pin loss.coefficient": 0.3})
    assert set(*both.alike) == {"rod.mass", "pin loss.coefficient"}
    assert np.isinf(list(both.errors.values())).all() and "cannot tell apart" in repr(both)
    assert both.values["pin loss.coefficient"] / both.values["rod.mass"] == pytest.approx(0.2 / 1.2, rel=1e-6)


def test_fewer_values_than_parameters_determine_none():
    model, start = pendulum()
    few = {"time": [0.5], "pin.angle": [0.1]}
    one = mbd.fit(model, start, few, {"rod.center": (1.2, 0.5, 2.0), "pin loss.coefficient": 0.2}, mbd.Newmark(), 0.02)
    assert set(*one.alike) == {"rod.center", "pin loss.coefficient"} and np.isinf(list(one.errors.values())).all()


@pytest.mark.parametrize("height", [0.0, 0.7])
def test_a_column_that_rests_but_for_round_off_weighs_no_more_than_others(height):
    """Its range is no scale: residuals of 1e-16 m were thousands, and errors of the estimates with them."""
    model, start = pendulum()[0].without(), pendulum()[1]
    noise = np.random.default_rng(5).standard_normal((2, len(TIMES))) * np.array([[1e-3], [1e-16]])
    guess = {"rod.center": 1.2, "pin loss.coefficient": 0.3}
    data = {"time": TIMES, "pin.angle": seen() + noise[0]}
    model.observe("place", lambda a: height + 0.0 * a, "pin.angle")
    alone, both = (
        mbd.fit(model, start, {**data, **more}, guess, mbd.Newmark(), 0.02)
        for more in ({}, {"place": height + noise[1]})
    )
    for name in guess:
        assert both.values[name] == pytest.approx(alone.values[name], rel=1e-6)
        assert both.errors[name] <= 1.1 * alone.errors[name]


def test_as_many_values_as_parameters_tell_nothing_of_errors(tmp_path):
    """They are met exactly, whatever their errors: Student's distribution has no degree of freedom left."""
    model, start = pendulum()
    two = {"time": TIMES[[9, 29]], "pin.angle": seen()[[9, 29]] + [0.003, -0.002]}
    fitted = mbd.fit(model, start, two, {"rod.center": 1.2, "pin loss.coefficient": 0.3}, mbd.Newmark(), 0.02)
    assert np.max(np.abs(fitted.residuals["pin.angle"])) < 1e-6 and fitted.degrees == 0
    assert fitted.interval("rod.center") == (-np.inf, np.inf) and np.isinf(list(fitted.errors.values())).all()
    assert np.isfinite(list(fitted.predicted.values())).all()  # by the errors of the data, which sigma tells
    assert "tell nothing of the errors" in repr(fitted) and fitted.alike == ()
    fitted.plot(tmp_path / "fit.svg")


def test_errors_are_infinite_of_all_that_may_move_together():
    """Of a + c and b + c/20 no stiffness is known, though c moves b but little; a pair and a lone one stand apart."""
    a, b, c, d, e, f = sympy.symbols("a:f")
    x, y, z, w = (mbd.Coordinate(name) for name in "xyzw")
    terms = ((a + c) * x.q**2, (b + c / 20) * y.q**2, d * e * z.q**2, f * w.q**2)
    model = mbd.Lagrangian(
        "oscillators", [x, y, z, w], kinetic=sum(each.v**2 for each in (x, y, z, w)) / 2, potential=sum(terms) / 2,
        parameters=dict(zip((a, b, c, d, e, f), (2.0, 3.0, 1.5, 2.5, 1.3, 4.0), strict=True)),
    )  # fmt: skip
    start = mbd.assemble(model, position=dict.fromkeys("xyzw", 0.3))
    run = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0)
    noise = 1e-3 * np.random.default_rng(3).standard_normal((4, len(TIMES)))
    data = {"time": TIMES} | {name: run.at(TIMES)[name] + own for name, own in zip("xyzw", noise, strict=True)}
    guess = {"a": 2.1, "b": 2.9, "c": 1.4, "d": 2.4, "e": 1.4, "f": 3.8}
    fitted = mbd.fit(model, start, data, guess, mbd.Newmark(), 0.02)
    assert sorted(map(sorted, fitted.alike)) == [["a", "b", "c"], ["d", "e"]]
    assert [name for name, error in fitted.errors.items() if np.isfinite(error)] == ["f"]
    assert fitted.degrees == 4 * len(TIMES) - 4


def test_bounds_hold_and_values_may_be_missing():
    values = seen()
    values[::3] = np.nan
    bounded = found(values, {"rod.center": (1.0, 0.9, 1.1)})
    assert bounded.values["rod.center"] == pytest.approx(1.1)
    assert "At a bound, beyond which the data would have it: 'rod.center'" in repr(bounded)
    assert len(bounded.residuals["pin.angle"]) == np.isfinite(values).sum()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"data": {"pin.angle": [1.0]}}, "column 'time'"),
        ({"data": {"time": [0.0, 0.0], "pin.angle": [1.0, 2.0]}}, "increasing times"),
        ({"data": {"time": [0.1, 0.2], "pin.angle": [1.0]}}, "for every time"),
        ({"data": None}, "nothing to fit to"),
        ({"sigma": {"pin.angel": 0.1}}, "'pin.angel', which is not among the data"),
        ({"sigma": {"pin.angle": 0.0}}, "must be positive"),
        ({"data": {"time": [0.1], "pin.angel": [1.0]}}, "did you mean 'pin.angle'"),
        ({"parameters": {"rod.centre": 1.0}}, "did you mean 'rod.center'"),
        ({"parameters": {"rod.center": (1.0, 2.0, 3.0)}}, "guess, lowest, highest"),
        ({"until": 0.5}, "not before the last value"),
        ({"events": {"floor.time": 0.3}}, "does not reach the data: there is no 'floor.time'"),
        ({"integrator": mbd.RadauIIA(), "dt": -1.0}, "dt must be"),
    ],
    ids=str,
)
def test_faults_have_names(change, said):
    model, start = pendulum()
    given = {"data": {"time": TIMES, "pin.angle": seen()}, "parameters": {"rod.center": 1.0}, "dt": 0.05, **change}
    with pytest.raises(mbd.MbdError, match=said):
        mbd.fit(model, start, **given)


def test_the_inertia_of_a_spinning_body_is_found_from_its_angular_velocity():
    """Of a body that tumbles about a ball joint with a loss; with how fast it began to spin, too."""
    model = mbd.Model("satellite", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, (1.2, 2.0, 2.7))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin, loss=mbd.Viscous(0.05)))
    truth = {"body.inertia.yy": 2.1, "body.inertia.zz": 2.5, "ball loss.coefficient": 0.07}
    start, begun = (mbd.assemble(model, velocity={"ball.angular_velocity": (x, 3.0, -2.0)}) for x in (1.0, 1.2))
    times, names = np.linspace(0.05, 2.0, 20), [f"ball.angular_velocity.{axis}" for axis in "xyz"]
    run = mbd.simulate(model, begun, mbd.RungeKutta853(), dt=0.04, until=2.0, parameters=truth).at(times)
    guess = {"body.inertia.yy": 1.9, "body.inertia.zz": 2.8, "ball loss.coefficient": 0.03, names[0]: 1.0}
    data = {"time": times, **{name: run[name] for name in names}}
    fitted = mbd.fit(model, start, data, guess, mbd.RungeKutta853(), 0.04)
    assert fitted.converged and fitted.alike == ()
    assert [fitted.values[name] for name in guess] == pytest.approx([*truth.values(), 1.2], rel=1e-9)
    with pytest.raises(mbd.UnknownNameError, match=r"named 'ball.orientation.w'"):
        mbd.fit(model, start, data, {"ball.orientation.w": 1.0}, mbd.RungeKutta853(), 0.04)


def test_a_coordinate_behind_a_quaternion_is_held_as_it_is_named():
    """Where coordinates and velocities have other numbers."""
    model = mbd.Model("held", cut=("grip",))
    links = [mbd.RigidBody(name, 1.0, (0.1, 0.1, 0.1), center=(0.0, -0.2, 0.0)) for name in ("arm", "forearm", "hand")]
    model.connect(mbd.Spherical("shoulder", model.ground.origin, links[0].origin))
    for name, one, other in (("elbow", *links[:2]), ("wrist", *links[1:])):
        model.connect(mbd.Revolute(name, one.point(0.0, -0.5, 0.0), other.origin))
    model.connect(mbd.Spherical("grip", model.ground.point(0.4, -0.6, 0.1), links[2].point(0.0, -0.5, 0.0)))
    start = mbd.assemble(model, {"elbow.angle": 0.9})
    for name in ("elbow", "wrist"):
        value = start[f"{name}.angle"] + 0.02
        moved = changed_start(model, start, {f"{name}.angle": value, f"{name}.rate": 0.1}, {}, "auto")
        assert moved[f"{name}.angle"] == value and moved[f"{name}.rate"] == 0.1


def test_each_run_of_a_fit_is_asked_once_for_all_columns_of_the_same_times(monkeypatch):
    model, start = pendulum()
    run = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0)
    names, asked, own = ["pin.angle", "pin.angle.rate", "rod.end.x"], [], mbd.Trajectory.at
    data = {"time": TIMES} | {name: run.at(TIMES)[name] for name in names}
    monkeypatch.setattr(mbd.Trajectory, "at", lambda *given, **more: asked.append(0) or own(*given, **more))
    search = _Search(model, start, Data.read(data, None, None), ("rod.center",), mbd.Newmark(), 0.02, None, 2.0, "auto")
    search.check()
    search.least(np.array([1.2]), np.array([0.1]), np.array([3.0]))
    assert search.runs > 2 and len(asked) == search.runs


def test_small_lengths_beside_angles_are_no_round_off():
    """A slider that swings by 1e-14 m beside a pendulum: what is in metres is no round-off of radians."""

    def found(unit):
        model, slider = mbd.Model("slider beside a pendulum"), mbd.PointMass("slider", 1.0)
        rod = mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
        rail = mbd.Prismatic("rail", model.ground.origin, slider.origin, axis=(1.0, 0.0, 0.0), stiffness=9.0)
        model.connect(rail, mbd.Revolute("pin", model.ground.origin, rod.start))
        start = mbd.assemble(model, {"rail.displacement": unit, "pin.angle": 0.5})
        run = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0).at(TIMES)
        noise = 1e-3 * np.random.default_rng(6).standard_normal((2, len(TIMES)))
        sizes = zip(("rail.displacement", "pin.angle"), (unit, 1.0), noise, strict=True)
        data = {"time": TIMES} | {name: run[name] + size * own for name, size, own in sizes}
        return mbd.fit(model, start, data, {"rail spring.stiffness": 9.5, "rod.center": 0.55}, mbd.Newmark(), 0.02)

    large, *others = map(found, (1.0, 1e-14, 1e-100))
    for small in others:
        assert small.values == pytest.approx(large.values, rel=1e-6)
        assert small.errors == pytest.approx(large.errors, rel=1e-4)


def test_fits_do_not_depend_on_when_the_clock_was_started_nor_on_the_size_of_all_sigma():
    """A damped ball that bounces: instants, or heights with errors, of runs that begin at other times."""
    model, ball = mbd.Model("ball"), mbd.PointMass("ball", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, ball.origin, axis=(0.0, 1.0, 0.0), loss=mbd.Viscous(0.3))
    model.connect(rail)
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), restitution=0.8))
    start, guess = mbd.assemble(model, {"rail.displacement": 1.0}), {"gravity.y": -8.5, "rail loss.coefficient": 0.1}
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=2.0)
    instants = instants_of(run)
    heights = run.at(TIMES)["rail.displacement"] + 1e-3 * np.random.default_rng(2).standard_normal(len(TIMES))

    def found(begin, events, sigma=None):
        data = None if events else {"time": begin + TIMES, "rail.displacement": heights}
        given = {name: begin + time for name, time in instants.items() if events and not name.endswith("3")}
        scales = sigma and {"rail.displacement": sigma}
        settings = {"events": given or None, "sigma": scales}
        return mbd.fit(model, replace(start, time=begin), data, guess, mbd.RungeKutta853(), 0.02, **settings)

    for begin in (0.0, 64.0, 8192.0, -64.0):
        fitted = found(begin, events=True)
        assert fitted.converged and fitted.run.time[-1] - begin < 1.5
        assert fitted.values == pytest.approx({"gravity.y": -9.81, "rail loss.coefficient": 0.3}, rel=1e-9)
    usual = found(0.0, events=False)
    for begin, sigma in ((-64.0, None), (0.0, 1e-3), (0.0, 1e9), (0.0, 1e-12)):
        other = found(begin, events=False, sigma=sigma)
        assert other.values == pytest.approx(usual.values, rel=1e-8)
        assert other.errors == pytest.approx(usual.errors, rel=1e-6)


def test_memory_of_a_fit_grows_with_its_values_not_with_their_square():
    model, start = pendulum()
    run, many = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0), np.linspace(0.0, 2.0, 6000)
    data = {"time": many, "pin.angle": run.at(many)["pin.angle"]}
    tracemalloc.start()
    mbd.fit(model, start, data, {"rod.center": 1.29}, mbd.Newmark(), 0.02)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1000 * 8 * len(many)
