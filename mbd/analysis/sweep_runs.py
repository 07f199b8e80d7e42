"""The runs of a sweep: one after the other, or by an executor whose processes keep the models that they were sent.

Code belongs to a model, the object. A process that unpickled the model with every task would derive its equations and
fetch its code with every task too, which takes longer than most runs. So tasks carry pickles with their hashes, and
what a process has once made of a hash it uses again; a process forked from one that has the model itself uses that.
"""

import io
import pickle
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from functools import cached_property
from hashlib import sha256
from typing import Any, NamedTuple, TypeAlias
from weakref import WeakValueDictionary

from mbd.dataclass import dataclass
from mbd.equations.derivation import FrontDoor
from mbd.errors import MbdError, ModelError, SimulationError
from mbd.results.tables import last_number
from mbd.results.trajectory import Trajectory
from mbd.simulation.interrupted import stopped
from mbd.simulation.run.user_calls import call_user
from mbd.simulation.simulate import simulate
from mbd.state import State
from mbd.topology.description import Description

SETTINGS = ("integrator", "dt", "tol", "until", "contact", "impact", "locate", "rest_speed")
"""Arguments of `simulate` that may take several values, beside the model's parameters."""

NOT_RUN = "not run: interrupted"


Results: TypeAlias = Sequence[str] | Mapping[str, Callable[[Trajectory], float]]
"""What is kept of each run: names of quantities, at its end, or functions of the run by title."""


class Row(NamedTuple):
    """What came of one run; `stopped` where the user ended it."""

    results: list[float]
    success: bool
    message: str
    stopped: bool = False


@dataclass(frozen=True, eq=False)
class Runs:
    """What the runs of a sweep have in common: called with the values of one, it makes that run.

    names : what varies; settings : the further arguments of `simulate`
    """

    model: Any
    names: tuple[str, ...]
    start: State | Callable[[Mapping[str, float]], State]
    results: Results
    settings: Mapping[str, Any]

    def __call__(self, case: tuple[Any, ...]) -> Row:
        """One run; its row says whatever goes wrong in it."""
        try:
            return self._row(case)
        except MbdError as error:
            return self.failed(str(error))
        except Exception as error:  # of a scheme or a part of the user's own, say: other runs still count
            return self.failed(f"{type(error).__name__}: {error}")

    def failed(self, message: str, stopped: bool = False) -> Row:
        """The row of a run without results."""
        return Row([float("nan")] * len(self.results), False, message, stopped)

    def _row(self, case: tuple[Any, ...]) -> Row:
        given = dict(zip(self.names, case, strict=True))
        own = {name: value for name, value in given.items() if name in SETTINGS}
        changed = {name: value for name, value in given.items() if name not in SETTINGS}
        parameters = {**(self.settings.get("parameters") or {}), **changed}
        start = call_user(self._calling(given), self.start, parameters) if callable(self.start) else self.start
        own |= {"parameters": parameters, "on_failure": "return"}
        run = simulate(self.model, start, **{**self.settings, **own})
        if not run.success:
            return self.failed(run.message, stopped(run))
        if not isinstance(self.results, Mapping):
            return Row([last_number(run, name) for name in self.results], True, run.message)
        found, missing = [], []
        for title, function in self.results.items():
            try:
                found.append(call_user(f"the function for {title!r}", _number, function, run))
            except SimulationError as error:  # the event that it looks for did not come, say: other runs still count
                found.append(float("nan"))
                missing.append(str(error))
        return Row(found, not missing, "; ".join(missing) or run.message)

    def _calling(self, given: Mapping[str, Any]) -> str:
        """Which function makes the start, and with which values of the sweep."""
        values = ", ".join(f"{name} = {cell(value)}" for name, value in given.items())
        return f"start={getattr(self.start, '__qualname__', None) or repr(self.start)} at {values}"

    # to other processes -------------------------------------------------------------------------------------------
    def __reduce__(self) -> tuple[Any, ...]:
        return _received, self.parcel

    @cached_property
    def parcel(self) -> tuple[str, bytes, dict[str, bytes]]:
        """(hash, pickle of all but the models, pickles of the models by hash), made once for all runs.

        Raises
        ------
        ModelError
            for what cannot be sent to another process.
        """
        models: dict[str, bytes] = {}
        parts = (self.model, self.names, self.start, self.results, dict(self.settings))
        try:
            data = _pickled(parts, models)
        except Exception as error:  # a function without a name, an object of the user's: pickle raises what it likes
            raise ModelError(_unsendable(self, error)) from error
        return sha256(data).hexdigest(), data, models


def _number(function: Callable[[Trajectory], float], run: Trajectory) -> float:
    return float(function(run))


