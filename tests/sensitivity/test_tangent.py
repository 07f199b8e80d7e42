"""The kernel with derivatives: its printer, and its runs beside differences of runs."""

import ctypes

import numpy as np
import pytest

import mbd
from mbd.compile.llvm import Machine
from mbd.kernel.algebra import linear
from mbd.kernel.build import object_of
from mbd.kernel.translation.translate import Source, functions_of, translate
from mbd.sensitivity.derivative import final_state_derivative
from mbd.sensitivity.tangent.build import own_rules
from mbd.sensitivity.tangent.printer import LANES, tangent_text
from mbd.sensitivity.tangent_run import TangentRun
from mbd.simulation.interrupted import stopped
from mbd.testing.mechanisms import random_scene
from tests.gait.test_gaits_with_modes import walker as walker_with_modes
from tests.helpers import one_body
from tests.sensitivity.differences import differences, off
from tests.sensitivity.test_cones import box
from tests.sensitivity.turns import judged
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start
from tests.simulation.test_cones import thrown

CLOSE = {"tolerance": 1e-12}
SCHEMES = [
    mbd.RungeKutta853(), mbd.RungeKutta4(), mbd.RadauIIA(**CLOSE), mbd.HHT(0.05, **CLOSE), mbd.Newmark(**CLOSE),
    mbd.GeneralizedAlpha(0.8, **CLOSE), mbd.HHT(0.05, formulation="index3", **CLOSE),
]  # fmt: skip

TEXT = '''
def entry(K: Kernel, x: Reals, out: Reals) -> int:
    """All that has a derivative."""
    out[0] = x[0] * x[1] - x[0] / x[1] + (x[1] - 2.0 * x[0])
    out[1] = x[0] ** 3.0 + x[0] ** x[1]
    out[2] = sqrt(x[0] * x[0] + x[1]) + abs(-x[0]) + abs(x[1])
    out[3] = max(x[0], x[1], x[0] * x[1]) + min(x[0], x[1])
    out[4] = x[0] if x[0] < x[1] else x[1]
    out[5] = half(chosen(x, out), 0)
    out[5] += x[1] * x[0]
    total = 0.0
    for i in range(2):
        total += float(i + 1) * x[i]
    while total < 10.0:
        total *= 1.5
    out[6] = total % 7.0
    out[7] = float(int(x[0]))
    return 0


def chosen(x: Reals, out: Reals) -> Reals:
    return x if out[0] < 1e9 else out


def half(x: Reals, i: int) -> float:
    return 0.5 * x[i]
'''


def test_every_operation_has_its_derivative():
    """Beside differences of order 4 of the values themselves."""
    source = Source("given", functions_of(TEXT), {})
    code = object_of(tangent_text(translate(source, "entry", ["kernel", "reals", "reals"]), "given_entry", ()), 0)
    machine = Machine()
    run = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 6)(machine.load(code, ["given_entry"])[0])

    def at(x):
        x, out = np.array(x), np.zeros(8)
        of_x, of_out = np.zeros((2, LANES)), np.zeros((8, LANES))
        of_x[:, 0], of_x[:, 3] = (1.0, 0.0), (0.5, -2.0)
        given = [each.ctypes.data for each in (x, out, of_x, of_out)]
        run(None, given[0], given[1], None, given[2], given[3])
        return out, of_out

    for x in np.random.default_rng(1).uniform(0.3, 1.7, (20, 2)):
        out, found = at(x)
        assert np.isfinite(out).all() and not found[:, 1].any()
        for lane, way in ((0, np.array([1.0, 0.0])), (3, np.array([0.5, -2.0]))):
            h = 1e-4
            one, two = ((at(x + k * h * way)[0] - at(x - k * h * way)[0]) / (2.0 * k * h) for k in (1, 2))
            smooth = np.abs(one - two) < 1e-2  # no choice is turned between them
            assert smooth.sum() > 5
            assert found[smooth, lane] == pytest.approx(((4.0 * one - two) / 3.0)[smooth], rel=1e-6, abs=1e-8)


