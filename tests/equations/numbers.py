"""Numbers from equations; see `mbd.testing.numbers`."""

from mbd.testing.numbers import at, block, derivative, inputs, moved, placed, solved

__all__ = ["at", "block", "derivative", "inputs", "moved", "placed", "solved"]
