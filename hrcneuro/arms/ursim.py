"""The simulated controller in a process of its own, then driven over sockets as a real one."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any, Protocol

from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import Backend, Packet

_START = 20.0  # s, until it listens


class _Aligned(Backend, Protocol):
    def align(self) -> None: ...


class UrSim:
    """A backend that owns its controller."""

    def __init__(self, connect: Callable[[str], _Aligned], *, options: tuple[str, ...] = ()) -> None:
        """Start a controller on a loopback address of its own and hand the address to ``connect``.

        Raises:
            HardwareError: It does not start, or cannot be driven.
        """
        self._process, self.host = _start(options)
        try:
            self._arm = connect(self.host)
        except BaseException:
            self._end()
            raise

    def align(self) -> None:
        """Return just after a packet has come."""
        self._arm.align()

    def state(self) -> Packet:
        """Return the newest packet."""
        return self._arm.state()

    def speed(self, qd: list[float]) -> None:
        """Command joint velocities, six, rad/s."""
        self._arm.speed(qd)

    def stop(self, deceleration: float) -> None:
        """Bring the arm to rest."""
        self._arm.stop(deceleration)

    def close(self) -> None:
        """Let go of the arm and end the controller."""
        try:
            self._arm.close()
        finally:
            self._end()

    def _end(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


def _start(options: tuple[str, ...]) -> tuple[subprocess.Popen[Any], str]:
    # Two sessions on one machine get different addresses; a taken one is answered by taking the next.
    for attempt in range(5):
        number = os.getpid() * 5 + attempt
        host = f"127.{20 + number // 62500 % 200}.{1 + number // 250 % 250}.{1 + number % 250}"
        process = subprocess.Popen(
            [sys.executable, "-m", "hrcneuro.ur10", "--address", host, "--until-stdin-closes", "--json", *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Ctrl-C in a terminal goes to all in its session: it must not take the arm from a controlled stop.
            start_new_session=True,
        )  # fmt: skip
        assert process.stdout is not None
        # A controller that hangs before it listens is killed, which ends the wait for its first line.
        timer = threading.Timer(_START, process.kill)
        timer.start()
        line = process.stdout.readline()
        timer.cancel()
        if b'"ok": true' in line:
            return process, host
        process.kill()
        process.wait()
    raise HardwareError(
        "the simulated controller does not start",
        cure="run 'hrcneuro ur10 serve --address 127.0.0.2' and read what it says",
    )
