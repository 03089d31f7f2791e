"""What the benchmarks share: one BLAS thread, medians, peak memory in a fresh process, one row a result."""

from __future__ import annotations

import argparse
import contextlib
import gc
import multiprocessing
import os
import platform
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Seconds:
    """Medians over the runs: by the clock on the wall, and of processor time, which a busy machine disturbs less."""

    wall: float
    cpu: float


def options(description: str | None) -> argparse.Namespace:
    """Return the command line's options, and hold the numeric libraries to one thread from here on."""
    import scipy.linalg  # noqa: F401  (its BLAS must be loaded to be limited)
    from threadpoolctl import threadpool_limits

    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help="one run instead of the median of three")
    parser.add_argument("--repeats", type=int, default=3, help="runs to take the median of (default 3)")
    chosen = parser.parse_args()
    if chosen.quick:
        chosen.repeats = 1
    os.environ.update(dict.fromkeys(THREADS, "1"))
    threadpool_limits(1)
    return chosen


def in_turns(repeats: int, *works: Callable[[], Any], warm: bool = True) -> list[Seconds]:
    """Return how long each work takes; they take turns, so that a change of the machine's load meets all."""
    if warm:
        for work in works:
            work()
    taken: list[list[tuple[float, float]]] = [[] for _ in works]
    for _ in range(repeats):
        for times, work in zip(taken, works, strict=True):
            gc.collect()
            wall, cpu = time.perf_counter(), time.process_time()
            work()
            times.append((time.perf_counter() - wall, time.process_time() - cpu))
    return [Seconds(median(t[0] for t in times), median(t[1] for t in times)) for times in taken]


def median(values: Any) -> float:
    """Return the middle one of some values (the lower of two)."""
    ordered = sorted(values)
    return float(ordered[(len(ordered) - 1) // 2])


def peak_mb(work: Callable[..., Any], *arguments: Any, prepare: Callable[[], Any] | None = None) -> tuple[float, float]:
    """Return the memory of a fresh process before the work, with its data prepared, and its peak during it, in MB.

    Functions must be importable; what ``prepare`` returns is the first argument of ``work``.
    """
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_peak, (work, arguments, prepare))


def _peak(work: Callable[..., Any], arguments: tuple[Any, ...], prepare: Callable[[], Any] | None) -> Any:
    from threadpoolctl import threadpool_limits

    ready = () if prepare is None else (prepare(),)
    gc.collect()
    # Linux: 5 resets the peak (VmHWM) to what is in use now.
    Path("/proc/self/clear_refs").write_text("5")
    before = _status("VmRSS")
    with threadpool_limits(1):
        kept = work(*ready, *arguments)
    peak = _status("VmHWM")
    del kept
    return before, peak


def _status(name: str) -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def machine() -> str:
    """Return the processor's name, the number of cores and the machine's load."""
    found = None
    with contextlib.suppress(OSError):
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    name = found[1].strip() if found else platform.processor() or platform.machine()
    return f"{name}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"


def heading() -> None:
    """Print the head of the table of results, with the machine that they are of."""
    print(f"{machine()}; one thread; processor seconds in brackets")
    print("| work | peer | ours | ratio | target | largest difference |")
    print("|---|---|---|---|---|---|")


def row(work: str, peer: Seconds, ours: Seconds, target: float | None, difference: str) -> None:
    """Print one result."""
    print(
        f"| {work} | {_shown(peer)} | {_shown(ours)} | {peer.wall / ours.wall:.1f} ({peer.cpu / ours.cpu:.1f}) "
        f"| {'–' if target is None else f'≥ {target:g}'} | {difference} |",
        flush=True,
    )


def _shown(seconds: Seconds) -> str:
    return f"{seconds.wall:.3g} s ({seconds.cpu:.3g})"


if __name__ == "__main__":
    print(machine())
