"""A run that cannot go on says why, and keeps everything computed."""

import os
import re
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import mbd
from mbd.integrators import StepReport, StepResult
from mbd.kernel import codes
from mbd.simulation.diagnostics.causes import CAUSES, Words
from tests.simulation.mechanisms import ball, falling, pendulum, point, run


def short_of_breath(backend):
    """A force that is not a number after 0.5 s."""
    model, body = falling()
    model.apply(mbd.Applied("gasp", body.origin, force=(0.0, lambda t: mbd.sqrt(0.5 - t), 0.0)))
    return mbd.simulate, model, mbd.assemble(model, {"fall.displacement": 1.0}, backend=backend)


@pytest.mark.parametrize("backend", ["auto", "python"])
def test_on_request_a_failure_is_returned(backend):
    simulate, model, start = short_of_breath(backend)
    trajectory = simulate(model, start, mbd.HHT(0.05), dt=0.01, until=1.0, backend=backend, on_failure="return")
    assert not trajectory.success and trajectory.failure is not None
    assert trajectory.time[-1] == pytest.approx(0.5)
    again = simulate(model, trajectory.final, mbd.HHT(0.05), dt=1e-3, until=0.5 - 1e-9 + 1e-9, backend=backend)
    assert again.success, "the state kept can be gone on from"


def test_a_function_that_raises_while_it_is_traced_is_told_by_name():
    model, body = falling()

    def push(t):
        raise RuntimeError("out of ideas")

    model.apply(mbd.Applied("push", body.origin, force=(0.0, push, 0.0)))
    with pytest.raises(mbd.TraceError, match="'push'.*out of ideas"):
        mbd.assemble(model)


def test_a_step_that_does_not_converge_names_what_is_closed_and_what_to_try():
    model, body = falling()
    model.constrain(mbd.Penalty("floor", mbd.height(body.origin), stiffness=1e18, exponent=3))
    trajectory = run(model, {"fall.displacement": 1.0}, on_failure="return", until=2.0, dt=0.1)
    if not trajectory.success:
        assert "'floor' closed" in trajectory.message and "dt" in trajectory.message
    assert np.isfinite(trajectory.record.q).all()


def test_blows_without_end_and_without_a_rest_speed_end_at_rest():
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, until=2.0, rest_speed=0.0)
    assert trajectory["floor.force"][-1] == pytest.approx(2.0 * 9.81, rel=1e-12)
    assert any("Zeno sequence" in note for note in trajectory.stats["notes"]) and len(trajectory.events) < 80
    assert trajectory["fall.displacement"].min() > -1e-12


# interruptions ------------------------------------------------------------------------------------------------------


def test_a_signal_from_the_keyboard_reaches_a_compiled_run():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.1)
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-7, until=5.0, store=10**6, on_failure="return")
    assert "interrupted" in trajectory.message and 0.0 < trajectory.final.time < 5.0


@pytest.mark.skipif(sys.platform == "win32", reason="signals are not ignored by children there")
def test_the_suite_ends_where_interrupts_are_ignored():
    """As under nohup, and in jobs in the background: what waits for an interrupt gets it all the same."""
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, "-k", "signal_from_the_keyboard"]
    ended = subprocess.run(
        ["sh", "-c", 'trap "" INT; exec "$@"', "sh", *words], capture_output=True, text=True, timeout=300
    )
    assert ended.returncode == 0, ended.stdout


def test_an_observer_that_always_interrupts_does_not_lose_the_run():
    def rude(t, state):
        raise KeyboardInterrupt

    trajectory = run(pendulum(), {"hinge.angle": 1.0}, observers=[rude], on_failure="return")
    assert not trajectory.success and "interrupted" in trajectory.message and len(trajectory.time) >= 1


def test_an_observer_that_fails_ends_the_run_with_its_reason_and_cause():
    def broken(t, state):
        raise ValueError("no disk")

    with pytest.raises(mbd.SimulationError, match="no disk") as failed:
        run(pendulum(), {"hinge.angle": 1.0}, observers=[broken])
    cause = failed.value.__cause__
    assert isinstance(cause, mbd.SimulationError) and isinstance(cause.__cause__, ValueError)
    assert failed.value.run is not None


