"""Coulomb's law of many contacts at once: redundant, of any friction, held and free, interpreted and compiled."""

import ctypes
from functools import lru_cache

import numpy as np
from hypothesis import given, settings, strategies as st

from mbd.compile.llvm import load_object
from mbd.kernel.build import object_of
from mbd.kernel.contact.cone_problem import CONE_RTOL, EQUAL, PUSH, STEADY, cone_places, cone_solve
from mbd.kernel.translation.llvm import llvm_text
from mbd.kernel.translation.translate import source_of, translate

seeds = st.integers(0, 2**32 - 1)


@lru_cache(maxsize=1)
def compiled():
    kinds = ["reals", "int", "reals", "reals", "ints", "ints", "reals", "reals", "reals", "ints"]
    text = llvm_text(translate(source_of("mbd.kernel.contact.cone_problem"), "cone_solve", kinds), "cone_solve")
    address, number = ctypes.c_void_p, ctypes.c_int64
    function = ctypes.CFUNCTYPE(number, address, number, *[address] * 8)(load_object(object_of(text), "cone_solve"))
    return lambda *arguments: function(*(one if isinstance(one, int) else one.ctypes.data for one in arguments))


def solved(function, G, shift, owner, twin, limit, slope):
    n = len(shift)
    z, work, pivots = np.zeros(n), np.full(cone_places(n), np.nan), np.zeros(n, dtype=np.int64)
    whole = [np.array(part, dtype=np.int64) for part in (owner, twin)]
    reals = [np.array(part, dtype=float) for part in (limit, slope)]
    status = function(np.ascontiguousarray(G).ravel(), n, shift.copy(), z, *whole, *reals, work, pivots)
    return status, work[0], z


def contacts(rng, count, dofs):
    """Rows (normal, two tangents) of contacts that all part in one motion: a solution exists for any friction."""
    H = rng.normal(size=(3 * count, dofs))
    lift = rng.normal(size=dofs)
    lift /= np.linalg.norm(lift)
    H -= np.outer(H @ lift, lift)
    H[::3] += np.outer(rng.uniform(0.3, 1.0, count), lift)
    return H


def cones(mu):
    """owner, twin, limit and slope of contacts with these coefficients."""
    owner, twin, slope = [], [], []
    for c, each in enumerate(mu):
        owner += [PUSH, 3 * c, 3 * c]
        twin += [-1, 3 * c + 2, 3 * c + 1]
        slope += [0.0, each, each]
    return owner, twin, np.zeros(len(slope)), slope


def misses(z, w, mu, shift):
    """By how much Signorini's and Coulomb's laws are missed, of the largest impulse and velocity."""
    push, drag, gap, slip = z[::3], z.reshape(-1, 3)[:, 1:], w[::3], w.reshape(-1, 3)[:, 1:]
    size, fast = np.abs(z).max() + 1e-300, np.abs(shift).max()
    pull, speed = np.linalg.norm(drag, axis=1), np.linalg.norm(slip, axis=1)
    return max(
        -push.min() / size, -gap.min() / fast, (push * gap).max() / (size * fast), (pull - mu * push).max() / size,
        (mu * push * speed + np.sum(drag * slip, axis=1)).max() / (size * fast),
    )  # fmt: skip


@settings(max_examples=40)
@given(count=st.integers(1, 9), dofs=st.integers(3, 24), friction=st.floats(0.0, 1.0), seed=seeds)
def test_pushes_and_friction_obey_their_laws_however_redundant(count, dofs, friction, seed):
    rng = np.random.default_rng(seed)
    H = contacts(rng, count, dofs)
    mu, shift = friction * rng.uniform(0.3, 1.0, count), H @ rng.normal(size=dofs)
    status, residual, z = solved(compiled(), H @ H.T, shift, *cones(mu))
    assert status == 0 and residual <= CONE_RTOL
    assert misses(z, H @ H.T @ z + shift, mu, shift) < 1e-8


@settings(max_examples=5)
@given(count=st.integers(1, 3), seed=seeds)
def test_both_twins_give_the_same_bits(count, seed):
    rng = np.random.default_rng(seed)
    H = contacts(rng, count, 6)
    problem = (H @ H.T, H @ rng.normal(size=6), *cones(rng.uniform(0.0, 1.0, count)))
    assert all(
        np.array_equal(a, b) for a, b in zip(solved(cone_solve, *problem), solved(compiled(), *problem), strict=True)
    )


