"""Sweeps on a real cluster of Dask, on this machine."""

import os
from pathlib import Path

import numpy as np
import pytest

import mbd
from tests.analysis.test_sweep_executors import compiled, count, derived, process, swept
from tests.simulation.mechanisms import ball

pytestmark = pytest.mark.slow


@pytest.fixture
def client(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("MBD_TEST_MARK", str(tmp_path / "died"))
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path)
        ) as cluster,
        distributed.Client(cluster) as found,
    ):
        yield found


def fall_once(run):
    """The place at the end; the process that comes first dies."""
    if run.final.parameters["ball.mass"] == 3.0 and not (mark := Path(os.environ["MBD_TEST_MARK"])).exists():
        mark.touch()
        os._exit(1)
    return run["fall.displacement"][-1]


def test_workers_derive_once_and_compile_nothing(client):
    model, kept = ball(restitution=0.5), {"process": process, "derived": derived, "compiled": compiled}
    swept(model, {"ball.mass": [2.0]})
    client.run(count)
    table = swept(model, {"ball.mass": np.linspace(1.0, 2.0, 40)}, kept, executor=client.get_executor())
    assert table["success"].all() and len(set(table["process"])) == 2
    assert set(table["derived"]) == {1.0} and set(table["compiled"]) == {0.0}


def test_a_worker_that_dies_costs_no_finished_run(client, tmp_path):
    model, values = ball(), {"ball.mass": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}
    file = tmp_path / "falls.jsonl"
    first = swept(model, values, {"place": fall_once}, executor=client.get_executor(), file=file)
    assert (tmp_path / "died").exists(), first
    assert first["success"].sum() >= 5
    whole = swept(model, values, {"place": fall_once}, file=file)
    assert whole["success"].all()
    np.testing.assert_array_equal(whole["place"], swept(model, values, {"place": fall_once})["place"])


def test_what_has_no_name_is_refused_before_anything_runs(client):
    with pytest.raises(mbd.ModelError, match="cannot be sent to another process"):
        swept(ball(), {"ball.mass": [1.0]}, {"place": lambda run: 0.0}, executor=client.get_executor())
