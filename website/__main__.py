"""``python -m website [build | serve | picture]``: the documentation in ``build/site``, and the README's picture."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    """Build the site, every warning an error; or draw the picture."""
    parser = argparse.ArgumentParser(prog="python -m website", description="The documentation as a site.")
    parser.add_argument(
        "what", nargs="?", default="build", choices=("build", "serve", "picture"),
        help="build it in build/site; show it in a browser while it changes; or draw the README's picture again",
    )  # fmt: skip
    if parser.parse_args().what == "picture":
        from website.picture import draw

        print(f"wrote {draw(ROOT / 'docs' / 'pictures' / 'prosthetic-leg.svg')}")
        return 0
    return mkdocs(parser.parse_args().what)


def mkdocs(what: str) -> int:
    """Run mkdocs with this repository first on the path, since that is what it documents."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    environment = {**os.environ, "PYTHONPATH": path, "NO_MKDOCS_2_WARNING": "1"}
    options = ["--strict", "--clean"] if what == "build" else []
    command = [sys.executable, "-m", "mkdocs", what, *options]
    return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