def test_observers_and_progress_see_the_end():
    seen, shown = [], []
    run(
        pendulum(), {"hinge.angle": 1.0}, observers=[lambda t, state: seen.append((t, state["hinge.angle"]))],
        progress=lambda t, until: shown.append((t, until)),
    )  # fmt: skip
    assert seen[-1][0] == 1.0 and shown[-1] == (1.0, 1.0)
    assert [t for t, _ in seen] == sorted(t for t, _ in seen)


def test_a_contact_with_a_gap_that_fails_names_it():
    model, body = point()
    model.constrain(mbd.Unilateral("well", mbd.measure(lambda p: mbd.log(p[1]) + 5.0, body.origin), only_while=None))
    trajectory = run(model, {"place.y": 1.0}, {"place.y": 0.0}, on_failure="return", dt=0.4, until=3.0)
    assert np.isfinite(trajectory.record.q).all()


def test_a_motion_that_runs_away_asks_for_a_smaller_dt_and_not_for_a_larger_one():
    """v̇ = 600 v³ reaches infinity after 1/(2 · 600 · v₀²) = 33 µs; no step of 10 ms sees that."""
    model, body = falling(mass=1.0)
    law = mbd.Applied("sting", body.origin, force=lambda p, v: (0.0, 600.0 * v**3, 0.0),
                      arguments=(body.origin, "fall.rate"))  # fmt: skip
    model.apply(law)
    start = mbd.assemble(model, velocity={"fall.displacement": 5.0})
    failed = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.01, until=1.0, backend="python", on_failure="return")
    assert not failed.success and "lets it run away; try dt = " in failed.message
    assert (
        "larger" not in failed.message
        and "'fall.displacement.rate' changes by 1.5e+02 times the largest" in failed.message
    )


class Shy(mbd.Newmark):
    """A scheme that stops for a reason of its own."""

    def step(self, system, state, dt, mode, memory):
        return StepResult(state, memory, StepReport(converged=False, message="too shy"))


def test_what_an_integrator_of_ones_own_says_of_its_failure_is_told():
    model, _body = falling()
    failed = mbd.simulate(model, mbd.assemble(model), Shy(), dt=0.01, until=1.0, on_failure="return")
    assert "Shy says: too shy" in failed.message and "rank" not in failed.message


def test_every_failure_of_the_kernel_has_a_cause_and_a_cure():
    named = {name: code for name, code in vars(codes).items() if name.isupper() and 10 <= code < 40}
    assert len(named) > 20
    for name, code in named.items():
        rows = [cause for cause in CAUSES if code in cause.status]
        assert rows and rows[-1].cure, name


def test_a_cause_asks_for_nothing_that_words_do_not_tell():
    told = set(dir(Words)) | set(Words.__init__.__code__.co_names) | {"v", "stepper"}
    asked = {name for cause in CAUSES for name in re.findall(r"{x\.(\w+)", cause.sentence + cause.cure)}
    assert asked and asked <= told


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.Newmark(), mbd.RadauIIA(), mbd.GeneralizedAlpha(0.5)])
@pytest.mark.parametrize("steepness", [300.0, 1000.0])
def test_steps_that_fail_without_any_constraint_are_not_blamed_on_a_singular_configuration(scheme, steepness):
    model = mbd.Model("steep wall", gravity=(0.0, 0.0, 0.0))
    ball = mbd.PointMass("ball", mass=1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, ball.origin)
    model.connect(rail)
    push = mbd.Motor("wall", rail, force=lambda x: -mbd.exp(steepness * x), arguments=["rail.displacement"])
    model.apply(push)
    start = mbd.assemble(model, velocity={"rail.displacement": 5.0})
    with pytest.raises(mbd.SimulationError, match="try a smaller dt|is not finite") as raised:
        mbd.simulate(model, start, scheme, dt=1.0, until=3.0)
    assert "singular" not in str(raised.value) and "rows" not in str(raised.value)