SOLVERS = """
def entry(K: Kernel, A: Reals, b: Reals, pivots: Integers, work: Reals, way: int) -> int:
    if way == 0:
        return 0 if solve_definite(A, 3, b, work) > 0.0 else 1
    if way == 1:
        status = factor(A, 3, pivots)
        solve(A, 3, pivots, b)
        return status
    return 0 if eliminate(A, 3, b, pivots, work, 1e-12) == 3 else 1
"""


@pytest.mark.parametrize("way", range(3))
def test_entries_that_are_zero_have_derivatives_in_every_elimination(way):
    """``A x = b → A x' = b' − A' x`` where A is diagonal and A' is full, as M is where links stand square."""
    known = {name: getattr(linear, name) for name in ("solve_definite", "factor", "solve", "eliminate")}
    source = Source("given", functions_of(SOLVERS), known)
    kinds = ["kernel", "reals", "reals", "integers", "reals", "int"]
    found = translate(source, "entry", kinds, instead=own_rules())
    machine = Machine()
    address = machine.load(object_of(tangent_text(found, "given_solver", ()), 0), ["given_solver"])[0]
    run = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64, *[ctypes.c_void_p] * 4)(address)
    A, b, work, pivots = (
        np.diag([1.0, 2.0, 3.0]),
        np.array([1.0, -2.0, 0.5]),
        np.zeros(40),
        np.zeros(40, dtype=np.int64),
    )
    of_A, of_b, of_work = np.zeros((9, LANES)), np.zeros((3, LANES)), np.zeros((40, LANES))
    change = np.array([[0.3, 0.7, -0.4], [0.7, 0.2, 0.9], [-0.4, 0.9, -0.5]])
    of_A[:, 2], of_b[:, 2] = change.ravel(), (0.1, 0.4, -0.6)
    x = np.linalg.solve(A, b)
    wanted = np.linalg.solve(A, of_b[:, 2] - change @ x)
    values = A.ravel().copy()
    given = [each.ctypes.data for each in (values, b, pivots, work)]
    assert run(None, *given, way, None, *(each.ctypes.data for each in (of_A, of_b, of_work))) == 0
    assert b == pytest.approx(x) and of_b[:, 2] == pytest.approx(wanted, rel=1e-14)


def test_a_scene_that_starts_where_masses_do_not_couple():
    """Its M has zeros at the start, at which the first stages of an explicit step still are."""
    model = random_scene(175, bodies=3)
    start = mbd.assemble(model)
    for scheme in (mbd.RungeKutta4(), mbd.RungeKutta853()):
        error, noise = judged(model, start, scheme, ways=1, step=1e-4, dt=5e-3, until=1.5)
        assert np.all(error <= np.maximum(1e-7, 2.0 * noise)), scheme


def against_differences(model, start, scheme, names, **settings):
    """The largest error of a direction over its largest entry, and how well differences are known."""
    state, time = final_state_derivative(mbd.simulate(model, start, scheme, **settings), names)
    wanted, noise = differences(model, start, scheme, names, **settings)
    return max(off(np.vstack([state, time]), wanted)), max(noise)


def test_a_walker_by_every_scheme():
    """Over the lock of its knee and its foot's impact."""
    model = kneed_walker()
    start = kneed_walker_start(model)
    names = [*start.names, *start.velocity_names, "right thigh.mass", "gravity.x"][:10]
    for scheme in SCHEMES:
        error, noise = against_differences(model, start, scheme, names, dt=0.005, until="right foot")
        assert error <= max(1e-7, 2.0 * noise), scheme


@pytest.mark.parametrize(
    ("inertia", "height", "wave", "pose"),
    [(0.018, 0.15, 3.5, (0.28, -0.02)), (0.0114, 0.137, 3.35, (0.57, -0.41)), (0.0118, 0.135, 2.38, (0.54, -0.06))],
)
def test_steps_that_take_several_of_newtons_matrices(inertia, height, wave, pose):
    """A light body slides over a hill: positions are corrected in the metric of the last matrix, not of the first."""
    model, body = one_body(mbd.RigidBody("body", 2.5, inertia), mbd.Planar, "flight")
    runner = mbd.touchdown(body.point(-0.2, -0.1), lambda x: height * mbd.sin(wave * x))
    model.constrain(mbd.Unilateral("runner", runner, friction=0.0))
    position = dict(zip(("flight.x", "flight.angle"), pose, strict=True))
    start = mbd.assemble(model, position, {"flight.x.rate": 0.5}, closed="runner")
    scheme, names = mbd.GeneralizedAlpha(0.0, **CLOSE), ["body.mass"]
    error, noise = against_differences(model, start, scheme, names, dt=0.0196, until=0.196)
    assert error <= max(1e-7, 2.0 * noise)


