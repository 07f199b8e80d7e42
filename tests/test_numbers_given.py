"""Numbers that are none where one is expected: complex ones, NaN; and files whose names are those of others."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import falling, pendulum


@pytest.mark.parametrize("value", [np.complex128(1.0 + 2.0j), np.array(1.0j), 1.0j, np.nan, "1", None, True])
def test_what_is_no_real_number_is_no_mass(value):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(mbd.ModelError, match="mass of 'ball' must be"):
            mbd.PointMass("ball", value)


def test_complex_columns_are_no_data():
    model, _ = falling()
    start = mbd.assemble(model, backend="python")
    for values in (np.array([1.0, 2.0]) + 0j, [1.0, 2.0j]):
        with pytest.raises(mbd.ModelError, match="a table of real numbers"):
            mbd.fit(
                model, start, {"time": [0.0, 0.1], "fall.displacement": values}, {"ball.mass": 1.0}, backend="python"
            )


@pytest.mark.parametrize("value", [np.nan, np.inf, 1.0j])
@pytest.mark.parametrize("where", ["at", "wrt"])
def test_values_and_rates_of_derivatives_are_finite(where, value):
    model = pendulum()
    model = model[0] if isinstance(model, tuple) else model
    names = list(model.parameters)
    start = mbd.assemble(model, backend="python")
    wrt = [{"slope": {names[0]: value if where == "wrt" else (lambda s: s)}}]
    at = {"slope": value} if where == "at" else None
    with pytest.raises(mbd.ModelError, match="number"):
        mbd.sensitivities(model, start, dt=0.1, until=0.1, wrt=wrt, at=at, backend="python")


@pytest.mark.parametrize(
    ("name", "said"),
    [("x.gif", "name it 'x.html'; it moves"), ("x.PNG", "pictures are those"), ("x.csv", r"run.to_csv")],
)
def test_a_page_is_not_named_as_something_else(tmp_path, name, said):
    model, _ = falling()
    run = mbd.simulate(model, mbd.assemble(model, backend="python"), dt=0.1, until=0.2, backend="python")
    with pytest.raises(mbd.TrajectoryError, match=f"a page is an HTML file, .* got '{name}'.*{said}"):
        run.page(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("parts", [(0.0, 0.0, 0.0, 0.0), (1e-200, 0.0, 0.0, 0.0)])
def test_a_quaternion_of_length_zero_is_no_orientation(parts):
    model, leg = mbd.Model("leg"), mbd.RigidBody("leg", 1.0, (1.0, 2.0, 2.5))
    model.connect(mbd.Spherical("hip", model.ground.origin, leg.origin))
    start = mbd.assemble(model, backend="python")
    wrong = replace(start, q=np.array(parts))
    for act in (
        lambda: mbd.simulate(model, wrong, dt=0.1, until=0.1, backend="python"),
        lambda: mbd.project(model, wrong, backend="python"),
        lambda: mbd.linearize(model, wrong, backend="python"),
        lambda: mbd.assemble(model, dict(zip(start.names, parts, strict=True)), backend="python"),
    ):
        with pytest.raises(mbd.ModelError, match="which is no orientation: a quaternion has length 1"):
            act()


@pytest.mark.parametrize("wrong", [True, "1", np.nan, -1.0, np.array([1.0, 2.0])])
def test_what_is_no_value_of_a_parameter_stays_none_after_another_run(wrong):
    """What was allowed last is not judged again; True is equal to 1, and the model may have changed since."""
    model, _ = falling()
    start = mbd.assemble(model, backend="python")
    how = {"dt": 0.1, "until": 0.1, "backend": "python"}
    for _ in range(2):
        mbd.simulate(model, start, **how, parameters={"ball.mass": 1.0})
    with pytest.raises(mbd.ModelError, match="ball"):
        mbd.simulate(model, start, **how, parameters={"ball.mass": wrong})


def test_values_are_judged_by_the_model_as_it_is_now():
    model = mbd.Model("rod")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.2)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
    how = {"dt": 0.1, "until": 0.1, "backend": "python", "parameters": {"hinge loss.coefficient": 2.0}}
    with pytest.raises(mbd.MbdError, match="hinge loss"):
        mbd.simulate(model, mbd.assemble(model, backend="python"), **how)
    model.joints[0] = replace(model.joints[0], loss=mbd.Viscous(1.0))
    run = mbd.simulate(model, mbd.assemble(model, backend="python"), **how)
    assert run.record.parameters[list(run.record.parameter_names).index("hinge loss.coefficient")] == 2.0
    model.joints[0] = replace(model.joints[0], loss=mbd.Coulomb(0.0))
    with pytest.raises(mbd.MbdError, match="hinge loss"):
        mbd.simulate(model, mbd.assemble(model, backend="python"), **how)
