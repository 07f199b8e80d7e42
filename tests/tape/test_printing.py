"""Text of expressions."""

import pytest

from mbd.tape.functions import sin, where
from mbd.tape.node import Tape
from mbd.tape.printing import listing, text

tape = Tape()
x, y, t = tape.input("q", 0), tape.input("v", 1), tape.input("t")


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        (x + y * 2.0, "q0 + 2*v1"),
        ((x + y) * t, "t*(q0 + v1)"),
        (x - (y - t), "q0 - (v1 - t)"),
        (x / (y * t), "q0/(v1*t)"),
        (-(x + y), "-(q0 + v1)"),
        (tape.power(2.5, x), "2.5**q0"),
        (tape.power(x + y, t), "(q0 + v1)**t"),
        (where((x < y) & ~(t <= 1.0), x, 0.0), "where(q0 < v1 & ~(t <= 1), q0, 0)"),
        (tape.binary("atan2", x, sin(y)), "atan2(q0, sin(v1))"),
        (tape.lookup(tape.table("ankle", [0.0], [[1.0] * 4]), x, 1), "ankle'(q0)"),
    ],
)
def test_a_node_reads_as_a_formula(node, expected):
    assert text(node) == repr(node) == expected


def test_names_replace_inputs_and_any_other_node():
    assert text((x + y) * t, {x + y: "s", t: "time"}) == "time*s"


def test_big_expressions_are_cut_short():
    big = x
    for _ in range(100):
        big = sin(big + 1.0)
    assert len(repr(big)) < 200
    assert "…" in repr(big)


def test_a_listing_names_shared_parts_and_breaks_long_formulas():
    s = sin(x)
    lines = listing({"f": s * s + y, "g": s}, {y: "rate"}).splitlines()
    assert lines[0] == "w0 = sin(q0)"
    assert lines[-1] == "g = w0"
    big = x
    for _ in range(40):
        big = sin(big + 1.0)
    assert all(len(line) < 120 for line in listing([big]).splitlines())
    assert "…" not in listing([big])
