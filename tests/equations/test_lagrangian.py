"""The second front door: energies in, the same equations out."""

import pickle

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import mbd
from mbd.equations import derive
from mbd.equations.programs import ActiveSet, newton, residual
from tests.equations.numbers import at, block, derivative, inputs, placed, solved

m, L, g, k = sp.symbols("m L g k")
x, y, s = mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m"), mbd.Coordinate("s")


def pendulum(**changes):
    """A point mass in Cartesian coordinates on a rod, with drag and a drive."""
    given = {
        "coordinates": [x, y], "kinetic": m * (x.v**2 + y.v**2) / 2, "potential": m * g * y.q,
        "dissipation": 0.1 * (x.v**2 + y.v**2), "forces": {x: sp.sin(sp.Symbol("t"))},
        "constraints": {"rod": (x.q**2 + y.q**2 - L**2) / 2}, "parameters": {m: 2.0, L: 1.5, g: 9.81},
    }  # fmt: skip
    return mbd.Lagrangian("pendulum", **(given | changes))


def test_a_pendulum_in_cartesian_coordinates_has_the_known_rod_force():
    equations = derive(pendulum(dissipation=0, forces={}))
    point = solved(equations, placed(equations, inputs(equations, 1) | {("q", 0): 0.7, ("q", 1): -1.2}))
    v = np.array([point["v", 0], point["v", 1]])
    expected = (v @ v - 9.81 * point["q", 1]) / 1.5**2 * 2.0
    assert at([equations.output("rod.multiplier")], point)[0] == pytest.approx(expected, rel=1e-12)


def test_equations_are_those_of_lagrange():
    equations = derive(pendulum())
    point = inputs(equations, 2)
    expected = [
        2.0 * point["a", 0] + 0.2 * point["v", 0] - np.sin(point["t", 0]),
        2.0 * point["a", 1] + 0.2 * point["v", 1] + 2.0 * 9.81,
    ]
    np.testing.assert_allclose(at(list(equations.balance), point), expected, rtol=1e-13)


def test_tangent_is_the_derivative_of_the_residual():
    bead = mbd.Lagrangian(
        "bead", [x, y, s],
        m * (x.v**2 + y.v**2 * sp.cos(x.q) ** 2 + sp.exp(s.q) * s.v**2 + s.v * x.v) / 2,
        k * x.q * y.q**2 + sp.Symbol("t") * s.q, 0.3 * x.v**2 * y.q**2 + 0.1 * s.v**4, {y: x.q * s.v},
        [x.q * s.q - y.q + sp.sin(sp.Symbol("t"))], {m: 1.7, k: 0.4},
    )  # fmt: skip
    equations = derive(bead)
    point = inputs(equations, 3, x=0.1)
    K, r, h, hv, _ = block(at(newton(equations, ActiveSet([0])), point), (4, 4), (3,), (1,), (1,), (1, 3))
    out = residual(equations, ActiveSet([0]))
    np.testing.assert_allclose(np.concatenate([r, h, hv]), at(out, point))
    c0, c1 = point["c", 0], point["c", 1]
    for j in range(3):
        change = derivative(out, point, {("a", j): 1.0, ("v", j): c0, ("x", j): c1})
        np.testing.assert_allclose(K[:3, j], change[:3], atol=1e-8)
        np.testing.assert_allclose(c0 * K[3, j], change[4], atol=1e-8)
    assert equations.rows[0].owner == "constraint 1"


def test_plain_functions_are_as_good_as_sympy():
    by_function = mbd.Lagrangian(
        "pendulum", ["hip angle"],
        lambda hip_angle_rate, m, L: 0.5 * m * L**2 * hip_angle_rate**2,
        potential=lambda hip_angle, m, L: -9.81 * m * L * mbd.cos(hip_angle),
        forces={"hip angle": lambda t, hip_angle_rate: mbd.sin(t) - 0.1 * hip_angle_rate},
        parameters={"m": 2.0, "L": 0.5},
    )  # fmt: skip
    q = mbd.Coordinate("hip angle")
    by_sympy = mbd.Lagrangian(
        "pendulum", [q], m * L**2 * q.v**2 / 2, -9.81 * m * L * sp.cos(q.q),
        forces={q: sp.sin(sp.Symbol("t")) - 0.1 * q.v}, parameters={m: 2.0, L: 0.5},
    )  # fmt: skip
    values = [at(list(derive(system).balance), inputs(derive(system), 4)) for system in (by_function, by_sympy)]
    np.testing.assert_allclose(*values, rtol=1e-14)


def test_dynamicsymbols_of_sympy_are_coordinates():
    theta = dynamicsymbols("theta")
    t = sp.Symbol("t")
    T, V = m * theta.diff(t) ** 2 / 2, -m * g * sp.cos(theta)
    equations = derive(mbd.Lagrangian("pendulum", [theta], T, V, parameters={m: 2, g: 3}))
    point = inputs(equations, 5)
    expected = 2.0 * point["a", 0] + 6.0 * np.sin(point["q", 0])
    assert at(list(equations.balance), point)[0] == pytest.approx(expected)
    assert equations.coordinates[0].name == "theta"


