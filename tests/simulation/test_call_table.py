"""What the compiled kernel is called with."""

import struct
from types import SimpleNamespace

import numpy as np

from mbd.kernel.records import TABLE, Kernel
from mbd.simulation.run.call_table import ARRAYS, PLACES, CallTable


def filled():
    values = {name: k for k, name in enumerate(TABLE.integers)}
    values |= {name: 0.1 * k for k, name in enumerate(TABLE.reals)}
    values |= {name: np.zeros(3) for name in TABLE.real_arrays}
    values |= {name: np.zeros(3, dtype=np.int64) for name in TABLE.integer_arrays}
    return Kernel(**values)


def words(table):
    return table._words


def test_the_table_holds_numbers_as_bits_and_arrays_as_addresses():
    values = filled()
    table = words(CallTable([SimpleNamespace(address=77), None], values))
    assert table[PLACES["n_q"]] == values.n_q
    assert struct.pack("q", table[PLACES["dt"]]) == struct.pack("d", values.dt)
    assert all(table[PLACES[name]] == vars(values)[name].ctypes.data for name in ARRAYS)


def test_an_array_that_takes_the_place_of_another_is_found():
    """Also one that took it after its address was noted, before the table was made."""
    values = filled()
    given = {"q": (values.q, values.q.ctypes.data), "y": (np.zeros(3), 123456)}
    arrays, addresses = zip(*[given.get(name, (None, 0)) for name in ARRAYS], strict=True)
    table = CallTable([], values, (arrays, np.array(addresses)))
    assert words(table)[PLACES["y"]] == values.y.ctypes.data
    values.mode_key = np.zeros(9, dtype=np.int64)
    table.fill([], values)
    assert words(table)[PLACES["mode_key"]] == values.mode_key.ctypes.data
    assert words(table)[PLACES["q"]] == values.q.ctypes.data


def test_functions_that_are_added_are_found():
    values = filled()
    table = CallTable([SimpleNamespace(address=5)], values)
    before = table._code
    table.fill([SimpleNamespace(address=5), SimpleNamespace(address=9)], values)
    assert table._code.tolist() == [5, 9]
    assert table._code is not before
    assert words(table)[PLACES["code"]] == table._code.ctypes.data
