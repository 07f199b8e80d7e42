"""Factors moved outward change the number of operations, never the value."""

import numpy as np
from hypothesis import given, strategies as st

from mbd.equations.cost import operations
from mbd.equations.tangents import factored
from mbd.tape.functions import cos, sin
from mbd.tape.node import Tape
from tests.equations.numbers import at


def test_the_derivative_of_a_turned_vector_is_the_vector_turned_further():
    """``−(k s) x − (k c) y`` beside ``s x + c y`` costs one product."""
    tape = Tape()
    q, x, y = (tape.input("q", i) for i in range(3))
    k = tape.input("c", 0)
    c, s = cos(q), sin(q)
    turned = s * x + c * y
    change = -(k * s) * x - (k * c) * y
    (short,) = factored([change], [k])
    assert operations([turned, short]) == operations([turned]) + 2  # the product and its sign
    assert operations([turned, change]) > operations([turned, short])


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=25))
def test_values_are_kept(steps):
    tape = Tape()
    nodes = [tape.input("c", 0), tape.input("c", 1), *(tape.input("q", i) for i in range(3)), tape.constant(2.0)]
    for op, i, j in steps:
        a, b = nodes[-1 - i % len(nodes)], nodes[-1 - j % len(nodes)]
        nodes.append([a + b, a - b, a * b, sin(a)][op])
    inputs = {("c", 0): 0.7, ("c", 1): -0.4} | {("q", i): 0.3 + 0.5 * i for i in range(3)}
    before, after = at(nodes, inputs), at(factored(nodes, nodes[:2]), inputs)
    np.testing.assert_allclose(after, before, rtol=1e-9, atol=1e-9 * (1 + np.abs(before).max()))
