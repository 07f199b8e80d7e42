"""Sweeps by executors: processes keep what they made of a model, and no run takes another with it."""

import os
import pickle
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import mbd
from mbd.analysis import sweep_runs
from mbd.compile import mechanisms
from tests.simulation.mechanisms import G, ball

MADE = {"derived": 0, "compiled": 0}
"""What this process has derived and compiled since `count`."""


def count() -> None:
    """Count from now on what is derived and what is compiled in this process."""
    derive = mechanisms.derive

    def counted(model):
        MADE["derived"] += 1
        return derive(model)

    mechanisms.derive = counted
    try:
        from mbd.compile import llvm
    except ImportError:  # without llvmlite nothing is compiled
        return
    emit = llvm.emit_object

    def emitted(text, level=llvm.LEVEL):
        MADE["compiled"] += 1
        return emit(text, level)

    llvm.emit_object = emitted


def process(run):
    return float(os.getpid())


def derived(run):
    return float(MADE["derived"])


def compiled(run):
    return float(MADE["compiled"])


class Broken(Executor):
    """Its processes die after the first run."""

    def submit(self, function, /, *arguments):
        future = Future()
        if "worked" in self.__dict__:
            future.set_exception(BrokenExecutor("a process ended abruptly"))
        else:
            future.set_result(function(*arguments))
        self.worked = True
        return future


class Forgetful(dict):
    """What a process knows of the models that another one has sent."""

    def __setitem__(self, key, value):
        pass


class Posted(Executor):
    """Runs at once what it has sent through a pickle, as if to another process."""

    def __init__(self):
        self.most = 99

    def submit(self, function, /, *arguments):
        if len(self.__dict__.setdefault("sent", [])) == self.most:
            raise KeyboardInterrupt
        self.sent.append(pickle.dumps((function, arguments)))
        future = Future()
        try:
            there, given = pickle.loads(self.sent[-1])
            future.set_result(there(*given))
        except Exception as error:
            future.set_exception(error)
        return future


def swept(model, values, results=("fall.displacement",), **settings):
    start = settings.pop("start", None) or mbd.assemble(model, position={"fall.displacement": 1.0})
    fixed = {name: value for name, value in {"dt": 1e-2, "until": 0.1}.items() if name not in values}
    return mbd.sweep(model, values, start, results, **fixed | settings)


def forgotten(monkeypatch):
    """A process that nobody has sent anything to."""
    for store in ("_SENT", "_MODELS", "_RUNS"):
        monkeypatch.setattr(sweep_runs, store, type(getattr(sweep_runs, store))())


def test_workers_derive_a_model_once_and_compile_nothing():
    """The model is compiled here before; further sweeps of other settings find what the worker made of it."""
    model, kept = ball(restitution=0.5), {"process": process, "derived": derived, "compiled": compiled}
    swept(model, {"ball.mass": [2.0]}, until=0.6)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=count) as pool:
        first = swept(model, {"ball.mass": [2.0, 3.0, 4.0]}, kept, executor=pool, until=0.6)
        second = swept(model, {"ball.mass": [2.0, 5.0], "dt": [1e-2, 5e-3]}, kept, executor=pool, until=0.5)
    assert len({*first["process"], *second["process"], float(os.getpid())}) == 2
    assert {*first["derived"], *second["derived"]} == {1.0} and {*first["compiled"], *second["compiled"]} == {0.0}


def test_a_model_is_derived_once_for_all_that_is_sent(monkeypatch):
    forgotten(monkeypatch)
    monkeypatch.setattr(mechanisms, "_words", lambda model: None)  # the model that arrives is another one
    model, made = ball(), []
    monkeypatch.setattr(sweep_runs, "_SENT", Forgetful())
    monkeypatch.setattr(mechanisms, "derive", lambda model, derive=mechanisms.derive: made.append(1) or derive(model))
    values = {"ball.mass": [2.0, 3.0], "gravity.y": [-G, -2.0 * G]}
    sent = swept(model, values, executor=Posted())
    assert len(made) == 2 and sent["fall.displacement"].tolist() == swept(model, values)["fall.displacement"].tolist()


def test_a_model_that_changed_since_it_was_sent_is_not_taken_for_the_one_that_is_sent(monkeypatch):
    forgotten(monkeypatch)
    model = ball()
    parcel = sweep_runs.Runs(model, ("dt",), mbd.assemble(model), (), {}).parcel
    model.gravity = (0.0, -1.0, 0.0)
    there = sweep_runs._received(*parcel)
    assert there.model is not model and there.model.parameters["gravity.y"] == -9.81


def test_what_cannot_be_sent_is_named_before_anything_runs():
    model = ball()
    with (
        ProcessPoolExecutor(1) as pool,
        pytest.raises(mbd.ModelError, match="results of the sweep cannot be sent .* def in a module"),
    ):
        swept(model, {"ball.mass": [1.0]}, {"late": lambda run: 1.0}, executor=pool)
    with pytest.raises(mbd.ModelError, match="start of the sweep cannot be sent"):
        swept(model, {"ball.mass": [1.0]}, start=lambda p: mbd.assemble(model), executor=Posted())


def test_a_process_that_dies_costs_no_run_that_was_over():
    table = swept(ball(), {"ball.mass": [1.0, 2.0]}, executor=Broken(), backend="python")
    assert list(table["success"]) == [True, False] and table.complete
    assert "did not compute this run: BrokenExecutor: a process ended abruptly" in table["message"][1]


@pytest.mark.parametrize("executor", [None, Posted()])
def test_an_interrupted_sweep_keeps_what_is_computed(executor):
    def interrupting(run):
        if run.time[-1] == 0.2:
            raise KeyboardInterrupt
        return run.time[-1]

    results = {"end": interrupting} if executor is None else ["fall.displacement"]
    if executor is not None:
        executor.most = 1
    table = swept(ball(), {"until": [0.1, 0.2, 0.3]}, results, executor=executor, backend="python")
    assert not table.complete and list(table["success"]) == [True, False, False]
    assert list(table["message"][1:]) == ["not run: interrupted"] * 2 and len(table.to_dataframe()) == 3


def test_a_run_that_the_user_stops_ends_the_sweep():
    def stopping(time, state):
        raise KeyboardInterrupt

    table = swept(ball(), {"ball.mass": [1.0, 2.0]}, observers=[stopping], backend="python")
    assert not table.complete and "interrupted at t = " in table["message"][0]
    assert table["message"][1] == "not run: interrupted" and np.isnan(table["fall.displacement"]).all()
