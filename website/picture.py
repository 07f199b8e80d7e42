"""The picture of the README: the walker with a prosthetic leg, as a drawing that walks (SVG, one file, no script).

Faint legs show the stride at equal intervals of time, the others move over them. Where motion is not wanted
(``prefers-reduced-motion``) the faint legs alone are shown; colors follow the reader's light or dark page.
"""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from mbd.cli import Script
from mbd.view.scene import upright
from mbd.view.style import SIDES

__all__ = ["draw"]

SIZE, SCALE, MARGIN = (780, 300), 262.0, 110.0
"""Width and height, points of the drawing a metre, and its margin at the left."""

STRIDES, FRAMES, FAINT = 3, 24, 11
"""Strides shown; pictures a stride of what moves, and of what stands."""

LEGS = {side: (f"{side} thigh.start", f"{side} thigh.end", f"{side} shank.end") for side in ("left", "right")}
WORDS = {"left": "sound leg", "right": "prosthetic leg: hydraulic knee, elastic ankle"}

STYLE = f"""
  text {{ font: 15px system-ui, sans-serif; fill: #444 }} .ground {{ stroke: #888; stroke-width: 2 }}
  .leg {{ fill: none; stroke-width: 9; stroke-linecap: round; stroke-linejoin: round }}
  .left {{ stroke: {SIDES["left"]} }} .right {{ stroke: {SIDES["right"]} }}
  .faint .leg {{ opacity: .2; stroke-width: 3 }}
  .hip {{ fill: #444 }} .joint {{ fill: #fff }}
  @media (prefers-color-scheme: dark) {{
    text {{ fill: #ccc }} .left {{ stroke: #56B4E9 }} .right {{ stroke: #F08A3C }} .hip {{ fill: #ccc }}
    .joint {{ fill: #111 }} .faint .leg {{ opacity: .35 }}
  }}
  @media (prefers-reduced-motion: reduce) {{ .moving {{ display: none }} .faint .leg {{ opacity: .5 }} }}
"""


def draw(path: Path) -> Path:
    """Run the example and write the drawing of its last strides."""
    run = Script.load("prosthetic-leg").run(None, {})
    strikes = [event.time for event in run.events if event.kind == "closed" and event.name == "left ball"]
    begin, end = strikes[-1 - STRIDES], strikes[-1]
    soles = {contact.name.split()[0]: contact.place for contact in run.facts.contacts if contact.name.endswith("ball")}
    turn = upright(run)

    def places(time: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Points of each leg (times, points, 2) on the page."""
        moments = run.at(time)
        legs = {
            side: np.stack([moments[name] @ turn.T for name in (*names, soles[side])], axis=1)[:, :, :2]
            for side, names in LEGS.items()
        }
        return {side: np.round((points - origin) * (SCALE, -SCALE) + corner, 1) for side, points in legs.items()}

    origin, corner = np.zeros(2), np.zeros(2)
    origin = places(np.array([begin]))["left"][0, -1] / (SCALE, -SCALE)
    corner = np.array([MARGIN, 232.0])
    moving = places(np.linspace(begin, end, STRIDES * FRAMES + 1))
    faint = places(np.linspace(begin, end, STRIDES * FAINT + 1))
    slope = turn @ (1.0, 0.0, 0.0)
    ground = [_pair((x, corner[1] - (x - MARGIN) * slope[1] / slope[0])) for x in (0, SIZE[0])]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE[0]} {SIZE[1]}" role="img">',
        "<title>A walker with a prosthetic leg goes down a slope</title>",
        "<style>" + "\n".join(line for line in STYLE.splitlines() if line) + "</style>",
        f'<polyline class="ground" points="{" ".join(ground)}"/>',
        '<g class="faint">',
        *(f'<polyline class="leg {side}" points="{_points(leg)}"/>' for side in LEGS for leg in faint[side]),
        '</g><g class="moving">',
        *_walk(moving, end - begin),
        "</g>",
    ]
    for row, (side, words) in enumerate(WORDS.items()):
        y = 268 + 22 * row
        lines.append(f'<line class="leg {side}" x1="{MARGIN}" x2="{MARGIN + 24}" y1="{y}" y2="{y}"/>')
        lines.append(f'<text x="{MARGIN + 38}" y="{y + 5}">{escape(words)}</text>')
    path.write_text("\n".join([*lines, "</svg>", ""]), encoding="utf-8")
    return path


def _walk(legs: dict[str, NDArray[np.float64]], seconds: float) -> list[str]:
    """Legs, joints and hip that move, over and over."""
    timing = f'dur="{seconds:.3f}s" repeatCount="indefinite"'

    def animated(name: str, values: list[str]) -> str:
        return f'<animate attributeName="{name}" {timing} values="{";".join(values)}"/>'

    def circle(word: str, radius: int, place: NDArray[np.float64]) -> str:
        (x, y), path = place[0], place.T
        return f'<circle class="{word}" r="{radius}" cx="{x:g}" cy="{y:g}">' + "".join(
            animated(name, [f"{value:g}" for value in along]) for name, along in zip(("cx", "cy"), path, strict=True)
        ) + "</circle>"  # fmt: skip

    lines = []
    for side, leg in legs.items():
        lines.append(f'<polyline class="leg {side}" points="{_points(leg[0])}">')
        lines.append(animated("points", [_points(one) for one in leg]) + "</polyline>")
        lines += [circle("joint", 3, leg[:, joint]) for joint in (1, 2)]
    return [*lines, circle("hip", 13, legs["left"][:, 0])]


def _points(points: NDArray[np.float64]) -> str:
    return " ".join(map(_pair, points))


def _pair(point: tuple[float, float] | NDArray[np.float64]) -> str:
    return f"{point[0]:g},{point[1]:g}"