def cell(value: Any) -> str:
    """A value in a table of text."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _unsendable(runs: Runs, error: Exception) -> str:
    """Which argument of the sweep cannot be pickled, and what to try."""
    parts = {"model": runs.model, "start": runs.start, "results": runs.results, **runs.settings}
    guilty = next((name for name, part in parts.items() if not _can_be_sent(part)), "model")
    return (
        f"{guilty} of the sweep cannot be sent to another process ({error}): a lambda or a function inside a function "
        "has no name to be found by there; write it with def in a module, or take "
        "concurrent.futures.ThreadPoolExecutor(), whose threads run machine code side by side"
    )


def _can_be_sent(part: Any) -> bool:
    try:
        _pickled(part, {})
    except Exception:  # as above
        return False
    return True


# models by the hash of their pickle -------------------------------------------------------------------------------
_SENT: WeakValueDictionary[str, Any] = WeakValueDictionary()
"""Models that this process, or the one that it was forked from, has sent, with all that is known of them."""
_MODELS: OrderedDict[str, Any] = OrderedDict()
"""Models that this process was sent."""
_RUNS: OrderedDict[str, Runs] = OrderedDict()
"""What this process was sent beside them."""


def _pickled(part: Any, models: dict[str, bytes]) -> bytes:
    """A pickle in which models are named by their hashes; their own pickles go into `models`."""
    known: dict[int, str] = {}

    def name_of(item: Any) -> str | None:
        if isinstance(item, type) or not isinstance(item, Description | FrontDoor):
            return None
        if id(item) not in known:
            data = pickle.dumps(item)
            known[id(item)] = digest = sha256(data).hexdigest()
            models[digest] = data
            _SENT[digest] = item
        return known[id(item)]

    file = io.BytesIO()
    pickler = pickle.Pickler(file, protocol=pickle.HIGHEST_PROTOCOL)
    pickler.persistent_id = name_of  # type: ignore[method-assign]
    pickler.dump(part)
    return file.getvalue()


def _received(digest: str, data: bytes, models: Mapping[str, bytes]) -> Runs:
    """The runs of a parcel: as they were made of an earlier one of the same hash."""
    if digest not in _RUNS:
        unpickler = pickle.Unpickler(io.BytesIO(data))
        unpickler.persistent_load = lambda name: _model(name, models[name])  # type: ignore[method-assign]
        _keep(_RUNS, digest, Runs(*unpickler.load()))
    return _RUNS[digest]


def _model(digest: str, data: bytes) -> Any:
    """The model of a hash: received before, inherited by fork and unchanged since it was sent, or read now."""
    if digest not in _MODELS:
        model = _SENT.get(digest)
        unchanged = model is not None and sha256(pickle.dumps(model)).hexdigest() == digest
        _keep(_MODELS, digest, model if unchanged else pickle.loads(data))
    return _MODELS[digest]


def _keep(store: OrderedDict[str, Any], digest: str, value: Any) -> None:
    store[digest] = value
    while len(store) > 16:
        store.popitem(last=False)


# all runs ---------------------------------------------------------------------------------------------------------
def rows_of(
    runs: Runs, cases: Sequence[tuple[Any, ...]], executor: Executor | None, report: Callable[[int, Row], None]
) -> tuple[list[Row], bool]:
    """What came of every case, in their order, and whether all were run: the user may stop that.

    report : called with the number of a case and its row as soon as that is there
    """
    if executor is None:
        return _in_turn(runs, cases, report)
    if isinstance(executor, ProcessPoolExecutor):
        _ = runs.parcel  # what cannot be sent is named before anything runs
    places: dict[Future[Row], int] = {}
    complete = True
    try:
        for place, case in enumerate(cases):
            places[_submitted(executor, runs, case)] = place
        for future in as_completed(places):
            if not future.cancelled() and future.exception() is None:
                report(places[future], future.result())
    except KeyboardInterrupt:
        complete = False
    finally:
        for future in places:
            future.cancel()
    rows = [_row_of(future, runs) for future in places]
    rows += [runs.failed(NOT_RUN)] * (len(cases) - len(rows))
    return rows, complete and not any(row.stopped for row in rows)


def _submitted(executor: Executor, runs: Runs, case: tuple[Any, ...]) -> Future[Row]:
    try:
        return executor.submit(runs, case)
    except Exception:  # raised again
        _ = runs.parcel  # an executor has its own words for what cannot be sent
        raise


def _in_turn(
    runs: Runs, cases: Sequence[tuple[Any, ...]], report: Callable[[int, Row], None]
) -> tuple[list[Row], bool]:
    rows: list[Row] = []
    try:
        for place, case in enumerate(cases):
            rows.append(runs(case))
            if rows[-1].stopped:
                break
            report(place, rows[-1])
    except KeyboardInterrupt:
        pass
    complete = len(rows) == len(cases) and not (rows and rows[-1].stopped)
    return rows + [runs.failed(NOT_RUN)] * (len(cases) - len(rows)), complete


def _row_of(future: Future[Row], runs: Runs) -> Row:
    """The row of a run that an executor was given; an executor that broke has failed this run alone."""
    if future.cancelled() or not future.done():
        return runs.failed(NOT_RUN)
    error = future.exception()
    if isinstance(error, ModelError):
        raise error  # nothing can be sent
    if error is not None:
        return runs.failed(f"the executor did not compute this run: {type(error).__name__}: {error}")
    return future.result()
