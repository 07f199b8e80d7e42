"""Lemke's method on planar contacts with Coulomb friction: redundant, degenerate, of very different mass."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings, strategies as st

from mbd.kernel.lemke import LCP_RAY, LCP_SOLVED
from tests.kernel.complementarity import compiled, is_solution, solved

seeds = st.integers(0, 2**32 - 1)


def contacts(rng, count, dofs, copies=False):
    """Rows of normal and tangent velocities of contacts on a mechanism, and their velocities without impulses."""
    normal, tangent = rng.normal(size=(count, dofs)), rng.normal(size=(count, dofs))
    if copies:
        normal[count // 2 :], tangent[count // 2 :] = normal[: count - count // 2], tangent[: count - count // 2]
    v = rng.normal(size=dofs)
    return normal, tangent, v


def cone(normal, tangent, v, mu):
    """Stewart & Trinkle (1996): unknowns Λn, Λ+, Λ−, λ of each contact; M is copositive."""
    count = len(mu)
    faces = np.vstack([tangent, -tangent])
    J = np.vstack([normal, faces])
    E = np.vstack([np.eye(count), np.eye(count)])
    M = np.zeros((4 * count, 4 * count))
    M[: 3 * count, : 3 * count] = J @ J.T
    M[count : 3 * count, 3 * count :] = E
    M[3 * count :, :count], M[3 * count :, count : 3 * count] = np.diag(mu), -E.T
    q = np.concatenate([J @ v, np.zeros(count)])
    return M, q


def wedge(normal, tangent, v, mu):
    """Pfeiffer & Glocker (1996): unknowns Λn, μΛn + ΛT, the left part of γT of each contact."""
    count = len(mu)
    nn, nt, tt = normal @ normal.T, normal @ tangent.T, tangent @ tangent.T
    one, zero = np.eye(count), np.zeros((count, count))
    M = np.block([[nn - nt * mu, nt, zero], [nt.T - tt * mu, tt, one], [2.0 * np.diag(mu), -one, zero]])
    return M, np.concatenate([normal @ v, tangent @ v, np.zeros(count)])


def obeys_coulomb(normal, tangent, v, mu, push, drag, bound=1e-6):
    """Signorini's and Coulomb's laws for velocities after impulses."""
    after = v + normal.T @ push + tangent.T @ drag
    gap, slip, size = normal @ after, tangent @ after, bound * (1.0 + np.abs(push).max() + np.abs(after).max())
    assert np.all(push >= -size) and np.all(gap >= -size) and np.all(np.minimum(push, gap) <= size)
    assert np.all(np.abs(drag) <= mu * push + size)
    slides = np.abs(slip) > 30 * size
    assert np.all(np.abs(drag + np.sign(slip) * mu * push)[slides] <= 30 * size)


@given(
    count=st.integers(1, 5), dofs=st.integers(2, 9), copies=st.booleans(), plain=st.booleans(), seed=seeds
)  # fmt: skip
def test_planar_friction_is_solved_with_redundant_contacts_and_large_coefficients(count, dofs, copies, plain, seed):
    rng = np.random.default_rng(seed)
    normal, tangent, v = contacts(rng, count, dofs, copies)
    mu = rng.choice([0.0, 0.3, 1.0, 2.0], count) if plain else rng.uniform(0.0, 1.5, count)
    if not has_opening(normal):
        return
    M, q = cone(normal, tangent, v, mu)
    status, z = solved(M, q)
    assert status == LCP_SOLVED and is_solution(M, q, z)
    push, drag = z[:count], z[count : 2 * count] - z[2 * count : 3 * count]
    obeys_coulomb(normal, tangent, v, mu, push, drag)


def has_opening(normal):
    """Whether some velocity opens every contact, so that they are no vice."""
    from scipy.optimize import linprog

    count, dofs = normal.shape
    return linprog(np.zeros(dofs), A_ub=-normal, b_ub=-np.ones(count), bounds=[(None, None)] * dofs).status == 0


@given(count=st.integers(1, 5), dofs=st.integers(3, 9), seed=seeds)
def test_planar_friction_in_three_unknowns_for_each_contact(count, dofs, seed):
    """Contacts of a body whose normal and tangent rows couple little, moderate coefficients."""
    rng = np.random.default_rng(seed)
    normal, tangent, v = contacts(rng, count, dofs)
    normal *= 2.0
    mu = rng.uniform(0.0, 0.3, count)
    if not has_opening(normal):
        return
    M, q = wedge(normal, tangent, v, mu)
    status, z = solved(M, q)
    if status == LCP_SOLVED:
        push = z[:count]
        obeys_coulomb(normal, tangent, v, mu, push, z[count : 2 * count] - mu * push)
    else:
        assert status == LCP_RAY and not is_lightly_coupled(normal, tangent, mu)


def is_lightly_coupled(normal, tangent, mu):
    """Whether the normals stay positive definite under the friction that sliding makes."""
    nn, nt = normal @ normal.T, normal @ tangent.T
    whole = nn - np.abs(nt) * mu
    return bool(np.linalg.eigvalsh(whole + whole.T).min() > 0.0 and len(mu) <= normal.shape[1] // 2)


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
    normal, tangent, v = normal / root_mass, tangent / root_mass, rng.choice([0.0, 1.0, -1.0, -0.5], 3 * bodies)
    M, q = cone(normal, tangent, v * root_mass, rng.choice([0.0, 0.3, 0.5, 1.0], count))
    status, z = solved(M, q)
    assert status == LCP_SOLVED and is_solution(M, q, z)


@settings(max_examples=8)
@given(seed=seeds)
def test_a_box_of_fifteen_feet_on_three_degrees_of_freedom(seed):
    """60 unknowns of rank 3: a rigid body in the plane, every foot at rest, pushed and pulled."""
    rng = np.random.default_rng(seed)
    feet = np.linspace(-1.0, 1.0, 15)
    normal = np.column_stack([np.zeros(15), np.ones(15), 2.0 * feet])
    tangent = np.column_stack([np.ones(15), np.zeros(15), np.full(15, 0.6)])
    v = rng.choice([np.array([0.0, -1.0, 0.0]), np.array([0.2, -1.0, 0.0]), np.array([3.0, -1.0, 0.5])])
    mu = np.full(15, 0.5)
    M, q = cone(normal, tangent, v, mu)
    status, z = solved(M, q)
    assert status == LCP_SOLVED
    obeys_coulomb(normal, tangent, v, mu, z[:15], z[15:30] - z[30:45])


def test_machine_code_solves_friction():
    rng = np.random.default_rng(8)
    for _ in range(20):
        normal, tangent, v = contacts(rng, 4, 9)
        M, q = cone(normal, tangent, v, np.full(4, 0.5))
        status, z = solved(M, q, function=compiled())
        assert status == LCP_SOLVED and is_solution(M, q, z)
