"""Laws of every scheme in runs of `mbd.simulate`: `mbd.testing.check_scheme`."""

import pytest

from mbd.testing import check_scheme
from tests.instances import INTEGRATORS

SCHEMES = [pytest.param(each, marks=[] if each.compiled_scheme else pytest.mark.slow) for each in INTEGRATORS]


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_every_scheme_keeps_the_laws_in_runs(scheme):
    verdict = check_scheme(scheme)
    refused = 2 * bool(scheme.check(1))
    assert verdict.laws["order as promised: within 0.75" if scheme.order() > 5 else "order as promised: within 0.15"]
    assert verdict.laws["restart: a run that is cut in two is the same to the bit"] == (7 if refused else 28)
    assert verdict.laws["transaction: a step leaves the accepted state"] > 10
    assert len(verdict.notes) == refused