def test_results_have_names():
    equations = derive(pendulum())
    point = inputs(equations, 6)
    names = ["x", "y.rate", "x.acceleration", "rod.multiplier", "rod.residual", "dissipation.power", "x force.power"]
    assert set(names) <= set(equations.output_names())
    values = dict(zip(names, at([equations.output(name) for name in names], point), strict=True))
    assert values["x"] == point["q", 0]
    assert values["rod.multiplier"] == point["lam", 0]
    assert values["dissipation.power"] == pytest.approx(-0.2 * (point["v", 0] ** 2 + point["v", 1] ** 2))
    with pytest.raises(mbd.UnknownNameError, match=r"did you mean 'x\.rate'"):
        equations.output("x.rat")


def test_structural_values_fold_unless_tunable():
    assert [p.name for p in derive(pendulum(parameters={m: 1.0, L: 1.5, g: 0.0})).parameters] == ["L"]
    tuned = pendulum(parameters={m: 1.0, L: 1.5, g: 0.0}, tunable=("g",))
    assert [p.name for p in derive(tuned).parameters] == ["L", "g"]
    assert [p.name for p in derive(tuned.with_tunable("m")).parameters] == ["m", "L", "g"]
    assert pendulum().parameters == {"m": 2.0, "L": 1.5, "g": 9.81}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"coordinates": []}, "has no coordinates"),
        ({"coordinates": [x, x]}, "given twice"),
        ({"forces": {"z": 1.0}}, "no coordinate named 'z'"),
        ({"potential": m * sp.Symbol("gg") * y.q}, "no symbol named 'gg'"),
        ({"potential": lambda yy: yy}, "no quantity named 'yy'; did you mean 'y'"),
        ({"potential": m * y.v}, "depends on the rate of 'y'"),
        ({"constraints": {"rod": x.q * y.v}}, "depends on the rate of 'y'"),
        ({"constraints": {"rod": 1.0}}, "depends on no coordinate"),
        ({"tunable": ("gravity",)}, "no parameter named 'gravity'"),
    ],
)
def test_faults_are_told(changes, sentence):
    system = pendulum(**changes)
    assert any(sentence in fault for fault in system.check()), system.check()
    with pytest.raises(mbd.ModelError, match=sentence.replace("'", ".")):
        derive(system)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400, "1.0", True, None])
def test_a_parameter_is_a_finite_number(value):
    with pytest.raises(mbd.ModelError, match="value of 'g' must be a finite number"):
        pendulum(parameters={m: 2.0, L: 1.5, g: value})


def test_all_faults_are_told_at_once():
    faults = pendulum(potential=sp.Symbol("a"), kinetic=sp.Symbol("b")).check()
    assert len(faults) == 2
    assert pendulum().check() == []


def test_parts_can_be_left_out():
    bare = pendulum().without("dissipation", "x force", "rod", "potential")
    assert [effect.name for effect in derive(bare).effects] == []
    assert derive(bare).rows == ()
    assert set(pendulum().cost().effects) == {"potential", "dissipation", "x force"}
    with pytest.raises(mbd.UnknownNameError, match="'dissipation'"):
        pendulum().without("disipation")


def test_it_pickles_and_prints():
    system = pickle.loads(pickle.dumps(pendulum()))
    assert derive(system).parameters == derive(pendulum()).parameters
    assert "M[x, x] = m" in system.equations()
    theta = mbd.Coordinate("theta")
    swing = mbd.Lagrangian("swing", [theta], m * theta.v**2 / 2, dissipation=k * theta.v**2, parameters={m: 2, k: 3})
    assert r"f_{1} &= 2 \dot{\theta} k" in swing.equations(latex=True)


@pytest.mark.parametrize(
    ("coordinates", "parameters", "said"),
    [
        (["t"], {}, "the coordinate 't' is written 't' in expressions, as is the time"),
        (["q"], {"t": 1.0}, "the parameter 't' is written 't'"),
        (["q", "q_rate"], {}, "the rate of 'q' is written 'q_rate' in expressions, as is the coordinate 'q_rate'"),
        (["q"], {"q_rate": 1.0}, "the parameter 'q_rate' is written 'q_rate' in expressions, as is the rate of 'q'"),
        (["q.x", "q_x"], {}, "the coordinate 'q_x' is written 'q_x' in expressions, as is the coordinate 'q.x'"),
    ],
)
def test_a_name_that_would_mean_two_quantities_is_refused(coordinates, parameters, said):
    system = mbd.Lagrangian("odd", coordinates, lambda: 1.0, parameters=parameters)
    assert any(said in fault for fault in system.check())


@pytest.mark.parametrize(
    ("kinetic", "speed"), [(lambda q_rate: q_rate**4, 1.1), (lambda q_rate: -mbd.sqrt(1.0 - q_rate**2), 0.6)]
)
def test_energy_is_kept_also_where_the_kinetic_term_is_not_quadratic_in_rates(kinetic, speed):
    system = mbd.Lagrangian("odd", ["q"], kinetic, lambda q: 0.3 * q**2)
    run = mbd.simulate(system, mbd.assemble(system, {}, {"q": speed}), mbd.RadauIIA(), dt=1e-3, until=0.5)
    assert np.ptp(run.energy.total) < 1e-9 * np.ptp(run.energy.potential)