@given(seed=seeds, turn=st.floats(0.0, 6.0))
def test_neither_the_order_of_contacts_nor_that_of_axes_matters(seed, turn):
    """The motion is unique where friction is small, impulses where contacts are independent."""
    rng = np.random.default_rng(seed)
    H, mu = contacts(rng, 4, 14), rng.uniform(0.05, 0.3, 4)
    v = rng.normal(size=14)
    places = rng.permutation(4)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(turn), np.sin(turn)], [0.0, -np.sin(turn), np.cos(turn)]])
    other = np.vstack([rotation @ H[3 * c : 3 * c + 3] for c in places])
    z = solved(compiled(), H @ H.T, H @ v, *cones(mu))[2]
    y = solved(compiled(), other @ other.T, other @ v, *cones(mu[places]))[2]
    back = np.concatenate([rotation @ z[3 * c : 3 * c + 3] for c in places])
    assert np.allclose(back, y, atol=1e-9 * (1.0 + np.abs(z).max()))


def test_a_contact_that_slides_is_not_lifted():
    """The associated law (the dual cone without De Saxcé's correction) would part it with μ times its speed."""
    shift = np.array([-1.0, 3.0, 4.0])
    status, _, z = solved(compiled(), np.eye(3), shift, *cones([0.5]))
    assert status == 0
    assert np.allclose(z, [1.0, -0.3, -0.4], atol=1e-14)
    assert abs(z[0] + shift[0]) < 1e-14


def test_held_contacts_may_pull_and_other_frictions_have_limits_of_their_own():
    """A held contact that pulls has no friction; tangents without limit hold while their contact pushes."""
    owner, twin = [EQUAL, 0, STEADY, PUSH, 3, PUSH, 5], [-1] * 7
    limit, slope = [0.0, 0.0, 0.7, 0.0, 0.0, 0.0, 0.0], [0.0, 0.3, 0.0, 0.0, -1.0, 0.0, -1.0]
    shift = np.array([2.0, 1.0, -4.0, -1.0, 9.0, 1.0, 9.0])
    status, _, z = solved(compiled(), np.eye(7), shift, owner, twin, limit, slope)
    assert status == 0
    assert np.allclose(z, [-2.0, 0.0, 0.7, 1.0, -9.0, 0.0, 0.0], atol=1e-13)


@given(seed=seeds, dofs=st.integers(2, 8))
def test_friction_about_three_axes_lies_in_a_ball_whatever_its_axes(seed, dofs):
    """Three unknowns beside a contact, ‖z‖ ≤ 0.7, and z = −0.7 w/‖w‖ where they slide; turned axes turn z."""
    rng = np.random.default_rng(seed)
    H, v = np.vstack([contacts(rng, 1, dofs), rng.normal(size=(3, dofs))]), rng.normal(size=dofs)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    words = (
        [PUSH, 0, 0, STEADY, STEADY, STEADY],
        [-1, 2, 1, 4, 5, 3],
        [0.0] * 3 + [0.7] * 3,
        [0.0, 0.2, 0.2] + [0.0] * 3,
    )
    ends = []
    for axes in (np.eye(3), turn):
        own = np.vstack([H[:3], axes @ H[3:]])
        status, residual, z = solved(compiled(), own @ own.T, own @ v, *words)
        assert status == 0 and residual <= CONE_RTOL
        w = (own @ own.T @ z + own @ v)[3:]
        assert np.linalg.norm(z[3:]) < 0.7 * (1.0 + 1e-8)
        assert np.linalg.norm(w) * 0.7 + w @ z[3:] < 1e-7 * (1.0 + np.linalg.norm(v))
        ends.append(own.T @ z)
    assert np.allclose(*ends, atol=1e-6 * (1.0 + np.linalg.norm(v)))


def planar(normal, tangent, mu):
    """Rows, owner, twin, limit and slope of contacts with friction along one direction."""
    count = len(mu)
    H = np.stack([normal, tangent], axis=1).reshape(2 * count, -1)
    owner = [each for c in range(count) for each in (PUSH, 2 * c)]
    return H, (owner, [-1] * (2 * count), np.zeros(2 * count), np.column_stack([np.zeros(count), mu]).ravel())


