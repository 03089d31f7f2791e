"""A flow for tests, in a process of its own: moves the arm to and fro until it is killed; prints a line an event.

SIGUSR1 ends its first thread alone: so looks a process that was killed while another thread waits for a busy disk.
"""

from __future__ import annotations

import ctypes
import dataclasses
import itertools
import platform
import signal
import sys
import threading
from multiprocessing.connection import wait

from hrcneuro.experiment import messages
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.arm_process import ArmProcess
from hrcneuro.experiment.arm_side import ArmSettings
from hrcneuro.stages.robot import Config

SYS_EXIT = {"x86_64": 60, "aarch64": 93}.get(platform.machine())


def end_first_thread(*_: object) -> None:
    threading.Thread(target=signal.pause).start()
    ctypes.CDLL(None).syscall(SYS_EXIT, 0)


def main(backend: str, host: str, folder: str) -> None:
    signal.signal(signal.SIGUSR1, end_first_thread)
    # Other work may hold up a simulated controller: not what is tested.
    limits = {"max_packet_age_s": 0.5, "max_late_s": 0.5}
    config = dataclasses.replace(Config(), backend=backend, host=host, rescue_folder=folder, lead_s=0.035, **limits)
    with ArmProcess(ArmSettings(config, "s01"), Ahead(config, shortest_s=0.6)) as arm:
        print("arm", arm.pid, flush=True)
        tiles = itertools.cycle([(3, 3), (3, 4)])
        start = next(tiles)
        for index in itertools.count():
            for report in following(arm):
                print(type(report).__name__, report, flush=True)
                if isinstance(report, messages.Halted):
                    return
                if isinstance(report, messages.Ready | messages.Executed):
                    break
            end = next(tiles)
            text = f"move/subject=s01/scenario=iC/block=1/episode=1/trial={index}"
            arm.send(messages.Go(index, start, end, 0.7, text))
            start = end


def following(arm):
    while True:
        wait([arm.connection])
        yield from arm.reports()


if __name__ == "__main__":
    main(*sys.argv[1:])