def test_a_disk_that_rolls_and_leans_by_schemes_that_correct_positions():
    """Positions are corrected along rows on positions, across those on velocities, whose directions change as well."""
    model, body = one_body(mbd.RigidBody("body", 2.0, (0.01, 0.01, 0.02)), mbd.Free, "float")
    model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(body.origin, 0.14, axis=(0, 0, 1))))
    model.constrain(mbd.Rolling("grip", body.origin, 0.14, axis=(0, 0, 1)))
    position = {"float.orientation": ((1.0, 0.0, 0.0), 0.3)}
    start = mbd.assemble(model, position, {"float.x": 1.0, "float.angular_velocity.y": 1.0})
    settings = {"dt": 0.004, "until": 0.2}
    for scheme in (mbd.HHT(0.05, **CLOSE), mbd.GeneralizedAlpha(0.5, **CLOSE)):
        error, noise = judged(model, start, scheme, ways=2, step=1e-4, **settings)
        assert np.all(error <= np.maximum(1e-8, 2.0 * noise)), scheme


def test_modes_with_timers_and_memories_have_derivatives():
    model, start = walker_with_modes(remembers=True)
    names = ["left hip.angle.rate", "waist.angle", "torso.mass"]
    for scheme in (SCHEMES[0], SCHEMES[3]):
        error, noise = against_differences(model, start, scheme, names, dt=0.005, until=1.2)
        assert error <= max(1e-7, 2.0 * noise), scheme


@pytest.mark.parametrize(
    "settings", [{"contact": "nonsmooth"}, {"impact": "poisson"}, {"impact": "sequential"}], ids=str
)
def test_a_thrown_mass_with_friction_in_space_by_every_scheme(settings):
    model = thrown(0.3, 0.6)
    start = mbd.assemble(model, {"slide.y": 0.01}, {"slide.x": 1.2, "slide.y": -1.0, "slide.z": 0.5})
    for scheme in SCHEMES:
        error, noise = judged(model, start, scheme, ways=1, dt=5e-3, until=0.1, **settings)
        assert np.all(error <= np.maximum(1e-8, 2.0 * noise)), scheme


@pytest.mark.parametrize("scheme", [SCHEMES[0], SCHEMES[3]], ids=repr)
def test_a_floating_box_that_strikes_and_slides_by_nonsmooth_steps(scheme):
    """With a quaternion, corners and friction in a plane."""
    found = judged(*box(0.3), scheme, ways=2, parameters=["gravity.y"], dt=2.5e-3, until=0.25, contact="nonsmooth")
    assert found is not None and np.all(found[0] <= np.maximum(1e-7, 2.0 * found[1])), found


@pytest.mark.parametrize("raised", [KeyboardInterrupt, SystemExit])
def test_an_interruption_is_no_failure_of_the_derivatives(raised, monkeypatch):
    """Ctrl-C ends searches and fits that go on where a run has no derivative."""
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1), mbd.Revolute, "hip")
    start, calls = mbd.assemble(model, {"hip.angle": 0.3}), []
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=2.0)
    collect = TangentRun.collect

    def interrupted(run):
        calls.append(run)
        if len(calls) == 3:
            raise raised
        collect(run)

    monkeypatch.setattr(TangentRun, "collect", interrupted)
    with pytest.raises(raised):
        final_state_derivative(run, ["rod.center"])
    calls.clear()
    with pytest.raises(mbd.SimulationError) as caught:  # a run that carries derivatives ends as any other
        mbd.sensitivities(model, start, mbd.HHT(), dt=1e-3, until=2.0, wrt=["rod.mass"])
    assert stopped(caught.value.run)
