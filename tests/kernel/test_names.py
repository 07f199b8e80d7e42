"""What the records of the kernel declare is what its functions and its arrays go by."""

import subprocess
import sys
from importlib import import_module

import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.kernel import build
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.records import TABLE, Kernel
from mbd.simulation.run.stepper import Stepper
from tests.simulation.mechanisms import ball


def test_every_declared_field_has_a_value_in_a_run():
    mechanism = mechanism_of(ball())
    manager = ActiveSetManager(mechanism.equations)
    K = Stepper(mechanism, manager, mbd.HHT(), mechanism.parameters(), 1e-3, {"capacity": 8}).kernel
    assert {*TABLE.kinds} - {*TABLE.places} <= {*vars(K)}
    assert all(len(getattr(K, array)) > index for array, index in TABLE.places.values())
    assert len(set(TABLE.places.values())) == len(TABLE.places)


def test_a_number_is_read_and_written_at_its_place():
    K = Kernel(clock=[0.0] * TABLE.length_of("clock"))
    places = {name: index for name, (array, index) in TABLE.places.items() if array == "clock"}
    assert "time" in places
    for name, index in places.items():
        setattr(K, name, 1.0 + index)
        assert K.clock[index] == getattr(K, name) == 1.0 + index


@pytest.mark.slow
def test_a_wrong_name_of_a_field_is_an_error_for_mypy(tmp_path):
    script = tmp_path / "wrong.py"
    script.write_text("from mbd.kernel.records import Kernel\n\ndef f(K: Kernel) -> int:\n    return K.n_rws\n")
    told = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(script)], capture_output=True, text=True, timeout=600
    )
    assert '"Kernel" has no attribute "n_rws"' in told.stdout


def test_every_function_that_is_compiled_apart_exists():
    for name in build.APART:
        module, _, function = name.rpartition(".")
        assert callable(getattr(import_module(f"mbd.kernel.{module}"), function)), name
