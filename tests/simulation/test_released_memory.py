"""What is no longer needed is given back: models, equations, machine code and runs."""

import gc
import weakref

import numpy as np
import pytest

import mbd
from mbd.compile import mechanisms
from mbd.compile.mechanisms import mechanism_of
from tests.equations.mechanisms import four_bar
from tests.simulation.capability_scenes import SCENES

pytestmark = pytest.mark.usefixtures("older_objects_left_alone")


def loop():
    model = four_bar()
    return model, mbd.assemble(model), 0.05, model.joints[0].name


def lagrangian():
    """A pendulum from its energies."""
    model = mbd.Lagrangian(
        "pendulum",
        ["q"],
        lambda q_rate: 0.5 * q_rate**2,
        potential=lambda q, g: -g * mbd.cos(q),
        parameters={"g": 9.81},
    )
    return model, mbd.assemble(model, {"q": 0.3}), 0.1, "q"


KINDS = {**SCENES, "loop": loop, "energies": lagrangian}


def lived(make, **settings) -> list[weakref.ref]:
    """References to all that a run leaves behind, after it has been looked at."""
    model, start, until, _ = make()
    run = mbd.simulate(model, start, dt=1e-2, until=until, on_failure="return", **settings)
    for name in run.names[:5]:
        run[name]
    run.at(np.linspace(0.0, run.time[-1], 3))[run.names[0]]
    repr((run, run.energy, run.violation, model))
    mechanism = mechanism_of(model, settings.get("backend", "auto"))
    parts = [model, run, run.record, run.final, mechanism, mechanism.equations, mechanism.equations.tape]
    code = mechanism.common["accelerations"]
    return [weakref.ref(part) for part in [*parts, code]]


@pytest.mark.parametrize("kind", KINDS)
def test_a_model_that_is_gone_leaves_nothing_behind(kind):
    references = lived(KINDS[kind])
    mechanisms._BY_WORDS.clear()
    gc.collect()
    assert [reference() for reference in references if reference() is not None] == []


@pytest.mark.parametrize(
    "settings",
    [
        {"backend": "python"}, {"integrator": mbd.RadauIIA()}, {"integrator": mbd.RungeKutta853()},
        {"integrator": mbd.HHT(0.1, form="averaged")},
    ],
    ids=str,
)  # fmt: skip
def test_neither_does_a_scheme_keep_one(settings):
    references = lived(KINDS["penalty"], **settings)
    mechanisms._BY_WORDS.clear()
    gc.collect()
    assert [reference() for reference in references if reference() is not None] == []


def test_a_parameter_folded_into_the_equations_keeps_no_model():
    model, start, until, _ = KINDS["tree"]()
    name = next(name for name, value in model.parameters.items() if value == 0.0)
    mbd.simulate(model, start, dt=1e-2, until=until, parameters={name: 0.5})
    references = [weakref.ref(model), weakref.ref(mechanism_of(model, "auto", {name: 0.5}))]
    del model, start
    mechanisms._BY_WORDS.clear()
    gc.collect()
    assert [reference() for reference in references if reference() is not None] == []
