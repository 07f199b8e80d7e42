"""Degrees of freedom by rank: independent of the cut and of the order of words, redundant rows always named."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.hardcases.singular_poses import equal_slider_crank
from tests.cases.linkages import four_bars, parallel_cranks, upright
from tests.helpers import one_body

PLAIN = "python"
"""The backend here: models are made by the dozen and looked at once."""


def closed_chain(lengths, order, cut="auto", spare=()):
    """Rods in a closed chain over a base that they can span; joints in some order; spare pins doubled."""
    model = mbd.Model("closed chain", cut=cut)
    links = [mbd.Link(f"link {k}", 1.0, length, 0.5 * length, 0.1) for k, length in enumerate(lengths)]
    frames = [model.ground.origin]
    for link in links:
        frames += [link.start, link.end]
    frames.append(model.ground.point(0.7 * sum(lengths), 0.0, name="far"))
    joints = [mbd.Revolute(f"pin {k}", frames[2 * k], frames[2 * k + 1]) for k in range(len(links) + 1)]
    model.connect(*(joints[k] for k in order))
    model.connect(*(mbd.Revolute(f"spare {k}", frames[2 * k], frames[2 * k + 1]) for k in spare))
    return model


@st.composite
def chains(draw):
    count = draw(st.integers(3, 5))
    lengths = draw(st.lists(st.floats(0.5, 1.0), min_size=count, max_size=count))
    order = draw(st.permutations(range(count + 1)))
    return lengths, order


@settings(max_examples=5)
@given(chains(), st.data())
def test_freedom_of_a_closed_chain_does_not_depend_on_the_order_of_joints_or_the_cut(chain, data):
    lengths, order = chain
    pins = [f"pin {k}" for k in range(len(lengths) + 1)]
    cut = data.draw(st.one_of(st.sampled_from(["auto", "all"]), st.lists(st.sampled_from(pins), unique=True)))
    found = mbd.mobility(closed_chain(lengths, order, cut), backend=PLAIN)
    assert (found.dof, found.grubler) == (len(lengths) - 2,) * 2
    assert found.consistent and not found.dependent and not found.singular


@settings(max_examples=5)
@given(chains(), st.data())
def test_every_doubled_pin_of_a_chain_is_redundant_by_name(chain, data):
    lengths, order = chain
    spare = data.draw(st.lists(st.integers(0, len(lengths)), min_size=1, max_size=2, unique=True))
    cut = data.draw(st.sampled_from(["auto", "all"]))
    found = mbd.mobility(closed_chain(lengths, order, cut, spare), backend=PLAIN)
    assert found.dof == len(lengths) - 2 and found.consistent
    assert found.grubler == found.dof - 2 * len(spare)
    assert len(found.dependent) == 2 * len(spare)
    assert len([row for row in found.dependent if "spare" in row.row]) == 2 * len(spare)


@settings(max_examples=10)
@given(st.permutations(range(4)), st.integers(0, 3), st.floats(0.3, 2.0))
def test_a_constraint_said_twice_in_other_words_is_named_wherever_it_stands(order, twice, factor):
    """Rods between points; one of them again, as a measure of another unit and size."""
    model = mbd.Model("rods")
    a, b = mbd.PointMass("a", 1.0), mbd.PointMass("b", 2.0)
    model.connect(
        mbd.Translation("place a", model.ground.origin, a.origin, axes="xyz"),
        mbd.Translation("place b", model.ground.origin, b.origin, axes="xyz"),
    )
    ends = [
        (model.ground.origin, a.origin), (a.origin, b.origin), (model.ground.point(0.5, 0.0), b.origin),
        (model.ground.point(0.0, 0.0, 0.6, name="high"), b.origin),
    ]  # fmt: skip
    lengths = [1.0, 0.8, 0.9, 1.0]
    rods = [mbd.Bilateral(f"rod {k}", mbd.distance(*ends[k]), value=lengths[k]) for k in order]
    one, other = ends[twice]
    square = mbd.measure(
        lambda p, q: factor * ((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2 - lengths[twice] ** 2),
        one,
        other,
    )
    again = mbd.Bilateral("again", square)
    model.constrain(*rods, again)
    found = mbd.mobility(model, backend=PLAIN)
    assert (found.dof, found.grubler, found.consistent) == (2, 1, True)
    (row,) = found.dependent
    assert row.row == "'again'" and [title for title, _ in row.on] == [f"'rod {twice}'"]
    assert row.on[0][1] == pytest.approx(2.0 * factor * lengths[twice], rel=1e-6), "∂(k d²)/∂x = 2 k d ∂d/∂x"


@pytest.mark.parametrize("count", [3, 4])
def test_redundant_loops_in_any_order_of_joints_have_the_same_rank(count):
    random = np.random.default_rng(count)
    for _ in range(4):
        model = parallel_cranks(count)
        model.joints = [model.joints[k] for k in random.permutation(len(model.joints))]
        found = mbd.mobility(model, backend=PLAIN)
        assert (found.dof, found.grubler, len(found.dependent)) == (1, 3 - count, count - 2)


# what it says ---------------------------------------------------------------------------------------------------------
def pendulum():
    model, rod = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=0.5), mbd.Revolute, "pin", title="pendulum")
    return model, rod


def test_a_tree_has_the_freedom_that_grubler_counts():
    found = mbd.mobility(pendulum()[0])
    assert str(found) == "pendulum: 1 degree of freedom\n  1 coordinate, 0 rows of rank 0"
    assert found == mbd.mobility(pendulum()[0]), "a value"


def test_two_hinges_of_a_door_are_redundant_row_by_row():
    model = mbd.Model("door")
    leaf = mbd.RigidBody("leaf", mass=20.0, inertia=(1.0, 2.0, 1.0))
    for name, y in ("lower", 0.3), ("upper", 1.7):
        model.connect(
            mbd.Revolute(name, model.ground.point(0, y, name=f"{name} post"), leaf.point(0, y, name=name), (0, 1, 0))
        )
    found = mbd.mobility(model)
    assert (found.dof, found.grubler, found.rows, len(found.dependent)) == (1, -4, 5, 5)
    assert all("'upper'" in row.row for row in found.dependent)


def test_closed_contacts_take_freedom_and_open_ones_do_not():
    model, rod = pendulum()
    model.constrain(mbd.Unilateral("wall", mbd.separation(model.ground.origin, rod.end, (1, 0, 0))))
    assert mbd.mobility(model).dof == 1
    assert mbd.mobility(model, closed="wall").dof == 0
    state = mbd.assemble(model, closed=["wall"])
    assert mbd.mobility(model, state).dof == 0
    assert mbd.mobility(model, state, closed=()).dof == 1


def test_velocity_rows_and_a_lagrangian_are_counted():
    bead = mbd.Lagrangian(
        "bead",
        [mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m", default=-1.0)],
        kinetic=lambda x_rate, y_rate: 0.5 * (x_rate**2 + y_rate**2),
        constraints={"ring": lambda x, y: x * x + y * y - 1.0, "double": lambda x, y: 2.0 * (x * x + y * y) - 2.0},
    )
    found = mbd.mobility(bead)
    assert (found.dof, found.grubler, str(found.dependent[0])) == (1, 0, "'double' depends on 'ring'")
    sledge, body = one_body(mbd.RigidBody("body", mass=1.0, inertia=0.1), mbd.Planar, "place", title="sledge")
    sledge.constrain(mbd.KnifeEdge("blade", body.origin))
    assert (mbd.mobility(sledge).dof, mbd.mobility(sledge).grubler) == (2, 2)


def test_run_time_parameters_decide_whether_a_loop_is_redundant():
    """A third crank of another length locks the parallelogram."""
    model = parallel_cranks()
    assert mbd.mobility(model).dof == 1
    found = mbd.mobility(model, parameters={"crank 2.length": 1.2})
    assert found.dof == 0 and found.consistent


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({"closed": ["wal"]}, "no contact named 'wal'"),
        ({"parameters": {"rod.mas": 1.0}}, "did you mean 'rod.mass'"),
        ({"state": mbd.State(0.0, np.zeros(2), np.zeros(2), names=("a", "b"))}, "the state has the coordinates"),
    ],
)
def test_wrong_words_are_told(wish, said):
    with pytest.raises(mbd.ModelError, match=said):
        mbd.mobility(pendulum()[0], **wish)


def test_a_faulty_model_is_refused_with_all_its_faults():
    model, rod = pendulum()
    model.connect(mbd.Revolute("pin", rod.end, mbd.PointMass("bob", mass=-1.0).origin))
    with pytest.raises(mbd.ModelError, match="faults"):
        mbd.mobility(model)


def test_a_description_tells_the_freedom_on_demand():
    model = parallel_cranks()
    assert "mobility 0 by the planar count of Grübler" in model.describe()
    said = model.describe(mobility=True)
    assert said.startswith(model.describe())
    assert "parallel cranks: 1 degree of freedom, where Grübler counts 0" in said
    faulty = copy.copy(model)
    faulty.joints = [*model.joints, model.joints[0]]
    assert "faults:" in faulty.describe(mobility=True)


def test_the_folded_slider_crank_is_singular_and_its_rows_are_named():
    model, start = equal_slider_crank()
    assert not mbd.mobility(model, start).singular
    folded = mbd.assemble(model, {"main.angle": np.pi, "pin.angle": -np.pi})
    found = mbd.mobility(model, folded)
    assert found.singular and (found.dof, found.rank, found.rank_here) == (1, 2, 1)
    assert "singular here: rank 1, 2 at postures nearby" in str(found)
    assert ["'wrist'" in row.row for row in found.lost] == [True]


@pytest.mark.parametrize("count", [1, 2, 5])
def test_flat_parallelograms_lose_a_row_each(count):
    model = four_bars(count)
    assert not mbd.mobility(model, upright(model, count)).singular
    found = mbd.mobility(model, upright(model, count, angle=0.5 * np.pi))
    assert found.singular and (found.dof, found.rank - found.rank_here) == (1, count)
    assert len(found.lost) == count and not found.dependent
