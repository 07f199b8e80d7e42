"""``python -m benchmarks [run | compare | baseline | peers | growth | house | GROUP]``: see README.md here."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks import growth, house
from benchmarks.compare import comparison, regressions
from benchmarks.figures import NOISY, table
from benchmarks.handwritten import compiler
from benchmarks.run import BASELINE, GROUPS, RESULTS, Record, measure

WHAT = ("run", "compare", "baseline", "peers", "growth", "house")
DOCS = Path(__file__).parents[1] / "docs"


def main() -> int:
    """Measure and print; 1 if a comparison finds a figure more than 15 % worse."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="What mbd costs, measured.")
    parser.add_argument(
        "what", nargs="?", default="run", choices=(*WHAT, *GROUPS), metavar="WHAT",
        help=f"{', '.join(WHAT)}, or a group of figures alone: print the figures; compare them with the baseline; make "
        "them the baseline; compare with other systems; write the page on how cost grows with bodies; or count lines, "
        "constants and imports of the source",
    )  # fmt: skip
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=GROUPS, metavar="GROUP", help=", ".join(GROUPS))
    parser.add_argument("--repeats", type=int, default=7, help="of every measurement, minima count (default 7)")
    parser.add_argument("--json", nargs="?", const=RESULTS, type=Path, metavar="FILE", help="also write a record")
    parser.add_argument(
        "--scenes", default="", metavar="S1,S4d", help="of 'peers': some only, which leaves the docs alone"
    )
    parser.add_argument("--largest", type=int, default=growth.LARGEST, help="of 'growth': bodies at most")
    options = parser.parse_args()
    if options.what in GROUPS:
        options.what, options.only = "run", [options.what]
    if options.what == "peers":
        return _peers(parser, [word for word in options.scenes.split(",") if word], options.json)
    if options.what == "growth":
        found = growth.measure(options.largest)
        growth.write(found, DOCS)
        print(growth.page(found))
        return 0
    if options.what == "house":
        print(house.report(house.measure()))
        return 0
    if options.what == "compare" and not BASELINE.exists():
        parser.error(f"there is no {BASELINE.name} to compare with; make one with 'python -m benchmarks baseline'")
    if compiler() is None:
        print("no C compiler (cc, gcc, clang) was found: figures stand without their ratio to hand-written C")
    record = measure(options.repeats, options.only)
    if options.json:
        record.save(options.json)
    print(*(f"{key}: {value}" for key, value in record.machine.items()), sep=", ")
    _warn_if_noisy(record)
    if options.what == "compare":
        stored = Record.load(BASELINE)
        print(comparison(record, stored))
        return 1 if regressions(record, stored) else 0
    print(table(record.figures))
    if options.what == "baseline":
        record.save(BASELINE)
    return 0


def _peers(parser: argparse.ArgumentParser, words: list[str], json: Path | None) -> int:
    """Beside other systems: print the tables; a run of all scenes writes the page of the documentation."""
    from benchmarks.peers.command import compare
    from benchmarks.peers.report import page, write
    from benchmarks.peers.scenes import chosen

    try:
        chosen(words)
    except ValueError as problem:
        parser.error(str(problem))
    comparison = compare(words, json)
    if json:
        comparison.save(json)
    print(page(comparison))
    if not words:
        write(comparison, DOCS)
    return 0


def _warn_if_noisy(record: Record) -> None:
    noisy = sum(figure.spread > NOISY for figure in record.figures)
    if noisy:
        total = len(record.figures)
        print(f"the machine was busy: {noisy} of {total} figures have a median more than 20 % above their minimum")


if __name__ == "__main__":
    sys.exit(main())
