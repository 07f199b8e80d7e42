"""The gallery: every example with a picture, the page that plays its run, and its text."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cached_property
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.cli import Script, examples
from mbd.view.camera import camera
from mbd.view.geometry import first_view
from mbd.view.instants import Instants
from mbd.view.page import html
from mbd.view.plots import drawing
from mbd.view.posture import draw_in_space
from mbd.view.scene import Scene, scene

__all__ = ["Example", "index", "read"]

SIZE, MARGIN = (320.0, 200.0), 14.0
"""Width and height of a picture, and its margin [points]."""

SHOWN, POSES, CURVE = 1.6, 9, 240
"""Longest stretch of a run that a picture shows [s], poses of a mechanism, points of a curve."""


FIGURES = {"steeper-slope": "branch.svg"}
"""Figures of docs/pictures that show what a study finds."""

TOPICS = {
    "Walkers and prostheses": "prosthetic-leg kneed-walker amputee-in-space compass-gait walker-in-space "
    "chapter-walker rimless-wheel simplest-walker-lagrangian torso-walker ankle-push-off "
    "push-off-wheel reflex-walker powered-knee mpk-swing-control raibert-hopper slip-runner spring-mass-walker",
    "Gait studies": "find-a-gait steeper-slope basin-picture compare-two-knees tune-a-knee-damper identify-a-shank "
    "from-the-laboratory",
    "Linkages and pendulums": "four-bar slider-crank pendulum double-pendulum long-pendulum lagrangian-double-pendulum",
    "Rolling, spinning and shaking": "bicycle rolling-coin billiard-ball spinning-top tippe-top tennis-racket "
    "shaken-block",
    "Extending mbd": "user-constraint user-integrator",
}
"""Names of examples by topic, in the order of the gallery."""


@dataclass(frozen=True)
class Example:
    """An example: its name in ``mbd run NAME`` and its file."""

    name: str
    path: Path

    @property
    def title(self) -> str:
        return self.name.replace("-", " ").capitalize()

    @property
    def text(self) -> str:
        return self.path.read_text(encoding="utf-8")

    @property
    def said(self) -> tuple[str, str]:
        """First line of its docstring, and the rest."""
        first, _, rest = (ast.get_docstring(ast.parse(self.text)) or "").partition("\n")
        return first, rest.strip()

    @cached_property
    def run(self) -> Any:
        return Script.load(self.name).run(None, {})

    @property
    def player(self) -> str:
        """The page that plays the run."""
        return html(self.run)

    @property
    def page(self) -> str:
        """Its page of the gallery in Markdown."""
        first, rest = self.said
        return (
            f"# {self.title}\n\n{first}\n\n"
            f'<iframe class="player" src="{self.name}-run.html" title="{escape(self.title)}, animated" '
            f'loading="lazy"></iframe>\n\n'
            f"[The animation on a page of its own]({self.name}-run.html), which `run.page(path)` writes.\n\n"
            f"{rest}\n\n```\nmbd run {self.name}\n```\n\n## The whole script\n\n```python\n{self.text}```\n"
        )

    @cached_property
    def solids(self) -> bytes | None:
        """Its solids halfway, seen as its page first sees them (PNG); None in the plane."""
        half = 0.5 * float(self.run.time[0] + self.run.time[-1])
        picture = scene(self.run, Instants(np.array([half]), np.ones(1, dtype=bool)))
        if not picture.spatial:
            return None
        paper = BytesIO()
        with drawing(None, 3.2, 2.0) as figure:
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
            corners = draw_in_space(axes, picture, camera(*first_view(picture)))
            middle, size = (corners.min(axis=0) + corners.max(axis=0)) / 2.0, np.ptp(corners, axis=0)
            reach = 0.58 * max(size[1], size[0] / 1.6)
            axes.set(
                aspect="equal", xlim=(middle[0] - 1.6 * reach, middle[0] + 1.6 * reach),
                ylim=(middle[1] - reach, middle[1] + reach),
            )  # fmt: skip
            axes.set_axis_off()
            figure.set_layout_engine("none")
            figure.savefig(paper, format="png", dpi=200, transparent=True)
        return paper.getvalue()

    @property
    def picture(self) -> str:
        """A drawing of the first moments of the run: poses of the mechanism, or curves of its coordinates (SVG).

        Of a spatial mechanism a picture of its solids halfway, and of a study its figure in docs.
        """
        if self.name in FIGURES:
            return f'<img class="thumbnail" src="../pictures/{FIGURES[self.name]}" alt="">'
        if self.solids is not None:
            return f'<img class="thumbnail" src="{self.name}.png" alt="">'
        run = self.run
        end = min(float(run.time[-1]), float(run.time[0]) + SHOWN)
        drawn = _poses(run, end) or _curves(run, end)
        return (
            f'<svg class="thumbnail" viewBox="0 0 {SIZE[0]:g} {SIZE[1]:g}" aria-hidden="true" focusable="false">'
            + "".join(drawn)
            + "</svg>"
        )


def read() -> list[Example]:
    """All examples by name."""
    return [Example(name, path) for name, path in examples().items()]


def index(known: list[Example]) -> str:
    """The page of all examples by topic."""
    by_name = {one.name: one for one in known}
    missing = set(by_name) ^ {name for names in TOPICS.values() for name in names.split()}
    assert not missing, f"TOPICS of the gallery and the examples differ in {sorted(missing)}"
    sections = "\n".join(
        f'## {topic}\n\n<div class="cards">\n{"".join(_card(by_name[name]) for name in names.split())}</div>\n'
        for topic, names in TOPICS.items()
    )
    return (
        "# Gallery\n\nEvery example comes with its animation and its script. "
        f"`mbd run NAME` runs it on your machine.\n\n{sections}"
    )


def _card(one: Example) -> str:
    return (
        f'<a class="card" href="{one.name}.html">{one.picture}<strong>{escape(one.title)}</strong>'
        f"<span>{escape(one.said[0])}</span></a>\n"
    )


def _fitted(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (…, 2) [m] on the paper, in one scale, y up."""
    flat = points.reshape(-1, 2)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = np.min((np.array(SIZE) - 2 * MARGIN) / np.maximum(high - low, 1e-9))
    return (points - (low + high) / 2) * (scale, -scale) + np.array(SIZE) / 2


