"""Tests of machine code have the levels of users, which other tests go without."""

import pytest


@pytest.fixture(autouse=True)
def levels_of_users(request, monkeypatch):
    if hasattr(request.config, "levels_of_users"):
        from mbd.compile import llvm

        for name, value in zip(("LEVEL", "HASTY"), request.config.levels_of_users, strict=True):
            monkeypatch.setattr(llvm, name, value)
