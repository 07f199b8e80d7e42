"""Between rows a run is as accurate as the continuous extension of its scheme says."""

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.errors import UnknownNameError
from mbd.integrators.extension import EXTENSIONS, HERMITE, extension_of
from tests.simulation.mechanisms import pendulum

END = 1.6
EXACT = mbd.RungeKutta853()


@cache
def reference(count):
    run = mbd.simulate(pendulum(), _start(), EXACT, dt=END / 640, until=END)
    return _between(run, count)


def _start():
    return mbd.assemble(pendulum(), {"hinge.angle": 1.1}, {"hinge.angle": 0.4})


def _between(run, count):
    """Angles and rates at places in `count` intervals of a run, none of which is a row or a middle."""
    times = (np.arange(count)[:, None] + [0.2, 0.65]).ravel() * END / count
    state = run.at(times)
    return np.column_stack([state["hinge.angle"], state["hinge.angle.rate"]])


@pytest.mark.parametrize("name", EXTENSIONS)
def test_between_exact_rows_the_error_falls_with_the_order_of_the_extension(name):
    errors = []
    for count in (8, 16):
        run = mbd.simulate(pendulum(), _start(), EXACT, dt=END / count / 8, until=END, store=8)
        run.record.settings.update({"between": name, "store": 1})  # its rows as those of another scheme
        errors.append(np.max(np.abs(_between(run, count) - reference(count)), axis=0))
    orders = np.log2(errors[0] / np.maximum(errors[1], 1e-15))
    print(name, errors, orders)
    assert np.all(orders > EXTENSIONS[name].order - 0.4)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta4(), mbd.RungeKutta853()], ids=repr)
def test_a_run_names_the_extension_of_its_scheme(scheme):
    run = mbd.simulate(pendulum(), _start(), scheme, dt=0.02, until=0.1)
    assert run.record.extension is extension_of(scheme.between)


def test_an_extension_that_there_is_not_is_refused_by_name():
    class Own(mbd.HHT):
        between = "cubic"

    with pytest.raises(UnknownNameError, match="no continuous extension named 'cubic'"):
        mbd.simulate(pendulum(), _start(), Own(0.05), dt=0.02, until=0.1)
    assert extension_of(HERMITE) is HERMITE