def obeys_coulomb(z, w, mu, bound=1e-7):
    """Signorini's and Coulomb's laws of contacts with friction along one direction."""
    push, drag, gap, slip = z[::2], z[1::2], w[::2], w[1::2]
    size = bound * (1.0 + np.abs(z).max() + np.abs(w).max())
    assert np.all(push >= -size) and np.all(gap >= -size) and np.all(np.minimum(push, gap) <= size)
    assert np.all(np.abs(drag) <= mu * push + size)
    slides = np.abs(slip) > 30 * size
    assert np.all(np.abs(drag + np.sign(slip) * mu * push)[slides] <= 30 * size)


@settings(max_examples=20)
@given(bodies=st.integers(1, 4), count=st.integers(2, 12), seed=seeds)
def test_stacked_boxes_of_very_different_mass(bodies, count, seed):
    """Contacts at the same few places of boxes one on the other: nearly all rows depend on each other."""
    rng = np.random.default_rng(seed)
    normal, tangent = np.zeros((count, 3 * bodies)), np.zeros((count, 3 * bodies))
    for k in range(count):
        x, first = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0]), 3 * rng.integers(0, bodies)
        normal[k, first : first + 3], tangent[k, first : first + 3] = (0.0, 1.0, x), (1.0, 0.0, 0.5)
        if first:
            normal[k, first - 3 : first], tangent[k, first - 3 : first] = (0.0, -1.0, -x), (-1.0, 0.0, 0.5)
    root_mass = 10.0 ** (0.5 * rng.integers(-2, 3, 3 * bodies))
    mu = rng.choice([0.0, 0.3, 0.5, 1.0], count)
    H, laws = planar(normal / root_mass, tangent / root_mass, mu)
    shift = H @ (rng.choice([0.0, 1.0, -1.0, -0.5], 3 * bodies) * root_mass)
    status, _, z = solved(compiled(), H @ H.T, shift, *laws)
    assert status == 0
    obeys_coulomb(z, H @ H.T @ z + shift, mu)


@settings(max_examples=8)
@given(seed=seeds)
def test_a_box_of_fifteen_feet_on_three_degrees_of_freedom(seed):
    """A rigid body in the plane, every foot at rest, pushed and pulled."""
    rng = np.random.default_rng(seed)
    feet = np.linspace(-1.0, 1.0, 15)
    normal = np.column_stack([np.zeros(15), np.ones(15), 2.0 * feet])
    tangent = np.column_stack([np.ones(15), np.zeros(15), np.full(15, 0.6)])
    v = rng.choice([np.array([0.0, -1.0, 0.0]), np.array([0.2, -1.0, 0.0]), np.array([3.0, -1.0, 0.5])])
    H, laws = planar(normal, tangent, np.full(15, 0.5))
    status, _, z = solved(compiled(), H @ H.T, H @ v, *laws)
    assert status == 0
    obeys_coulomb(z, H @ H.T @ z + H @ v, 0.5)


@settings(max_examples=30)
@given(n=st.integers(1, 12), rank=st.integers(1, 12), seed=seeds)
def test_stops_without_friction_complement_however_redundant(n, rank, seed):
    rng = np.random.default_rng(seed)
    H = np.abs(rng.normal(size=(n, rank)))
    shift = H @ rng.choice([-1.0, 0.0, 0.5], rank)
    status, _, z = solved(compiled(), H @ H.T, shift, [PUSH] * n, [-1] * n, np.zeros(n), np.zeros(n))
    w = H @ H.T @ z + shift
    size = 1e-8 * (1.0 + np.abs(z).max() + np.abs(shift).max())
    assert status == 0 and np.all(z >= -size) and np.all(w >= -size) and np.all(np.minimum(z, w) <= size)


def test_what_is_not_finite_or_has_no_solution_is_told():
    problem = cones([0.5])
    assert solved(compiled(), np.full((3, 3), np.nan), np.zeros(3), *problem)[0] == 1
    wedged = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # to push makes it approach
    assert solved(compiled(), wedged, np.array([-1.0, 0.0, 0.0]), *problem)[0] == 1
