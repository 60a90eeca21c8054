"""Where runs are done: on this machine's cores, or on a Dask cluster; either is a `concurrent.futures.Executor`."""

import importlib
import multiprocessing
import os
import re
import signal
from collections.abc import Generator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

from gcs.errors import UsageError
from gcs.planner_process import end_with_parent

SCHEDULER = re.compile(r"(tcp|tls)://[^/\s:]+:\d{1,5}")
CONNECT_TIMEOUT_S = 10
ONE_THREAD: dict[str, str] = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of workers: one run is one thread, so that its CPU time means something."""


def check_scheduler(url: str) -> None:
    """Refuse what is no address of a Dask scheduler, and that there is no Dask.

    Raises:
        UsageError: with what was expected.
    """
    if SCHEDULER.fullmatch(url) is None:
        raise UsageError(f"--executor {url}: expected the address of a Dask scheduler, such as tcp://127.0.0.1:8786")
    try:
        importlib.import_module("distributed")
    except ImportError:
        raise UsageError(
            f"--executor {url}: dask.distributed is not installed: pip install 'end-cloud-gcs[cluster]'"
        ) from None


@contextmanager
def open_executor(url: str | None) -> Generator[Executor]:
    """An executor that ends, with all its work, when the block is left.

    Args:
        url: of a Dask scheduler; None for a pool of processes, one for each core that this one may use.

    Raises:
        UsageError: there is no scheduler at that address.
    """
    if url is None:
        with _process_pool() as pool:
            yield pool
        return
    check_scheduler(url)
    with _cluster(url) as executor:
        yield executor


@contextmanager
def _process_pool() -> Generator[Executor]:
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(len(os.sched_getaffinity(0)), mp_context=context, initializer=_begin)
    try:
        yield pool
    finally:
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


@contextmanager
def _cluster(url: str) -> Generator[Executor]:
    from distributed import Client

    try:
        client: Any = Client(url, timeout=CONNECT_TIMEOUT_S, set_as_default=False)
    except (OSError, TimeoutError) as problem:
        raise UsageError(f"--executor {url}: no scheduler answers there: {problem}") from None
    try:
        executor = client.get_executor(pure=False)
        yield executor
        executor.shutdown(wait=False)
    finally:
        client.close()


def _begin() -> None:
    """Set up a worker of the pool: Ctrl-C is its parent's business, and it does not outlive its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
