"""Laws that the equations of every mechanism obey, whatever it is made of."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.equations import derive
from mbd.equations.magnitudes import MAX_SUM_RATIO, magnitudes
from mbd.equations.programs import accelerations, scales
from mbd.tape.derivatives import gradient, jvp, substitute
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Tape
from mbd.testing import check_model, trees
from tests.equations.mechanisms import four_bar, furnished, leg, random_tree, walker
from tests.equations.numbers import at, inputs

SCENES = {
    "leg": leg,
    "walker": walker,
    "four-bar": four_bar,
    "four-bar, all cut": lambda: four_bar("all"),
    "planar tree": lambda: furnished(random_tree(3, 4, spatial=False), 1),
    "spatial tree": lambda: furnished(random_tree(5, 3, spatial=True), 2),
}


@pytest.fixture(params=SCENES)
def equations(request):
    return derive(SCENES[request.param]())


@pytest.mark.parametrize("scene", SCENES)
def test_every_scene_keeps_the_laws(scene):
    """Inertia, energy, rows, contacts, Newton's matrix: see `mbd.testing.check_model`."""
    assert len(check_model(SCENES[scene](), postures=1, seed=4).laws) >= 7


@settings(max_examples=6)
@given(tree=trees(bodies=3, most=5), seed=st.integers(0, 10_000))
def test_random_trees_keep_the_laws(tree, seed):
    check_model(furnished(tree, seed), postures=1, seed=seed)


def test_potential_energy_is_the_sum_over_effects(equations):
    point = inputs(equations, 3)
    parts = [effect.potential for effect in equations.effects if effect.potential is not None]
    assert at([equations.potential], point)[0] == pytest.approx(at(parts, point).sum(), rel=1e-12)


def test_effects_make_up_the_balance(equations):
    """What is left without all effects is inertia alone, which vanishes at rest."""
    rest = inputs(equations, 5) | {(kind, k): 0.0 for kind in "va" for k in range(equations.n_v)}
    total = sum(at(list(effect.generalized()), rest) for effect in equations.effects if effect.contact < 0)
    np.testing.assert_allclose(at(list(equations.balance), rest), total, atol=1e-12)


def test_scales_bound_what_they_belong_to(equations):
    point = inputs(equations, 8)
    n, rows = equations.n_v + equations.n_z, len(equations.rows)
    sizes = at(scales(equations), point)
    assert len(sizes) == n + 2 * rows
    h = at([row.value for row in equations.rows] + [row.rate for row in equations.rows], point)
    assert (sizes[n:] >= np.abs(h) - 1e-15).all()
    out = at(accelerations(equations), point)
    M, f = out[: n * n].reshape(n, n), out[n * n : n * n + n]
    a = np.array([point["a", k] for k in range(equations.n_v)])
    Rm = out[n * n + n : n * n + n + n * rows].reshape(n, rows)
    lam = np.array([point["lam", k] for k in range(rows)])
    assert (sizes[:n] >= np.abs(M @ a + f + Rm @ lam) - 1e-12).all()


def hanging(links):
    """A chain of rods of 1 m in all."""
    model = mbd.Model("chain")
    above = model.ground.origin
    for k in range(links):
        rod = mbd.Link(f"rod {k}", 1.0 / links, 1.0 / links, 0.5 / links, 1.0 / (12.0 * links**3))
        model.connect(mbd.Revolute(f"joint {k}", above, rod.start))
        above = rod.end
    return derive(model)


def hanging_by_balls(links):
    """The same of ball joints."""
    model = mbd.Model("chain of ball joints")
    above = model.ground.origin
    for k in range(links):
        own = 1.0 / (12.0 * links**3)
        rod = mbd.RigidBody(f"rod {k}", 1.0 / links, (own, 0.1 * own, own), center=(0.0, -0.5 / links, 0.0))
        model.connect(mbd.Spherical(f"joint {k}", above, rod.origin))
        above = rod.point(0.0, -1.0 / links, 0.0)
    return derive(model)


