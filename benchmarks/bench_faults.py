"""What a person is told, and when, and what is kept, when something goes wrong with a session on an arm.

Each fault hits a session on a simulated controller in real time, by both drivers, on ``ur`` (a controller of its own on
loopback) and on ``ursim``. Measured from the outside: from the fault to the first word on standard error, to the arm's
rest as port 30003 shows it, and what lies in the recording afterwards.

    python benchmarks/bench_faults.py --times 20        # all of it, hours
    python benchmarks/bench_faults.py --quick           # each fault once on ur with rtde
    python benchmarks/bench_faults.py --only hang-up --backend ur --driver script
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import _measure
from _session_seen import Run, Watch, ahead, children, favour, listen, punctual, under_way, wait, what_is_kept

HOST = "127.0.9.251"
WORDS_S, REST_S = 0.5, 0.25
CONFIG = Path(__file__).parent.parent / "configs" / "smoke.toml"
COMMAND = [sys.executable, "-m", "hrcneuro"]
BETWEEN = ["--set", "robot.blocks=[1]", "--set", "robot.episodes=[2]", "--set", "robot.lead_s=0.03",
           "--set", "robot.pause_s=2", "--no-figures", "--force"]  # fmt: skip


def fault(run: Run, text: str) -> None:
    with socket.create_connection((run.watch.host, 29998), 2.0) as link:
        link.sendall(f"{text}\n".encode())
        link.recv(10)


def suspend(run: Run) -> None:
    os.kill(run.process.pid, signal.SIGSTOP)
    time.sleep(1.0)
    os.kill(run.process.pid, signal.SIGCONT)


def freeze(run: Run) -> None:
    os.kill(run.controller, signal.SIGSTOP)
    threading.Timer(3.0, thaw, (run.controller,)).start()


def thaw(controller: int) -> None:
    # The controller of ursim has ended with its session by then.
    with contextlib.suppress(ProcessLookupError):
        os.kill(controller, signal.SIGCONT)


def twice(run: Run) -> None:
    os.kill(run.process.pid, signal.SIGINT)
    time.sleep(0.1)
    os.kill(run.process.pid, signal.SIGINT)


def fill(run: Run) -> None:
    with contextlib.suppress(OSError), (run.folder / "filler").open("wb", buffering=0) as file:
        while True:
            file.write(bytes(1 << 16))


FAULTS: dict[str, Callable[[Run], None]] = {
    "frozen controller": freeze,
    "cut cable": lambda run: fault(run, "cut"),
    "killed driver": lambda run: os.kill(run.child("hrcneuro.arms.ur_process"), signal.SIGKILL),
    "killed session": lambda run: os.kill(run.process.pid, signal.SIGKILL),
    "suspended, moving": suspend,
    "suspended, at rest": suspend,
    "latency in mid-move": lambda run: fault(run, "latency=0.06"),
    "even latency": lambda run: None,
    "full disk": fill,
    "twice Ctrl-C": twice,
    "hang-up": lambda run: os.kill(run.process.pid, signal.SIGHUP),
}


@contextlib.contextmanager
def served(latency: float) -> Iterator[int]:
    """Serve a controller; yields its number."""
    options = ["--fault", f"latency={latency}"] if latency else []
    command = [*COMMAND, "ur10", "serve", "--address", HOST, "--json", "--until-stdin-closes", *options]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    ahead(process)
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdout.readline()
    favour(process.pid)
    try:
        yield process.pid
    finally:
        process.stdin.close()
        process.wait()
        process.stdout.close()


@contextlib.contextmanager
def disk(name: str) -> Iterator[Path | None]:
    """Yield a folder for the recording; for the full disk on a small file system of its own, None where it may not."""
    folder = Path(tempfile.mkdtemp())
    mounted = name == "full disk"
    if mounted and subprocess.run(["mount", "-t", "tmpfs", "-o", "size=40m", "tmpfs", folder], check=False).returncode:
        yield None
        return
    try:
        yield folder
    finally:
        if mounted:
            subprocess.run(["umount", folder], check=True)
        shutil.rmtree(folder)


def attempt(work: Path, name: str, backend: str, driver: str, controller: int) -> dict[str, object] | None:
    """Return what one fault led to; None where the session ended before it."""
    with disk(name) as folder:
        if folder is None:
            return {"words": None, "rest": None, "kept": "this machine lets nobody mount a small disk", "lost": False}
        where = ["--backend", backend, *(["--host", HOST] if backend == "ur" else [])]
        command = [*COMMAND, "robot", "s01", *where, "--set", f"robot.driver={driver}", *BETWEEN,
                   "--set", f"robot.rescue_folder={folder}"]  # fmt: skip
        begin = time.monotonic()
        process = subprocess.Popen(command, cwd=work, stderr=subprocess.PIPE, text=True, start_new_session=True)
        ahead(process)
        host = HOST
        if backend == "ursim":
            wait(lambda: "hrcneuro.ur10" in children(process.pid), 30.0)
            known = children(process.pid)
            controller, host = known["hrcneuro.ur10"], str(known["hrcneuro.ur10 at"])
            favour(controller)
        run = Run(process, Watch(host), controller, folder)
        reader = threading.Thread(target=listen, args=(run,))
        reader.start()
        moved = begin
        if name != "even latency":
            if not under_way(run, at_rest=name.endswith("at rest")):
                process.kill()
                reader.join()
                return None
            moved = next(came for came, _, speed in run.watch.seen if speed > 5e-3)
        event = time.monotonic()
        FAULTS[name](run)
        # A suspended session can say nothing until it goes on; the arm must rest long before that.
        spoken_from = time.monotonic() if name.startswith("suspended") else event
        process.wait(60)
        reader.join()
        wait(lambda: run.watch.speed() < 5e-3, 5.0)
        time.sleep(0.3)
        run.watch.ended = True
        run.watch.join()
        words = next((when - spoken_from for when, _ in run.lines if when >= event), None)
        kept, lost = what_is_kept(folder, event - moved)
        if name == "even latency":
            words, kept = None, f"nothing moved ({run.lines[0][1][:60]})" if run.lines else "nothing said"
            lost = any(speed > 5e-3 for *_, speed in run.watch.seen) or process.returncode != 4
        return {"words": words, "rest": run.watch.rest_after(event), "kept": kept, "lost": lost}


def table(work: Path, names: list[str], backends: list[str], drivers: list[str], times: int) -> bool:
    sound = True
    print(f"{_measure.machine()} at the start\n")
    print("| fault | arm | driver | n | first word, s: median … most | at rest, s: median … most | kept | lost |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for name in names:
        for backend in backends:
            for driver in drivers:
                if (name == "killed driver" and driver == "script") or (name == "even latency" and backend == "ursim"):
                    continue  # there is no such process; an own controller is not reached before it is measured
                outcomes: list[dict[str, object]] = []
                early = 0
                while len(outcomes) < times and early < times + 5:
                    latency = 0.06 if name == "even latency" else 0.0
                    with served(latency) if backend == "ur" else contextlib.nullcontext(0) as controller:
                        done = attempt(work, name, backend, driver, controller)
                    early += done is None
                    outcomes += [done] if done else []
                sound &= row(name, backend, driver, outcomes)
                if early:
                    print(f"  ({early} sessions ended before the fault)", file=sys.stderr)
    return sound


def row(name: str, backend: str, driver: str, outcomes: list[dict[str, object]]) -> bool:
    words = sorted(float(o["words"]) for o in outcomes if o["words"] is not None)  # type: ignore[arg-type]
    rests = sorted(float(o["rest"]) for o in outcomes if o["rest"] is not None)  # type: ignore[arg-type]
    kept = sorted({str(o["kept"]) for o in outcomes})
    lost = sum(bool(o["lost"]) for o in outcomes)
    cells = [f"{v[len(v) // 2]:.2f} … {v[-1]:.2f}" if v else "-" for v in (words, rests)]
    print(f"| {name} | {backend} | {driver} | {len(outcomes)} | {cells[0]} | {cells[1]} | {kept[-1] if kept else '-'} "
          f"| {lost} |", flush=True)  # fmt: skip
    return not lost and all(v <= WORDS_S for v in words) and all(v <= REST_S for v in rests)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", action="append", choices=list(FAULTS))
    parser.add_argument("--backend", action="append", choices=["ur", "ursim"])
    parser.add_argument("--driver", action="append", choices=["rtde", "script"])
    given = parser.parse_args()
    backends = given.backend or (["ur"] if given.quick else ["ur", "ursim"])
    drivers = given.driver or (["rtde"] if given.quick else ["rtde", "script"])
    for number in (signal.SIGINT, signal.SIGHUP):
        # A shell that starts this in the background has them ignored, by the sessions, too.
        signal.signal(number, signal.default_int_handler)
    # What else the machine does must not count. (Linux holds all of these up for 50 ms of each second in which they
    # fill a core, unless /proc/sys/kernel/sched_rt_runtime_us is -1.)
    punctual()
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        shutil.copy(CONFIG, work / "hrcneuro.toml")
        subprocess.run([*COMMAND, "acquire", "s01", "--no-figures", "-q"], cwd=work, check=True)
        sound = table(work, given.only or list(FAULTS), backends, drivers, 1 if given.quick else given.times)
    sys.exit(not sound)


if __name__ == "__main__":
    main()
