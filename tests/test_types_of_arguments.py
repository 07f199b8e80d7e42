"""Type checkers and editors know what words take: a text in place of a number is an error before anything runs."""

import re
import subprocess
import sys

import pytest

RIGHT = """
import mbd
import numpy as np
import sympy as sp

body = mbd.RigidBody("b", 1.0, inertia=(1.0, 1.0, 1.0))
link = mbd.Link("l", mass=1.0, length=1.0, center=0.5, inertia=0.1)
model = mbd.Model("m")
joint = mbd.Revolute("j", model.ground.origin, link.start, loss=mbd.Viscous(0.3))
t = sp.Symbol("t")
mbd.Viscous({"stance": 5.0}, by="phase"), mbd.Viscous(1), mbd.Viscous(np.float64(3))
mbd.Spring("s", link.start, link.end, 100.0, length={"a": 1.0}, by="p")
mbd.Motor("m", joint, torque=lambda t: 2 * t)
mbd.Motor("m", joint, torque=sp.sin(t))
mbd.Motor("m", joint, torque={"a": 1.0, "b": lambda t: t}, by="p")
mbd.Applied("a", link.end, force=(0, 1, 0), torque=2.0)
mbd.Applied("a", link.end, force=np.array([1, 0, 0]))
mbd.Applied("a", link.end, force=(lambda t: t, 0.0, sp.sin(t)))
mbd.Bilateral("h", joint, lambda t: t)
mbd.Bushing("u", link.end, body.origin, stiffness=(1, 2, 3), damping=1.0)
mbd.Damper("d", link.end, body.origin, 3.0), mbd.Damper("d", link.end, body.origin, mbd.Quadratic(1.0))
mbd.RigidBody("c", 1.0, inertia=[[1, 0, 0], [0, 1, 0], [0, 0, 1]], center=[0.1, 0])
mbd.RigidBody("c", 1.0, inertia=np.eye(3))
mbd.Potential("p", lambda q: q**2, ("j.angle",)), mbd.Dissipation(lambda v: v * v)
mbd.Nonholonomic("n", sp.Symbol("x"), 0.0)
"""
WRONG = """
mbd.Viscous("0.3")
mbd.Spring("s", link.start, link.end, "100")
mbd.TorsionSpring("t", joint, stiffness="2")
mbd.Motor("m", joint, torque="2")
mbd.Applied("a", link.end, force="up")
mbd.Bilateral("h", joint, "0.2")
mbd.Damper("d", link.end, body.origin, "3")
mbd.Bushing("u", link.end, body.origin, stiffness="3")
mbd.RigidBody("c", 1.0, inertia="1")
mbd.Link("l", mass=1.0, length=1.0, center=0.5, inertia="0.1")
mbd.Valves(2.0, mbd.Quadratic(1.0))
mbd.Impulse("i", joint, "3", on="foot")
"""


@pytest.mark.slow
def test_mypy_refuses_texts_in_place_of_numbers_and_nothing_else(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(RIGHT + WRONG, encoding="utf-8")
    told = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", str(script)],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    first = RIGHT.count("\n") + 2
    lines = [int(line) for line in re.findall(r"script\.py:(\d+): error", told.stdout)]
    assert lines == list(range(first, first + len(WRONG.strip().splitlines()))), told.stdout
