"""Reports of gaits: numbers by side, curves over the stride, energy by cause, runs side by side."""

from mbd.analysis.gait_report.band import NormativeBand, read_band
from mbd.analysis.gait_report.report import GaitReport, gait_report

__all__ = ["GaitReport", "NormativeBand", "gait_report", "read_band"]
