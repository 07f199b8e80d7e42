"""Reports of gaits: numbers by side, curves over the stride, energy by cause, runs side by side."""

from mbd.analysis.gait_report.report import GaitReport, gait_report

__all__ = ["GaitReport", "gait_report"]
