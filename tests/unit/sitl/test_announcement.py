"""A first run says what it waits for; a slow machine that only loads machine code says nothing."""

import threading

from numba import njit

from sitl import announcement
from sitl.announcement import announced_compilation


def waited(seconds: float) -> None:
    threading.Event().wait(seconds)


def test_compiling_is_announced(monkeypatch, capsys):
    monkeypatch.setattr(announcement, "PATIENCE_S", 0.01)
    with announced_compilation("a first run"):
        njit(lambda x: x + 1)(1)
        waited(0.1)
    assert "a first run (0 s)" in capsys.readouterr().err


def test_loading_is_not(monkeypatch, capsys):
    kernel = njit(lambda x: x + 1)
    kernel(1)
    monkeypatch.setattr(announcement, "PATIENCE_S", 0.01)
    with announced_compilation("a first run"):
        kernel(2)
        waited(0.1)
    assert capsys.readouterr().err == ""


def test_waiting_long_for_somebody_elses_compilation_is_announced(monkeypatch, capsys):
    monkeypatch.setattr(announcement, "PATIENCE_S", 0.01)
    monkeypatch.setattr(announcement, "OTHERS_PATIENCE_S", 0.05)
    with announced_compilation("a first run"):
        waited(0.2)
    assert "a first run" in capsys.readouterr().err
