"""Running a model: step, judge, accept or switch, observe."""

from mbd.simulation.replay import replay
from mbd.simulation.simulate import simulate

__all__ = ["replay", "simulate"]
