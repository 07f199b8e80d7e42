"""Plots as SVG that follow the light or dark page of their reader."""

from pathlib import Path
from typing import Any

from mbd.view.style import DARK


def save(figure: Any, path: Path) -> None:
    """Write a figure without paper, in ink that is light where the reader's page is dark."""
    figure.savefig(path, format="svg", transparent=True, metadata={"Date": None})
    picture = path.read_text(encoding="utf-8")
    rules = "".join(
        f'[style*="{what}: {light.lower()}"]{{{what}:{dark.lower()} !important}}'
        for light, dark in DARK.items()
        for what in ("fill", "stroke")
    )
    path.write_text(
        picture.replace("</style>", f"@media (prefers-color-scheme: dark){{{rules}}}</style>", 1), encoding="utf-8"
    )