def _soil(picture: Scene, points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The grounds under the points of a planar mechanism, on the paper."""
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    found = []
    for ground in picture.grounds:
        normal = ground.normal[:2]
        if abs(normal[1]) < 0.5:
            continue
        x = np.array([low[0], high[0]])
        line = np.column_stack([x, (ground.offset - normal[0] * x) / normal[1]])
        if np.all(np.abs(line[:, 1] - low[1]) < 0.2 * (high[1] - low[1])):
            found.append(_fitted(np.vstack([points.reshape(-1, 2), line]))[-2:])
    return found


def _poses(run: Any, end: float) -> list[str]:
    """The mechanism at equal intervals of time, the last one in full color."""
    whole = scene(run, 2)
    lines = [(body, members) for body, members in whole.segments if len(members) > 1]
    if not lines:
        return []
    count = max(2, round((run.time[-1] - run.time[0]) / (end - run.time[0]) * (POSES - 1)))
    if count > 400:
        return []
    every = scene(run, count)
    shown = np.searchsorted(every.instants.time, np.linspace(run.time[0], end, POSES) - 1e-9)
    poses = every.positions[shown][:, :, :2]
    used = sorted({point for _, members in lines for point in members})
    paper = np.zeros_like(poses)
    paper[:, used] = _fitted(poses[:, used])
    drawn = [f'<polyline class="soil" points="{_points(line)}"/>' for line in _soil(whole, poses[:, used])]
    for number, pose in enumerate(paper):
        kind = "" if number == len(paper) - 1 else " faint"
        for body, members in lines:
            side = next((word for word in ("left", "right") if word in body.split()), "neither")
            drawn.append(f'<polyline class="{side}{kind}" points="{_points(pose[list(members)])}"/>')
    return drawn


def _curves(run: Any, end: float) -> list[str]:
    """Coordinates over time, each over its own range."""
    instants = Instants(np.linspace(run.time[0], end, CURVE), np.ones(CURVE, dtype=bool))
    names = [name for name, _ in run.facts.coordinates][:3]
    values = instants.read(run, names)
    x = np.linspace(MARGIN, SIZE[0] - MARGIN, CURVE)
    drawn = []
    for kind, column in zip(("left", "right", "neither"), values.T, strict=False):
        span = np.ptp(column) or 1.0
        y = SIZE[1] - MARGIN - (column - column.min()) / span * (SIZE[1] - 2 * MARGIN)
        drawn.append(f'<polyline class="{kind}" points="{_points(np.column_stack([x, y]))}"/>')
    return drawn


def _points(points: NDArray[np.float64]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
