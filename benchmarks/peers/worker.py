"""Scenes in one system, in a process of its own: ``python -m benchmarks.peers.worker SYSTEM SCENE …``.

Prints a line of JSON for each setting, and one for each scene that is done.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from importlib import import_module

from benchmarks.peers.race import measured
from benchmarks.peers.scenes import SCENES

MARK, DONE = "RESULT ", "DONE "
"""What our lines begin with: libraries print too."""


def main(system: str, *names: str) -> None:
    """Measure all settings."""
    module = import_module(f"benchmarks.peers.systems.{system}")
    for name in names:
        for result in measured(SCENES[name], system, module.attempts(SCENES[name])):
            print("\n" + MARK + json.dumps(asdict(result)), flush=True)
        print("\n" + DONE + name, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
