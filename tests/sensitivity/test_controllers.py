"""Derivatives of runs with controllers, what these wrote being held: those of runs in which it is written again."""

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from tests.sensitivity.differences import differences, off
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start, pendulum

EXACT = {"tolerance": 1e-12}
SCHEMES = [
    mbd.Newmark(**EXACT), mbd.HHT(0.05, **EXACT), mbd.HHT(0.05, formulation="index3", **EXACT), mbd.RungeKutta853(),
    mbd.RadauIIA(**EXACT),
]  # fmt: skip


class Noted:
    """A law of control whose answers are noted, and given again, whatever it reads, while `again` is true."""

    def __init__(self, law):
        self.law, self.answers, self.again = law, [], False

    def __call__(self, time, values, state):
        number = state or 0
        if not self.again:
            del self.answers[number:]
            self.answers.append(self.law(number, values))
        return self.answers[number] if number < len(self.answers) else None, number + 1


def of_angle(number, values):
    """Shortens a pendulum as it swings, and as it strikes (8); some answers, after that too, write nothing."""
    return {"rod.center": 0.5 + 0.1 * np.sin(3.0 * values["hinge.angle"])} if number not in (3, 9, 10) else None


def of_step(number, values):
    """Tilts the ground under a walker, at samples and as its knee locks; not at the sample after that (4)."""
    return {"gravity.x": 0.5 + 0.1 * values["right hip.angle"]} if number != 4 else None


def stopped(*controllers):
    """A pendulum that strikes a stop."""
    model = pendulum(loss=mbd.Viscous(0.1))
    model.constrain(mbd.Unilateral("stop", mbd.measure(lambda angle: angle + 0.2, "hinge.angle"), restitution=0.8))
    model.apply(*controllers)
    return model


@cache
def struck():
    law = Noted(of_angle)
    model = stopped(mbd.Controller("winch", law, 0.07, ["stop"], reads=["hinge.angle"], writes=["rod.center"]))
    names = ["hinge.angle", "hinge.angle.rate", "rod.inertia", "gravity.y"]
    return model, law, mbd.assemble(model, {"hinge.angle": 1.0}), names, {"dt": 0.02, "until": 1.0}


@cache
def stepped():
    model, law = kneed_walker(), Noted(of_step)
    reads, writes = ["right hip.angle"], ["gravity.x"]
    model.apply(mbd.Controller("tilt", law, period=0.15, on=["right knee lock"], reads=reads, writes=writes))
    start = kneed_walker_start(model, open=["right foot"])
    return model, law, start, ["left hip.angle", "left hip.angle.rate"], {"dt": 0.01, "until": "right foot"}


def judged(model, law, start, names, settings, scheme):
    """The table, and how far it is off the derivatives of runs in which the same is written again."""
    law.again = False
    found = mbd.sensitivities(model, start, scheme, wrt=names, hold=[], controllers="held", **settings)
    law.again = True
    wanted = differences(model, start, scheme, names, step=3e-4, **settings)[0]
    law.again = False
    return found, off(found.matrix, wanted).max()


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_derivatives_are_those_of_runs_with_the_same_values(scheme):
    found, far = judged(*struck(), scheme)
    assert [event.name for event in found.run.events] == ["stop"] and len(found.run.record.parameter_changes) > 6
    assert far < 1e-8
    assert repr(found).endswith("held as controllers wrote them: rod.center") and found.written == ("rod.center",)


@pytest.mark.parametrize(
    ("scheme", "dt"), [(SCHEMES[0], 0.0086), (SCHEMES[1], 0.0086), (SCHEMES[2], 0.01), (SCHEMES[3], 0.01)]
)
def test_derivatives_of_a_walker_on_ground_that_a_controller_tilts(scheme, dt):
    model, law, start, names, settings = stepped()
    found, far = judged(model, law, start, names, {**settings, "dt": dt}, scheme)
    assert len(found.run.record.parameter_changes) == 4 and found.run.events[0].name == "right knee lock"
    assert far < 1e-8


def test_writes_that_do_not_depend_on_the_state_leave_the_derivative_as_it_is():
    """A controller that writes what is there leaves the run as it is, as its samples are on the grid; others in time
    have the derivatives of their own runs."""
    _, _, start, names, _ = struck()
    same = mbd.Controller("same", lambda time, values, state: {"rod.center": 0.5}, 0.0625, writes=["rod.center"])
    by_time = {"period": 0.07, "writes": ["rod.center"]}
    in_time = mbd.Controller("in time", lambda time, values, state: {"rod.center": 0.5 + 0.1 * time}, **by_time)
    settings = {"dt": 2.0**-6, "until": 0.5, "wrt": names}
    expected = mbd.sensitivities(stopped(), start, SCHEMES[1], **settings)
    found = mbd.sensitivities(stopped(same), start, SCHEMES[1], controllers="held", **settings)
    assert np.array_equal(found.matrix, expected.matrix)
    swinging = stopped(in_time)
    settings = {"dt": 0.02, "until": 0.5}
    found = mbd.sensitivities(swinging, start, SCHEMES[1], wrt=names, controllers="held", **settings)
    assert off(found.matrix, differences(swinging, start, SCHEMES[1], names, **settings)[0]).max() < 1e-8


def test_a_run_says_that_what_controllers_wrote_is_held(tmp_path):
    model, _, start, names, _ = struck()
    settings = {"dt": 0.02, "until": 0.3, "wrt": names}
    run = mbd.simulate(model, start, controllers="held", **settings)
    found = mbd.sensitivities(model, start, controllers="held", **settings)
    assert np.array_equal(run.sensitivities.matrix, found.matrix)
    assert mbd.load(run.save(tmp_path / "run")).sensitivities.written == ("rod.center",)


def test_what_is_not_differentiated_through_controllers_is_named():
    model, _, start, names, _ = struck()
    settings = {"dt": 0.02, "until": 0.3}
    held = {"controllers": "held", **settings}
    for run in (mbd.sensitivities, mbd.simulate):
        with pytest.raises(mbd.CapabilityError, match=r"\('winch'\) .* controllers='held'\) leaves that out"):
            run(model, start, wrt=names, **settings)
        with pytest.raises(mbd.CapabilityError, match="'rod.center' is held as 'winch' writes it"):
            run(model, start, wrt=["rod.center"], **held)
        with pytest.raises(mbd.ModelError, match="controllers='free' is not available"):
            run(model, start, wrt=names, controllers="free", **settings)
    with pytest.raises(mbd.CapabilityError, match="check_events"):
        mbd.sensitivities(model, start, wrt=names, check_events={names[0]: 0.01}, **held)
    with pytest.raises(mbd.ModelError, match="wrt="):
        mbd.simulate(model, start, **held)
    with pytest.raises(mbd.CapabilityError, match="controllers='held'"):
        final_state_derivative(mbd.simulate(model, start, **settings), names)


def test_a_sample_that_cuts_a_step_on_constraints_short_keeps_all_digits():
    assert judged(*stepped(), SCHEMES[1])[1] < 1e-8
