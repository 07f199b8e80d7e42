"""Laws of every force: `mbd.testing.check_force`."""

import pytest

import mbd
from mbd.testing import check_force
from mbd.testing.measures import between, relates_bodies
from tests.instances import FORCES

every_force = pytest.mark.parametrize("factory", [factory for _, factory in FORCES], ids=[name for name, _ in FORCES])


@every_force
def test_every_force_keeps_the_laws(factory):
    verdict = check_force(factory)
    force, _, _ = between(factory)
    balanced = any(law.startswith("action = reaction") for law in verdict.laws)
    assert balanced == relates_bodies(force.mentions())
    assert balanced or isinstance(force, mbd.Applied | mbd.Potential)
