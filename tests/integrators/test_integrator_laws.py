"""Laws of every integrator, on systems of a few lines: `mbd.testing.check_integrator`."""

import pytest

import mbd
from mbd.testing import check_integrator
from tests.instances import INTEGRATORS
from tests.integrators.own import ProjectedMidpoint, SemiImplicitEuler

MORE = mbd.Newmark(beta=0.31, gamma=0.6), mbd.GeneralizedAlpha(rho_inf=0.0), mbd.HHT(alpha=0.05, formulation="index3")
EACH = [pytest.param(scheme, marks=pytest.mark.slow) if scheme in MORE else scheme for scheme in INTEGRATORS]


@pytest.mark.parametrize("scheme", [*EACH, SemiImplicitEuler(), ProjectedMidpoint()], ids=repr)
def test_every_integrator_keeps_the_laws(scheme):
    verdict = check_integrator(scheme, halvings=4 if scheme.order() == 1 else 3)
    refused = scheme.check(1)
    if scheme.order() > 5:  # its errors are round-off here: test_runge_kutta measures the order
        assert len(verdict.notes) == 8 and all("every error is below" in note for note in verdict.notes)
        return
    assert verdict.laws["order: as promised, within 0.15"] == (3 if refused else 4)
    assert len(verdict.notes) == bool(refused)
