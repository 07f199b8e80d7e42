"""Forces with first-order states of their own: ż = s(t, q, v, z) stands beside the balance."""

from dataclasses import dataclass

import numpy as np
import pytest

import mbd
from mbd.bodies.base import Frame
from mbd.equations import derive
from mbd.equations.programs import ActiveSet, accelerations, newton, residual
from mbd.forces.base import Action, Force
from mbd.joints.base import Joint
from tests.equations.numbers import at, block, derivative, inputs


@dataclass(frozen=True)
class Muscle(Force):
    """A pull between a frame and a joint's rate whose activation follows height and rate with a lag."""

    name: str
    joint: Joint
    frame: Frame
    lag: float
    rated: bool = True

    @property
    def kind(self):
        return "applied"

    def mentions(self):
        return [self.joint, self.frame]

    def parameters(self):
        return {f"{self.name}.lag": self.lag}

    def act(self, scope):
        z = scope.state(self.name, "activation", 0.1)
        motion = scope.frame(self.frame)
        (rate,) = scope.joint(self.joint.name).rates
        goal = motion.position[1] + 0.3 * motion.velocity[0] + mbd.sin(scope.time) - z
        rates = ((z, goal / scope.parameter(self.name, "lag", self.lag)),) if self.rated else ()
        return Action(pairs=((rate, 3.0 * z), (motion.velocity[1], z * z)), rates=rates)


def model(rated=True):
    system = mbd.Model("pulled")
    upper = mbd.Link("upper", mass=1.2, length=0.5, center=0.2, inertia=0.02)
    lower = mbd.Link("lower", mass=0.8, length=0.4, center=0.2, inertia=0.01)
    hip, knee = mbd.Revolute("hip", system.ground.origin, upper.start), mbd.Revolute("knee", upper.end, lower.start)
    system.connect(hip, knee)
    system.apply(Muscle("muscle", knee, lower.end, lag=0.2, rated=rated))
    system.constrain(mbd.Bilateral("rod", mbd.distance(system.ground.point(0.5, 0.1), lower.end), value=0.6))
    return system


def test_states_stand_behind_the_coordinates():
    equations = derive(model())
    assert [state.name for state in equations.states] == ["muscle.activation"]
    assert equations.states[0].default == 0.1
    point = inputs(equations, 1)
    height, speed = at([equations.output("lower.end.y"), equations.output("lower.end.vx")], point)
    goal = height + 0.3 * speed + np.sin(point["t", 0]) - point["z", 0]
    assert at(list(equations.balance), point)[2] == pytest.approx(point["s", 0] - goal / 0.2)
    assert at([equations.output("muscle.activation")], point)[0] == point["z", 0]


def test_tangent_covers_states():
    equations = derive(model())
    point = inputs(equations, 2, x=0.1)
    K, *_ = block(at(newton(equations, ActiveSet([0])), point), (4, 4), (3,), (1,), (1,), (1, 2))
    out = residual(equations, ActiveSet([0]))
    c0, c1 = point["c", 0], point["c", 1]
    for j in range(2):
        change = derivative(out, point, {("a", j): 1.0, ("v", j): c0, ("x", j): c1})
        np.testing.assert_allclose(K[:3, j], change[:3], atol=1e-7)
    change = derivative(out, point, {("s", 0): 1.0, ("z", 0): c0})
    np.testing.assert_allclose(K[:3, 2], change[:3], atol=1e-8)
    assert K[3, 2] == K[2, 3] == 0.0


def test_accelerations_program_pads_the_rows_of_states():
    equations = derive(model())
    point = inputs(equations, 3)
    M, f, R, B, *_ = block(at(accelerations(equations), point), (3, 3), (3,), (3, 1), (1, 3), (1,), (1,), (1,), (1,))
    assert M[2, 2] == 1.0
    assert not M[2, :2].any()
    assert not M[:2, 2].any()
    assert B[0, 2] == R[2, 0] == 0.0
    rest = point | {(kind, k): 0.0 for kind in ("a", "s", "lam") for k in range(2)}
    np.testing.assert_allclose(f, at(list(equations.balance), rest))


def test_a_state_without_a_rate_is_a_fault():
    with pytest.raises(mbd.ModelError, match=r"state 'muscle\.activation' has no rate"):
        derive(model(rated=False))
