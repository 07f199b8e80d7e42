"""Work–precision pictures: error against processor time, one panel per scene, one picture per group of scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.peers.command import SYSTEMS, Comparison
from benchmarks.peers.race import Result
from benchmarks.peers.scenes import SCENES

COLORS = dict(zip(
    (system.name for system in SYSTEMS),
    ("#c0392b", "#555555", "#999999", "#2c6fbb", "#e08e0b", "#2a9d5c", "#8e5bb5", "#8a5a2b"), strict=True,
))  # fmt: skip
LARGEST = 10.0
"""Errors above are not drawn."""


def draw(comparison: Comparison, group: str, title: str, path: Path) -> None:
    """The picture of a group, where it has results."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    names = [name for name in SCENES if name.startswith(group) and any(r.scene == name for r in comparison.results)]
    if not names:
        return
    width = min(len(names), 3)
    figure, axes = plt.subplots(
        -(-len(names) // width), width, figsize=(4.2 * width, 3.6 * -(-len(names) // width)), squeeze=False
    )
    for ax in axes.flat[len(names) :]:
        ax.set_axis_off()
    for ax, name in zip(axes.flat, names, strict=False):
        _panel(ax, [r for r in comparison.results if r.scene == name])
        ax.set_title(f"{name}: {SCENES[name].title}", fontsize=8)
    handles = {label: line for ax in axes.flat for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    columns = 5 if width > 1 else 3
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=columns, fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=10)
    figure.tight_layout(rect=(0.0, 0.06 if len(names) > 3 else 0.12 if width > 1 else 0.18, 1.0, 1.0))
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)


def _panel(ax: Any, results: list[Result]) -> None:
    """Every setting a dot; the fastest ones for their error joined."""
    for system, color in COLORS.items():
        ways = (
            [("seconds", "-", system), ("whole", ":", "mbd, call")] if system == "mbd" else [("seconds", "-", system)]
        )
        for field, line, label in ways:
            spent = {(r.error, getattr(r, field)) for r in results if r.system == system and r.error is not None}
            points = sorted((t, max(e, 1e-14)) for e, t in spent if t is not None and e < LARGEST)
            if not points:
                continue
            front = [p for k, p in enumerate(points) if all(p[1] < q[1] for q in points[:k])]
            if line == "-":
                ax.plot(*zip(*points, strict=True), ".", color=color, markersize=3, alpha=0.4)
            ax.plot(*zip(*front, strict=True), line, color=color, marker="o", markersize=3, linewidth=1.2, label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("processor time [s]", fontsize=8)
    ax.set_ylabel("largest error", fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.3, linewidth=0.5)
