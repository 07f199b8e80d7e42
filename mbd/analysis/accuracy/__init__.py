"""What accuracy costs: schemes and steps measured against a reference of another kind."""

from mbd.analysis.accuracy.lab import accuracy
from mbd.analysis.accuracy.points import Point
from mbd.analysis.accuracy.published import Known
from mbd.analysis.accuracy.result import Accuracy

__all__ = ["Accuracy", "Known", "Point", "accuracy"]
