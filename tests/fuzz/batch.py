"""Many fuzzed scenes in processes of their own, and what came of them."""

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from tests.fuzz.scenes import STRUCTURES
from tests.fuzz.structures import DRIVEN, SPACE

COMMAND = [sys.executable, "-m", "tests.fuzz", "--worker"]
"""A worker, begun in the checkout."""
CHECKOUT = Path(__file__).parents[2]
LIMIT = 60.0
"""Wall time after which a scene counts as one without end [s]."""


def in_order(numbers: Iterable[int], workers: int, place: int, structures: int = STRUCTURES) -> list[int]:
    """The scenes of one worker, those of one mechanism together."""
    return sorted((n for n in numbers if n % structures % workers == place), key=lambda n: (n % structures, n))


def run_batch(
    numbers: Sequence[int],
    limit: float = LIMIT,
    hear: Callable[[dict[str, Any]], None] | None = None,
    command: Sequence[str] | None = None,
) -> list[dict[str, Any]]:
    """Verdicts of scenes, made in another process; one that dies or takes longer than `limit` seconds is 'bad'.

    Parameters
    ----------
    hear : called with each verdict
    command : of a worker, to which numbers come as one list and which writes verdicts line by line; None: `COMMAND`
    """
    left, found = list(numbers), []
    while left:
        done = _until_lost(left, limit, hear, command or COMMAND)
        found += done
        left = left[len(done) :]
    return found


def _until_lost(
    numbers: Sequence[int], limit: float, hear: Callable[[dict[str, Any]], None] | None, command: Sequence[str]
) -> list[dict[str, Any]]:
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=dict(os.environ),
        cwd=CHECKOUT,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    lines: Queue[str] = Queue()
    stream = process.stdout

    def listen() -> None:
        for line in stream:
            lines.put(line)
        lines.put("")

    threading.Thread(target=listen, daemon=True).start()
    process.stdin.write(json.dumps(list(numbers)))
    process.stdin.close()
    found: list[dict[str, Any]] = []
    for number in numbers:
        try:
            line = lines.get(timeout=limit)
            why = "" if line else f"the interpreter died with code {process.wait()}"
        except Empty:
            why = f"no end after {limit:g} s"
        if why:
            process.kill()
        lost = {"number": number, "kind": "bad", "message": why, "reasons": [why], "scene": "", "seconds": limit}
        found.append(lost if why else json.loads(line))
        if hear is not None:
            hear(found[-1])
        if why:
            break
    process.wait()
    return found


def summary(verdicts: Iterable[dict[str, Any]]) -> str:
    """Counts, the errors by their class, and the bad ones with their numbers."""
    told = list(verdicts)
    kinds = Counter(v["kind"] for v in told)
    seconds = sorted(v["seconds"] for v in told)
    lines = [f"{len(told)} scenes: " + ", ".join(f"{kinds[kind]} {kind}" for kind in ("ok", "error", "bad"))]
    if seconds:
        lines.append(
            f"median {1e3 * seconds[len(seconds) // 2]:.0f} ms, mean {1e3 * sum(seconds) / len(seconds):.0f} ms a scene"
        )
    classes = Counter(v.get("class", "?") for v in told if v["kind"] == "error")
    lines += [f"  {count:6d} {name}" for name, count in classes.most_common()]
    laws = Counter(reason.split(":")[0] for v in told if v["kind"] == "bad" for reason in v["reasons"][:1])
    lines += [f"  bad {count:4d} {law}" for law, count in laws.most_common()]
    for v in [v for v in told if v["kind"] == "bad"][:200]:
        lines.append(f"{v['scene'] or v['number']}\n      " + "\n      ".join(v["reasons"][:4]))
    return "\n".join(lines)


def _work(structures: int, forms: bool) -> None:
    """A worker: numbers come as one list, verdicts go out line by line."""
    from tests.fuzz.verdict import verdict

    for number in json.load(sys.stdin):
        print(json.dumps(verdict(number, structures, forms)), flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--scenes", default="0:200", help="numbers of scenes, first:end")
    parser.add_argument("--space", action="store_true", help="scenes with joints that turn freely")
    parser.add_argument("--driven", action="store_true", help="driven and held mechanisms, exact zeros, curved ground")
    parser.add_argument("--structures", type=int, default=STRUCTURES, help="how many mechanisms, shared by numbers")
    parser.add_argument("--workers", type=int, default=1, help="processes side by side")
    parser.add_argument("--seconds", type=float, default=0.0, help="wall time after which no scene is begun")
    parser.add_argument("--out", default="", help="a file for all verdicts, one a line")
    parser.add_argument("--forms", action="store_true", help="compare each scene with another form of it alone")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.worker:
        _work(given.structures, given.forms)
        return
    base, above = (DRIVEN, None) if given.driven else (SPACE, DRIVEN) if given.space else (0, SPACE)
    first, end = (int(part) + base for part in given.scenes.split(":"))
    if above is not None and end > above:
        parser.error(f"--scenes ends at {end - base}, expected at most {above - base}: the rest are others")
    began, lock, found = time.perf_counter(), threading.Lock(), list[dict[str, Any]]()

    def hear(told: dict[str, Any]) -> None:
        with lock:
            found.append(told)
            if given.out:
                with open(given.out, "a", encoding="utf-8") as file:
                    file.write(json.dumps(told) + "\n")

    def serve(place: int) -> None:
        mine = in_order(range(first, end), given.workers, place, given.structures)
        for k in range(0, len(mine), 250):
            if given.seconds and time.perf_counter() - began > given.seconds:
                return
            run_batch(mine[k : k + 250], hear=hear, command=command)

    command = [*COMMAND, f"--structures={given.structures}", *["--forms"] * given.forms]
    threads = [threading.Thread(target=serve, args=(place,)) for place in range(given.workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(summary(sorted(found, key=lambda told: int(told["number"]))))
