"""Steps with factors in straight-line code are those with a search for pivots, which takes over where it must."""

import ctypes

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.compile.postponed import Postponed
from mbd.equations import explicit_solution, programs
from mbd.equations.derivation import derive
from mbd.tape import elimination
from tests.comparisons import at_least, compared
from tests.equations.mechanisms import furnished, random_tree
from tests.simulation.mechanisms import box, kneed_walker, kneed_walker_start, run
from tests.simulation.singular_linkages import slider_crank
from tests.tape.counts import total

pytestmark = pytest.mark.usefixtures("made_afresh")  # of programs that are made in other ways

SCHEMES = (
    mbd.HHT(0.05),
    mbd.Newmark(0.3025, 0.6),
    mbd.GeneralizedAlpha(0.8),
    mbd.HHT(0.05, formulation="index3"),
    mbd.GeneralizedAlpha(0.5, formulation="index3"),
)


def walk(scheme):
    walker = kneed_walker()
    return mbd.simulate(walker, kneed_walker_start(walker), scheme, dt=1e-3, until=0.7)


def tumble(scheme):
    start = {"place.y": 0.6, "place.angle": 0.3}
    return run(box(0.3), start, {"place.angle": 0.5, "place.x": 0.2}, integrator=scheme, dt=2e-3, until=0.6)


def turn(scheme):
    found = slider_crank(1.0, until=0.3)
    return mbd.simulate(*found.start, scheme, dt=1e-3, until=0.3)


def assert_same(one, two):
    assert [(e.name, e.kind) for e in one.events] == [(e.name, e.kind) for e in two.events]
    a, b = one.record, two.record
    for part, bound in (("time", 1e-9), ("q", 1e-9), ("v", 1e-8), ("a", 1e-5), ("lam", 1e-5)):
        scale = max(1.0, float(np.max(np.abs(getattr(b, part)), initial=0.0)))
        np.testing.assert_allclose(getattr(a, part), getattr(b, part), rtol=0, atol=bound * scale, err_msg=part)


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("motion", [walk, tumble, turn])
def test_both_ways_of_factoring_take_the_same_steps(motion, scheme, monkeypatch):
    straight = motion(scheme)
    assert straight.stats["compiled"]
    assert straight.stats["pivoted"] == 0
    monkeypatch.setattr(programs, "MAX_UNKNOWNS", 0)
    searched = motion(scheme)
    assert searched.stats["steps"] == straight.stats["steps"]
    assert searched.stats["iterations"] == pytest.approx(
        straight.stats["iterations"], rel=0.05
    )  # round-off decides some
    assert_same(straight, searched)


@pytest.mark.parametrize(
    ("motion", "how"), [(walk, "no pivot large enough"), (tumble, "too many unknowns"), (turn, "no pivot large enough")]
)
def test_explicit_steps_with_rows_are_those_with_a_search_for_pivots(motion, how, monkeypatch):
    scheme = mbd.RungeKutta853()
    straight = motion(scheme)
    assert straight.stats["compiled"]
    assert any(code.rates is not None for code in modes_of(straight))
    name, value = {"too many unknowns": ("MAX_UNKNOWNS", 0), "no pivot large enough": ("DIRECT_PIVOT_RTOL", 1e300)}[how]
    monkeypatch.setattr(explicit_solution, name, value)
    searched = motion(scheme)
    assert all(code.rates is None for code in modes_of(searched)) == (how == "too many unknowns")
    assert searched.stats["steps"] == straight.stats["steps"]
    assert_same(straight, searched)


def modes_of(run):
    """Code of the modes of a run."""
    mechanism = run.record.equations.memory["mechanism"]()
    return list(mechanism._modes.values())


