"""Systems of steps in straight-line code (`mbd.sensitivity.tangent.systems`) beside those solved by matrices."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import mbd
from mbd.compile import mechanisms
from mbd.sensitivity.tangent import programs
from mbd.testing.mechanisms import random_scene
from tests.sensitivity.test_tangent import CLOSE
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

SCHEMES = (
    mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE), mbd.HHT(0.05, **CLOSE), mbd.HHT(0.05, formulation="index3", **CLOSE)
)  # fmt: skip
NAMES = "step", "metric", "rates"


def walker():
    """Closed feet and knees, impacts; the right knee is held by a row on positions."""
    model = kneed_walker()
    return model, kneed_walker_start(model), {"dt": 0.005, "until": "right foot"}


def sleigh():
    """A row on velocities beside one on positions, and coordinates on which neither acts."""
    model, body = mbd.Model("sleigh"), mbd.RigidBody("body", 2.0, 0.3, center=(0.2, 0.1, 0.0))
    arm, tail = mbd.Link("arm", 0.7, 0.5, 0.2, 0.03), mbd.Link("tail", 0.3, 0.4, 0.2, 0.02)
    model.connect(
        mbd.Planar("slide", model.ground.origin, body.origin), mbd.Revolute("elbow", body.point(0.3, 0.0), arm.start),
        mbd.Revolute("hinge", arm.end, tail.start, stiffness=0.4),
    )  # fmt: skip
    model.constrain(
        mbd.KnifeEdge("edge", body.origin),
        mbd.Bilateral("rail", mbd.measure(lambda tip: tip[1] - 0.2 * tip[0] + 0.1, arm.end)),
    )
    start = mbd.assemble(model, {"slide.angle": 0.3, "elbow.angle": -1.0}, {"slide.x": 0.8, "hinge.angle": 2.0})
    return model, start, {"dt": 0.004, "until": 0.3}


def scene(seed):
    model = random_scene(seed)
    return model, mbd.assemble(model), {"dt": 0.005, "until": 0.5}


def derivatives(made, scheme):
    model, start, settings = made()
    wrt = [*start.names[:3], start.velocity_names[-1], "gravity.y"]
    return mbd.sensitivities(model, start, scheme, wrt=wrt, hold=[], **settings).matrix


@pytest.mark.parametrize(
    "made", [walker, sleigh, partial(scene, 8), partial(scene, 21)], ids=["walker", "sleigh", "scene 8", "scene 21"]
)
def test_straight_line_code_and_matrices_give_the_same_derivatives(made, monkeypatch):
    """Also where pivots in a fixed order are too small: matrices take over within the run."""
    answered, replaced = [], []
    kept = {name: getattr(programs, name) for name in NAMES}

    def counted(name, *given):
        found = kept[name](*given)
        answered.append(found.answer is not None)
        return found

    def without(name, *given):
        found = kept[name](*given)
        replaced.append(name)
        return replace(found, lines=(), known={}, values=[0.0 * node for node in found.values], answer=None)

    def unsound(name, *given):
        found = kept[name](*given)
        replaced.append(name)
        return replace(found, values=[*found.values[:-1], 0.0 * found.values[-1]])

    for scheme in SCHEMES:
        found = []
        for way in (counted, without, unsound):
            for name in NAMES:
                monkeypatch.setattr(programs, name, lambda *given, name=name, way=way: way(name, *given))
            mechanisms._BY_WORDS.clear()
            found.append(derivatives(made, scheme))
        size = np.max(np.abs(found[0]), axis=1, keepdims=True) + np.max(np.abs(found[0])) * 1e-6
        assert np.all(np.abs(found[1] - found[0]) <= 1e-9 * size), scheme
        assert np.all(np.abs(found[2] - found[0]) <= 1e-9 * size), scheme
    assert sum(answered) >= len(SCHEMES) and len(replaced) == 2 * len(answered)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("made", [walker, sleigh, partial(scene, 8)], ids=["walker", "sleigh", "scene 8"])
def test_derivatives_by_several_parameters_are_sums_of_those_by_each(made, scheme):
    """What one direction alone changes stands ready in its lane; sums of directions are multiplied."""
    model, start, settings = made()
    names = [name for name in model.parameters if name.endswith((".mass", ".inertia", "gravity.x", "gravity.y"))][:6]
    rates = np.random.default_rng(len(names)).uniform(-1.0, 1.0, (3, len(names)))
    groups = [{f"way {k}": dict(zip(names, line.tolist(), strict=True))} for k, line in enumerate(rates)]
    single = mbd.sensitivities(model, start, scheme, wrt=[start.names[0], *names], hold=[], **settings)
    mixed = mbd.sensitivities(model, start, scheme, wrt=[*groups, names[0], start.names[0]], hold=[], **settings)
    wanted = np.column_stack([single.matrix[:, 1:] @ rates.T, single.matrix[:, 1], single.matrix[:, 0]])
    size = np.abs(single.matrix).max(axis=1, keepdims=True) + np.abs(single.matrix).max() * 1e-6
    assert np.all(np.abs(mixed.matrix - wanted) <= 1e-10 * size)
