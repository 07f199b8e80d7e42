"""Scripts in Python processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys


def output_of(script: str) -> str:
    """What a script prints in a fresh process that finds the same packages; they have bytecode, as if installed."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-c", script]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