@pytest.mark.parametrize("links", [3, 8])
def test_terms_do_not_grow_with_turns_by_quaternions(links):
    """What forces are as large as does not hang on the axes in which they are written down.

    With all of 1 kg within 1 m, turning at ω and accelerated by α in every joint, no torque is above that of
    ``g + n α + (n ω)²`` at 1 m and its own inertia's; at v = a = 0, of the weight.
    """
    equations = hanging_by_balls(links)
    rng = np.random.default_rng(links)
    point = inputs(equations, 8)
    for k in range(links):
        orientation = rng.normal(size=4)
        for i, part in enumerate(orientation / np.linalg.norm(orientation)):
            point["q", 4 * k + i] = part
    for motion in (0.0, 1.0):
        for k in range(3 * links):
            point |= {("x", k): 0.1 * motion * rng.normal(), ("v", k): motion, ("a", k): motion}
        turning = np.sqrt(3.0) * motion * links
        assert 1.0 < at(scales(equations), point).max() < MAX_SUM_RATIO * 2.0 * (9.81 + turning + turning**2)


def largest_scale(links):
    """Of a chain that is curled up at random, turns at 3 rad/s and is accelerated by 100 rad/s² in every joint."""
    equations = hanging(links)
    rng = np.random.default_rng(links)
    point = inputs(equations, 8)
    for k in range(links):
        point |= {("q", k): rng.uniform(-3, 3), ("x", k): 0.0, ("v", k): 3.0 * (-1) ** k, ("a", k): 100.0 * (-1) ** k}
    return at(scales(equations), point).max()


def test_terms_of_a_long_chain_do_not_grow_like_a_power_of_two():
    """Σ|terms| alone doubles with every turn up and down the chain: residuals of any size would pass for round-off."""
    short, long = largest_scale(10), largest_scale(30)
    assert 1e-3 < long < 30.0 * short


def test_coordinates_may_be_shared_between_chart_and_increment(equations):
    """Everything is evaluated at q ⊕ x."""
    point = inputs(equations, 9, x=0.3)
    together = point | {("q", k): point["q", k] + point["x", k] for k in range(equations.n_q)}
    together |= {("x", k): 0.0 for k in range(equations.n_v)}
    nodes = [*equations.balance, equations.kinetic, equations.potential, *(row.value for row in equations.rows)]
    np.testing.assert_allclose(at(nodes, point), at(nodes, together), rtol=1e-12, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(value=st.floats(0.1, 10.0), steps=st.integers(8, 20))
def test_round_off_does_not_grow_with_the_iterations_of_newtons_method(value, steps):
    """Of a cube root, its derivatives forward and backward, and those after a substitution."""
    tape = Tape()
    x, z = tape.input("q", 0), tape.input("q", 1)
    found = 0.5 * (1.0 + x)
    for _ in range(steps):
        found = found - (found * found * found - x) / (3.0 * found * found)
    every = [found, *jvp([found], {x: 1.0}), *gradient(found, [x]), *substitute([found], {x: 1.0 * z})]
    at_value = {("q", 0): value, ("q", 1): value}
    sizes, values = evaluate(magnitudes(tape, every), at_value), evaluate(every, at_value)
    exact, slope = value ** (1 / 3), value ** (-2 / 3) / 3
    np.testing.assert_allclose(values, [exact, slope, slope, exact], rtol=1e-9)
    assert max(np.array(sizes) / values) <= 16.0 * MAX_SUM_RATIO**2


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize("steps", [10, 30])
def test_a_force_that_iterates_moves_as_the_one_that_it_solves_for(scheme, steps):
    """``T + 0.3 T³ = c(q, v)`` by Newton's method, and by Cardano's formula, in a joint that sticks and slips."""

    def wanted(q, v):
        return -20.0 * (q - 1.0) - 3.0 * v

    def iterated(q, v):
        torque = 0.1 * wanted(q, v)
        for _ in range(steps):
            torque = torque - (torque + 0.3 * torque**3 - wanted(q, v)) / (1.0 + 0.9 * torque * torque)
        return torque

    def solved(q, v):
        x = 1.5 * 0.9**0.5 * wanted(q, v)
        return 2.0 / 0.9**0.5 * mbd.sinh(mbd.log(x + mbd.sqrt(x * x + 1.0)) / 3.0)

    ends = []
    for law in iterated, solved:
        model, rod = mbd.Model("arm"), mbd.Link("rod", mass=2.0, length=0.4, center=0.2, inertia=0.03)
        pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Coulomb(0.05))
        model.connect(pin)
        model.apply(mbd.Motor("drive", pin, law, arguments=["pin.angle", "pin.rate"]))
        run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": -0.5}), scheme, dt=2e-3, until=1.5)
        ends.append(([event.kind for event in run.events], run["pin.angle"][-1], run["pin.rate"][-1]))
    assert ends[0][0] == ends[1][0] == ["slipped"] * 3
    np.testing.assert_allclose(ends[0][1:], ends[1][1:], atol=1e-6)
