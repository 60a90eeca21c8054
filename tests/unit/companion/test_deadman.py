"""The dead-man: the kernel ends a process that hangs while it flies, also one that holds the interpreter lock."""

import signal
import subprocess
import sys
import time

import pytest

HANGING = """
import sys, time
from companion.deadman import KernelTimer
from companion.fault_injection import hang
timer = KernelTimer(0.2)
for _ in range(20):
    timer.feed()
    time.sleep(0.02)
{before}
print("hanging", flush=True)
{hang}
print("still here", flush=True)
"""


def run(before: str, hang: str) -> tuple[subprocess.CompletedProcess, float]:
    """A program that feeds its dead-man for a while and then hangs; how long it lived after that [s]."""
    process = subprocess.Popen(
        [sys.executable, "-c", HANGING.format(before=before, hang=hang)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "hanging\n"
    began_s = time.monotonic()
    rest, _ = process.communicate(timeout=10.0)
    return subprocess.CompletedProcess([], process.returncode, rest), time.monotonic() - began_s


@pytest.mark.parametrize("how", ["hang()", "time.sleep(5)", "while True: pass"])
def test_a_hung_process_is_ended_on_time(how: str):
    ended, lived_s = run("", how)
    assert ended.returncode == -signal.SIGALRM
    assert ended.stdout == ""
    assert lived_s < 0.2 + 1.0


def test_disarmed_it_harms_nobody():
    ended, _ = run("timer.disarm()", "time.sleep(0.6)")
    assert (ended.returncode, ended.stdout) == (0, "still here\n")
