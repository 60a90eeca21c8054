"""Ctrl-C, at any time, is an exit code and no traceback."""

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from gcs import cli
from gcs.processes import Processes

LONG_S = 30.0


@pytest.fixture(autouse=True)
def own_signals() -> Iterator[None]:
    """Ctrl-C is heard, also where the tests run in the background of a shell, which has it ignored."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


async def refused() -> None:
    await asyncio.sleep(0.01)
    raise ConnectionRefusedError


async def a_session_in_which_something_has_failed() -> None:
    """A failed task group leaves a cancellation request behind on Python 3.11."""
    try:
        async with asyncio.TaskGroup() as group:
            group.create_task(refused())
    except* ConnectionRefusedError:
        asyncio.get_running_loop().call_soon(os.kill, os.getpid(), signal.SIGINT)
    await asyncio.sleep(LONG_S)


def test_ctrl_c_after_a_failure_is_told_from_a_crash(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cli, "app", lambda standalone_mode: asyncio.run(a_session_in_which_something_has_failed()))
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130


async def a_session_whose_program_takes_its_time_to_end() -> None:
    loop = asyncio.get_running_loop()
    async with Processes() as processes:
        deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
        await processes.start("slow", "timeit", "-n1", "-r1", "-s", deaf, "time.sleep(2.0)")
        for delay_s in (0.7, 1.0):
            loop.call_later(delay_s, os.kill, os.getpid(), signal.SIGINT)
        await asyncio.sleep(LONG_S)


def end_twice() -> None:
    """In a program of its own: what is given up half ended would be found by the next test."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    cli.app = lambda standalone_mode: asyncio.run(a_session_whose_program_takes_its_time_to_end())
    cli.main()


def test_who_presses_ctrl_c_again_while_programs_end_sees_no_traceback():
    program = f"from {__name__} import end_twice; end_twice()"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60.0, check=False)
    assert (ended.returncode, ended.stdout + ended.stderr) == (130, "")