@at_least(4)
@settings(max_examples=8)
@given(seed=st.integers(0, 200), spatial=st.booleans())
def test_straight_line_code_solves_the_equations_of_accelerations_and_rows(seed, spatial):
    """M v̇ + R λ = −f with B v̇ = −γ; M δ is a combination of rows, with B δ = −h, and −ḣ for velocities."""
    mechanism = Mechanism(derive(furnished(random_tree(seed, 3, spatial, most=4), seed)))
    equations, layout, rng = mechanism.equations, mechanism.layout, np.random.default_rng(seed)
    rows = tuple(k for k, row in enumerate(equations.rows) if row.contact < 0)
    code = mechanism.explicit(programs.ActiveSet(rows, (), False))
    if code.rates is None:
        return
    n, m, parameters = layout.n, len(rows), mechanism.parameters()
    q = equations.configuration.normalise(
        np.array(equations.configuration.defaults) + 0.3 * rng.normal(size=layout.n_q)
    )
    block = mechanism.block(0.1, q, rng.normal(size=n), np.zeros(layout.n_anchors))
    terms, out = mechanism.terms_of(block, parameters), np.zeros(mechanism.sizes["accelerations"])
    mechanism.common["accelerations"](block, parameters, out)
    given_numbers = np.concatenate([out, np.zeros(layout.size)])
    rates, returns = np.zeros(1 + n + m), np.zeros(1 + 2 * n)
    code.rates(given_numbers, parameters, rates)
    code.returns(given_numbers, parameters, returns)
    if rates[0] != 1.0 or returns[0] != 1.0:
        return
    compared()
    B, R, picked = terms.B[list(rows)], terms.R[:, list(rows)], list(rows)
    at_level = np.array([equations.rows[k].is_velocity for k in rows])
    for matrix, right, found in (
        (R, np.concatenate([-terms.f, -terms.bias[picked]]), rates[1:]),
        (B.T, np.concatenate([np.zeros(n), np.where(at_level, 0.0, -terms.h[picked])]), returns[1 : n + 1]),
        (B.T, np.concatenate([np.zeros(n), -terms.rate[picked]]), returns[n + 1 :]),
    ):
        whole = np.block([[terms.M, matrix], [B, np.zeros((m, m))]])
        known = np.linalg.solve(whole, right)[: len(found)]
        np.testing.assert_allclose(found, known, rtol=0, atol=1e-9 * max(1.0, np.abs(known).max()))


@pytest.mark.parametrize("form", ["index3", "ggl"])
def test_where_no_pivot_is_large_enough_pivots_are_searched_for(form, monkeypatch):
    scheme = mbd.GeneralizedAlpha(0.8, formulation=form)
    straight = walk(scheme)
    monkeypatch.setattr(elimination, "HALF_PRECISION_RTOL", 1e300)
    searched = walk(scheme)
    assert searched.stats["pivoted"] == searched.stats["factorizations"] > 0
    assert_same(straight, searched)


def pair(light):
    """Two points on a rail, the second far lighter, held together by a row."""
    model = mbd.Model("pair", gravity=(1.0, 0.0, 0.0))
    a, b = mbd.PointMass("a", mass=1.0), mbd.PointMass("b", mass=light)
    model.connect(
        mbd.Prismatic("first", model.ground.origin, a.origin), mbd.Prismatic("second", model.ground.origin, b.origin)
    )
    apart = mbd.measure(lambda p, q: mbd.sin(q - p), "first.displacement", "second.displacement")
    model.constrain(mbd.Bilateral("rod", apart))
    return model


@pytest.mark.parametrize("light", [1.0, 1e-6, 1e-12])
@pytest.mark.parametrize("form", ["index3", "ggl"])
def test_a_tiny_mass_in_a_row_moves_as_it_must(light, form):
    model = pair(light)
    scheme = mbd.GeneralizedAlpha(0.8, formulation=form)
    motion = mbd.simulate(model, mbd.assemble(model), scheme, dt=1e-2, until=1.0)
    np.testing.assert_allclose(motion["first.displacement"], 0.5 * motion.time**2, atol=1e-9)
    np.testing.assert_allclose(motion["second.displacement"], 0.5 * motion.time**2, atol=1e-9)


