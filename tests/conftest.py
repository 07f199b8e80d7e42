"""Settings of every test: seeded random examples, no window, interrupts that arrive, few passes of the collector."""

import gc
import os
import signal

os.environ.setdefault("MPLBACKEND", "Agg")

import pytest
from hypothesis import HealthCheck, settings

# where SIGINT is ignored (nohup, jobs in the background), it is not so for the tests and the processes they start
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "ci",
    derandomize=True,
    deadline=None,
    max_examples=40,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)
settings.register_profile("thorough", parent=settings.get_profile("ci"), derandomize=False, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect without the garbage collector, which then leaves alone what lives as long as the tests do anyway.

    Thousands of collected items would else be gone through again and again: a quarter of the time of collecting them
    and a twentieth of that of the tests.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
