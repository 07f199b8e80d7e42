"""A scheme that stands in the list of schemes runs compiled, with rows and events, at its order."""

import math
from functools import partial

import numpy as np
import pytest

import mbd
from mbd.errors import CapabilityError
from mbd.integrators import CompiledIntegrator
from mbd.kernel import build
from mbd.kernel.entry import entry
from mbd.kernel.schemes import contract
from mbd.sensitivity.tangent import build as tangent_build
from mbd.state import Mode
from mbd.testing import check_integrator, check_scheme
from mbd.testing.problems import problem
from tests.kernel.bdf2 import BDF2
from tests.kernel.midpoint import Midpoint
from tests.sensitivity.differences import differences, off
from tests.simulation.mechanisms import G, ball, pendulum


@pytest.fixture(scope="module", autouse=True)
def listed():
    """The kernel with two schemes more, an entry and a line in the list each; without passes, for the same bits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "object_of", partial(build.object_of, level=0))
        patch.setattr(contract, "SCHEMES", (*contract.SCHEMES, "tests.kernel.midpoint", "tests.kernel.bdf2"))
        patch.setattr(tangent_build, "LEVEL", 0)
        entry.cache_clear()
        yield
    entry.cache_clear()


def swing():
    model = pendulum()
    return model, mbd.assemble(model, position={"hinge.angle": 1.0})


@pytest.mark.parametrize("scheme", [Midpoint(), BDF2()], ids=repr)
def test_a_listed_scheme_keeps_the_laws(scheme):
    verdict = check_scheme(scheme)
    assert not verdict.notes
    assert verdict.laws["order as promised: within 0.15"] == 3
    assert ("a tolerance is kept" in verdict.laws) is (type(scheme) is BDF2)


def test_a_ball_bounces_when_it_should():
    model = ball(restitution=0.5)
    found = mbd.simulate(
        model, mbd.assemble(model, position={"fall.displacement": 1.0}), Midpoint(), dt=0.01, until=1.0
    )
    fall = math.sqrt(2.0 / G)
    times = [event.time for event in found.events if event.kind == "closed"]
    np.testing.assert_allclose(times[:2], [fall, 2.0 * fall], rtol=0, atol=1e-9)


@pytest.mark.parametrize("scheme", [Midpoint(), BDF2()], ids=repr)
def test_a_listed_scheme_has_derivatives(scheme):
    """Of a ball that bounces, beside differences of order 4; no line of the derivatives knows the scheme."""
    model, names = ball(restitution=0.5), ["fall.displacement", "fall.displacement.rate"]
    start = mbd.assemble(model, {"fall.displacement": 1.0}, {"fall.displacement": 0.3})
    found = mbd.sensitivities(model, start, scheme, dt=0.01, until=1.0, wrt=names)
    wanted, noise = differences(model, start, scheme, names, dt=0.01, until=1.0)
    assert np.all(off(found.matrix, wanted) <= np.maximum(1e-8, 2.0 * noise))


def test_what_it_cannot_do_is_refused_by_its_name():
    model, start = swing()
    with pytest.raises(CapabilityError, match=r"Midpoint\(\) does not estimate its error"):
        mbd.simulate(model, start, Midpoint(), tol=1e-6, until=0.1)


@pytest.mark.parametrize("scheme", [Midpoint(), BDF2()], ids=repr)
def test_a_listed_scheme_steps_any_system(scheme):
    assert sum(check_integrator(scheme, halvings=3).laws.values()) > 20


def test_an_integrator_that_names_no_scheme_is_told_to():
    class Nameless(CompiledIntegrator):
        def order(self, system=None):
            return 1

    posed = problem("varying mass")
    with pytest.raises(CapabilityError, match=r"names no scheme; give its class scheme = '…', or a step of its own"):
        Nameless().start(posed.system, posed.start, Mode(), 0.1)


def test_the_kernel_of_another_order_of_schemes_is_another():
    with pytest.MonkeyPatch.context() as patch:
        digest = build.source_digest()
        patch.setattr(contract, "SCHEMES", contract.SCHEMES[::-1])
        assert build.source_digest() != digest


def test_a_scheme_that_is_not_listed_is_refused_by_name():
    with pytest.raises(CapabilityError, match="'bdf 7', which no entry has: there are 'newmark'"):
        contract.scheme_named("bdf 7")
