"""Laws of every constraint: `mbd.testing.check_constraint`."""

import pytest

from mbd.testing import check_constraint
from tests.instances import CONSTRAINTS


@pytest.mark.parametrize("factory", [make for _, make in CONSTRAINTS], ids=[name for name, _ in CONSTRAINTS])
def test_every_constraint_keeps_the_laws(factory):
    verdict = check_constraint(factory, postures=1)
    assert "energy books close" in verdict.laws, "no run was made"
    assert verdict.notes == ()