def test_passing_a_pose_without_rank_is_noticed_either_way(monkeypatch):
    found = slider_crank(1.0)
    straight = mbd.simulate(*found.start, mbd.HHT(0.05), dt=2e-3, until=found.until)
    monkeypatch.setattr(programs, "MAX_UNKNOWNS", 0)
    found = slider_crank(1.0)
    searched = mbd.simulate(*found.start, mbd.HHT(0.05), dt=2e-3, until=found.until)
    assert straight.stats["singular_steps"] == searched.stats["singular_steps"] > 0
    assert abs(straight[found.angle][-1] - searched[found.angle][-1]) < 1e-8


@pytest.mark.parametrize("stabilized", [False, True])
def test_factors_of_a_walker_cost_less_than_its_tangent(stabilized):
    equations = derive(kneed_walker())
    rows = [0, 1, 2]
    found = programs.correction(equations, programs.ActiveSet(rows, (), stabilized))
    tangent = programs.newton(equations, programs.ActiveSet(rows, (), stabilized))
    assert total(found.outputs) < 1.7 * total(tangent)
    assert total(found.solution) < (len(equations.balance) + len(rows)) ** 2 * 2


def test_large_systems_are_left_to_loops():
    model = mbd.Model("train")
    for k in range(programs.MAX_UNKNOWNS + 1):
        wagon = mbd.PointMass(f"wagon {k}", mass=1.0)
        model.connect(mbd.Prismatic(f"track {k}", model.ground.origin, wagon.origin))
    assert programs.correction(derive(model), programs.ActiveSet()) is None


def test_a_tangent_is_compiled_when_it_is_asked_for():
    walker = kneed_walker()
    mbd.simulate(walker, kneed_walker_start(walker), mbd.HHT(0.05), dt=1e-3, until=0.05)
    assert [tangent.made for tangent in mechanism_of(walker).postponed] == [False]


def test_explicit_steps_have_neither_tangent_nor_residual_compiled():
    model = box(friction=None)
    start = mbd.assemble(model, {"place.y": 0.2, "place.angle": 0.1})
    found = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-2, until=0.5)
    later = mechanism_of(model).postponed
    assert found.stats["modes"] >= 2 and len(later) == 2 * found.stats["modes"]
    assert not any(program.made for program in later)


@pytest.mark.parametrize("stabilized", [False, True])
def test_what_is_compiled_later_has_as_many_outputs_as_was_said(stabilized):
    mechanism = mechanism_of(kneed_walker())
    late, made = (make(programs.ActiveSet((0, 1, 2), (), stabilized)) for make in (mechanism.explicit, mechanism.mode))
    assert (late.tangent.size, late.residual.size) == (made.tangent.size, made.residual.size)
    block, parameters = np.linspace(0.1, 0.9, mechanism.layout.size), mechanism.parameters()
    for one, other in (late.tangent, made.tangent), (late.residual, made.residual):
        outs = np.zeros((2, other.size))
        one(block, parameters, outs[0])
        other(block, parameters, outs[1])
        np.testing.assert_array_equal(*outs)


def test_what_is_raised_while_code_is_made_comes_out_of_the_step(monkeypatch):
    made = Mechanism._add

    def fails(self, kind, mode, names, make):
        if "tangent" in names:
            raise RuntimeError("no room for code")
        return made(self, kind, mode, names, make)

    monkeypatch.setattr(elimination, "HALF_PRECISION_RTOL", 1e300)
    monkeypatch.setattr(Mechanism, "_add", fails)
    walker = kneed_walker()
    with pytest.raises(RuntimeError, match="no room"):
        mbd.simulate(walker, kneed_walker_start(walker), mbd.HHT(0.05), dt=1e-3, until=0.01)


def test_what_is_raised_while_code_is_made_leaves_no_number_behind():
    def make():
        raise KeyboardInterrupt

    late, out = Postponed(make, 3), np.zeros(4)
    arrays = [array.ctypes.data for array in (np.zeros(1), np.zeros(1), out)]
    ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(late.address)(*arrays)
    assert isinstance(late.raised, KeyboardInterrupt)
    np.testing.assert_array_equal(out, [np.nan, np.nan, np.nan, 0.0])
