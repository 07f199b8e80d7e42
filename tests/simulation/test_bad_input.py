"""Wrong arguments are refused before the first step, with one clear sentence each."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import ball, kneed_walker, kneed_walker_start, pendulum, point, run

MODEL = ball()


def simulate(model=None, start=None, integrator=None, **settings):
    model = MODEL if model is None else model
    start = mbd.assemble(model, {"fall.displacement": 1.0}) if start is None else start
    return mbd.simulate(model, start, integrator or mbd.HHT(0.05), **{"dt": 0.01, "until": 0.1, **settings})


@pytest.mark.parametrize(
    "dt",
    [0, 0.0, -1e-3, math.nan, math.inf, -math.inf, "1e-3", None, True, 1j, [1e-3], np.ones(2), 1e-17, 1e-300],
    ids=repr,
)  # fmt: skip
def test_a_step_that_is_no_positive_number_of_seconds_is_refused(dt):
    with pytest.raises(mbd.ModelError, match="dt"):
        simulate(dt=dt)


@pytest.mark.parametrize("dt", [1e8, 1e13, 1e300])
def test_a_step_beyond_which_the_end_cannot_be_told_is_refused(dt):
    with pytest.raises(mbd.ModelError, match="times the end at t = .*smaller dt"):
        simulate(dt=dt)


@pytest.mark.parametrize("dt", [np.float32(0.0125), np.float64(0.01), np.array(0.01), 1])
def test_any_kind_of_number_is_a_step(dt):
    assert simulate(dt=dt).success


@pytest.mark.parametrize(
    "until",
    [math.nan, math.inf, -1.0, None, True, [1.0], ("floor", "x"), ("floor", math.nan), ("floor", 1.0, 2.0), (3, 2.0),
     ("floor", -2.0)],
    ids=repr,
)  # fmt: skip
def test_an_end_that_is_no_time_is_refused(until):
    with pytest.raises(mbd.ModelError, match="until"):
        simulate(until=until)


@pytest.mark.parametrize("until", ["flor", ("flor", 1.0)])
def test_an_unknown_event_offers_the_nearest(until):
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'floor'"):
        simulate(until=until)


WRONG = {
    "store 0": ({"store": 0}, "store"),
    "store 1.5": ({"store": 1.5}, "store"),
    "store True": ({"store": True}, "store"),
    "locate": ({"locate": "exact"}, "'root' or 'linear'"),
    "contact": ({"contact": "smooth"}, "'events'"),
    "impact": ({"impact": "stronge"}, "'newton'"),
    "on_failure": ({"on_failure": "ignore"}, "'raise' or 'return'"),
    "tol": ({"tol": 1e-6}, "dt"),
    "rest speed": ({"rest_speed": -1.0}, "rest_speed"),
    "rest speed nan": ({"rest_speed": math.nan}, "rest_speed"),
    "parameter name": ({"parameters": {"gravity.yy": 1.0}}, "did you mean 'gravity.y'"),
    "parameter nan": ({"parameters": {"gravity.y": math.nan}}, "gravity.y"),
    "parameter text": ({"parameters": {"gravity.y": "much"}}, "gravity.y"),
    "parameters no mapping": ({"parameters": 3.0}, "map names to numbers"),
    "negative mass": ({"parameters": {"ball.mass": -1.0}}, "negative"),
    "no mass": ({"parameters": {"ball.mass": 0.0}}, "nothing determines the motion of 'fall.displacement'"),
    "observers": ({"observers": print}, "observers"),
    "observer": ({"observers": [3]}, "observers"),
    "progress": ({"progress": 3}, "progress"),
    "backend": ({"backend": "fortran"}, "'llvm'"),
    "integrator": ({"integrator": "HHT"}, "integrator"),
    "integrator class": ({"integrator": mbd.HHT}, "integrator"),
}


@pytest.mark.parametrize(("settings", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_argument_is_refused_by_its_name(settings, said):
    with pytest.raises(mbd.ModelError, match=said):
        simulate(**settings)


def test_all_wrong_arguments_are_told_at_once():
    with pytest.raises(mbd.ModelError) as refused:
        simulate(dt=-1.0, until=math.nan, locate="x", store=0)
    assert len(refused.value.faults) == 4


# states -------------------------------------------------------------------------------------------------------------
def test_a_state_of_another_model_is_refused():
    with pytest.raises(mbd.ModelError, match="assemble it from this model"):
        simulate(start=mbd.assemble(pendulum()))
    other, body = point()
    other.constrain(mbd.Unilateral("soil", mbd.height(body.origin)))
    third, body = point()
    third.constrain(mbd.Unilateral("soll", mbd.height(body.origin)))
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'soll'"):
        mbd.simulate(third, mbd.assemble(other, closed=["soil"]), mbd.HHT(), dt=0.1, until=1.0)


@pytest.mark.parametrize("part", ["q", "v"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_state_that_is_not_finite_is_refused_by_name(part, value):
    start = mbd.assemble(MODEL, {"fall.displacement": 1.0})
    with pytest.raises(mbd.ModelError, match="fall.displacement"):
        simulate(start=replace(start, **{part: np.array([value])}))


def test_a_state_of_wrong_length_or_time_is_refused():
    start = mbd.assemble(MODEL, {"fall.displacement": 1.0})
    for wrong in (replace(start, q=np.zeros(2)), replace(start, v=np.zeros(0)), replace(start, time=math.nan)):
        with pytest.raises(mbd.ModelError):
            simulate(start=wrong)
    for wrong in (None, {"fall.displacement": 1.0}, 3):
        with pytest.raises(mbd.ModelError, match="State"):
            mbd.simulate(MODEL, wrong, mbd.HHT(), dt=0.1, until=1.0)


def test_a_start_inside_the_ground_is_refused():
    start = mbd.assemble(MODEL, {"fall.displacement": 1.0})
    with pytest.raises(mbd.ModelError, match="'floor' starts 0.5 m inside"):
        simulate(start=replace(start, q=np.array([-0.5])))


# absurd but finite --------------------------------------------------------------------------------------------------
def finite(trajectory):
    """Rows without a NaN; of a start that has no finite accelerations there are its coordinates and speeds alone."""
    record = trajectory.record
    undetermined = not trajectory.success and len(trajectory) == 1
    parts = ("time", "q", "v") if undetermined else ("time", "q", "v", "a", "lam")
    return all(np.isfinite(getattr(record, part)).all() for part in parts)


def rod(mass):
    model = mbd.Model("rod")
    body = mbd.Link("rod", mass=mass, length=1.0, center=0.5, inertia=mass / 12)
    model.connect(mbd.Revolute("hinge", model.ground.origin, body.start))
    return model


@pytest.mark.parametrize("mass", [1e-300, 1e-150, 1e-30, 1e30, 1e150])
def test_a_pendulum_swings_the_same_whatever_its_mass(mass):
    usual = run(rod(1.0), {"hinge.angle": 1.0})
    np.testing.assert_allclose(run(rod(mass), {"hinge.angle": 1.0}).record.q, usual.record.q, atol=1e-9)


ABSURD = {
    "mass 1e300": (lambda: rod(1e300), {}),
    "gravity 1e10": (lambda: rod(1.0), {"parameters": {"gravity.y": -1e10}}),
    "gravity 1e200": (lambda: rod(1.0), {"parameters": {"gravity.y": -1e200}}),
    "dt 1e2": (lambda: rod(1.0), {"dt": 1e2, "until": 3e2}),
    "dt 1e10": (lambda: rod(1.0), {"dt": 1e10, "until": 3e10}),
    "dt 1e300": (lambda: rod(1.0), {"dt": 1e300, "until": 2e300}),
    "dt 1e-14": (lambda: rod(1.0), {"dt": 1e-14, "until": 1e-12}),
}


@pytest.mark.parametrize(("model", "settings"), ABSURD.values(), ids=ABSURD)
def test_absurd_values_give_finite_rows_or_a_clear_failure(model, settings):
    trajectory = run(model(), {"hinge.angle": 1.0}, on_failure="return", **settings)
    assert finite(trajectory)
    assert trajectory.success or len(trajectory.message) > 40


@pytest.mark.parametrize("speed", [1e10, 1e150, 1e300])
def test_absurd_speeds_give_finite_rows_or_a_clear_failure(speed):
    model = kneed_walker()
    start = kneed_walker_start(model)
    trajectory = mbd.simulate(
        model, replace(start, v=start.v * speed), mbd.HHT(0.05), dt=1e-3, until=0.05, on_failure="return"
    )
    assert finite(trajectory)
    assert trajectory.success or len(trajectory.message) > 40


@pytest.mark.parametrize("value", [math.inf, math.nan])
def test_values_that_are_not_finite_are_refused_where_they_are_given(value):
    with pytest.raises(mbd.ModelError, match="finite"):
        mbd.Model("m", gravity=(0, value, 0))
    with pytest.raises(mbd.ModelError, match="finite"):
        mbd.PointMass("m", mass=value)


HUGE = (10**400, -(10**400), 10**5000)
"""Integers that no float holds; the last is not even written out. Arguments of words: `test_bad_input_corpus`."""
PLACES = {
    "a parameter": lambda model, start, x: mbd.simulate(model, start, dt=0.01, until=0.1, parameters={"rod.length": x}),
    "a start": lambda model, start, x: mbd.assemble(model, {"hinge.angle": x}),
    "the time of a state": lambda model, start, x: mbd.simulate(model, replace(start, time=x), dt=0.01, until=0.1),
    "q of a state": lambda model, start, x: mbd.simulate(model, replace(start, q=[x]), dt=0.01, until=0.1),
    "samples": lambda model, start, x: mbd.Samples([0.0, 1.0], [0.0, x]),
    "a time of a run": lambda model, start, x: mbd.simulate(model, start, dt=0.01, until=0.1).at(x),
}


@pytest.mark.parametrize("place", PLACES)
def test_integers_beyond_every_float_are_refused_by_name(place):
    model = rod(1.0)
    start = mbd.assemble(model, {"hinge.angle": 0.3})
    for value in HUGE:
        with pytest.raises(mbd.MbdError):
            PLACES[place](model, start, value)


@pytest.mark.parametrize(("beta", "gamma"), [(1e300, 1e300), (0.25, 1e300), (11.0, 0.5), (math.inf, 0.5)])
def test_coefficients_of_newmark_that_are_no_scheme_are_refused(beta, gamma):
    with pytest.raises(mbd.CapabilityError, match="neither above 10"):
        mbd.Newmark(beta, gamma)
    assert mbd.Newmark(1.0, 1.5).order() == 1


def test_a_tolerance_that_overflows_is_refused():
    with pytest.raises(mbd.ModelError, match="tol must be a positive error"):
        mbd.simulate(rod(1.0), mbd.assemble(rod(1.0)), tol=1e308, until=0.1)
