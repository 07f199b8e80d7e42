"""The choice of coordinates never changes the physics."""

import numpy as np
import pytest

from mbd.equations import derive
from mbd.equations.cost import operations
from mbd.equations.programs import ActiveSet, newton
from tests.equations.mechanisms import four_bar
from tests.equations.numbers import at, inputs, placed, solved

CUTS = ["loops", ["A"], ["B"], ["D"], ["A", "C"], "all"]

ASKED = [
    "A.angle", "B.angle", "C.angle", "D.angle", "A.rate", "B.rate", "C.angle.rate", "D.rate", "A.acceleration",
    "B.acceleration", "C.acceleration", "D.acceleration", "coupler.center.x", "coupler.center.vy", "rocker.end.y",
    "A.reaction_force.x", "B.reaction_force.y", "C.reaction_force.x", "D.reaction_force.y", "drive.power",
    "A loss.power", "C loss.power", "B spring.energy", "kinetic_energy", "potential_energy",
]  # fmt: skip


def _one_posture():
    """Angles and rates of the four-bar that close its loop, by joint and by body."""
    equations = derive(four_bar())
    start = inputs(equations, 3) | {("q", k): 0.3 for k in range(equations.n_q)}
    return equations, solved(equations, placed(equations, start))


REFERENCE, POINT = _one_posture()


def _value(name):
    """A coordinate or rate of any choice of coordinates in the reference posture."""
    owner, _, label = name.removesuffix(".rate").rpartition(".")
    if not owner.endswith(" floating"):
        return at([REFERENCE.output(name)], POINT)[0]
    scope = REFERENCE.geometry.scope
    motion = scope.frame(scope.bodies[owner.removesuffix(" floating")].body.origin)
    if label != "angle":
        axis = "xy".index(label)
        return at([scope.real((motion.velocity if name.endswith(".rate") else motion.position)[axis])], POINT)[0]
    if name.endswith(".rate"):
        return at([scope.real(motion.angular_velocity[2])], POINT)[0]
    sine, cosine = at([scope.real(motion.rotation[1][0]), scope.real(motion.rotation[0][0])], POINT)
    return float(np.arctan2(sine, cosine))


@pytest.mark.parametrize("cut", CUTS, ids=str)
def test_several_cuts_give_one_motion(cut):
    equations = derive(four_bar(cut))
    point = inputs(equations)
    point |= {("q", k): _value(coordinate.name) for k, coordinate in enumerate(equations.coordinates)}
    point |= {("v", k): _value(name) for k, name in enumerate(equations.velocity_names)}
    residuals = [row.value for row in equations.rows] + [row.rate for row in equations.rows]
    np.testing.assert_allclose(at(residuals, point), 0.0, atol=1e-12)
    point = solved(equations, point)
    found = at([equations.output(name) for name in ASKED], point)
    expected = at([REFERENCE.output(name) for name in ASKED], POINT)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_cutting_costs_rows_not_physics():
    """Tree coordinates are the cheapest; absolute coordinates pay for their rows."""
    both = REFERENCE, derive(four_bar("all"))
    counts = [operations(newton(e, ActiveSet(range(len(e.rows)), (), False))) for e in both]
    assert counts[0] < counts[1]
    assert len(REFERENCE.rows) == 2
    assert len(derive(four_bar("all")).rows) == 8
