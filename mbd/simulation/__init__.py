"""Running a model: step, judge, accept or switch, observe."""

from mbd.simulation.simulate import simulate

__all__ = ["simulate"]
