"""ur_rtde in a process of its own, which can be killed, and which cannot connect twice.

When its connection breaks, ur_rtde connects anew by itself and uploads its program again. That program finds the last
command still in the robot's registers, moves on, and has no watchdog; meanwhile ur_rtde may hold its whole process. So
it gets one that may open no further file or socket once it is connected, which the kernel sees to: a broken connection
stays broken, and the watchdog on the robot stops the arm. This process lives no longer than the session that owns it.
"""

from __future__ import annotations

import os
import resource
import signal
import socket
import struct
import sys
import threading
from typing import Any

from hrcneuro.arms.clock import seconds
from hrcneuro.robot.backend import PERIOD

# Of speedJ: it must exceed the tile moves' 5 rad/s², or the arm falls behind; the loop bounds what is asked.
_ACCELERATION = 15.0
# Inputs must come this often, Hz, or the controller stops the program: a killed driver's arm rests within 0.25 s.
WATCHDOG = 10.0
_AWAKE = 0.03  # s between signs of life while the arm rests
_TAKEN = 2.5 * PERIOD  # s; by then the robot has read a command from its registers
_SESSION_LIVES = 0.1  # s; a session that asks for nothing for longer is suspended or hangs: nobody supervises
_LONGEST = 5.0  # s, of one request; then the kernel ends this process

REQUEST = struct.Struct("=cI6d")  # what, number, six values
ANSWER = struct.Struct("=I14d2i")  # number, then a packet: time, q, qd, speed scaling, safety bits, runtime state
PACKET, SPEED, STOP, CLOSE = b"p", b"v", b"s", b"c"
READY, FAILED = b"+", b"-"


def main(host: str, link: socket.socket) -> None:
    """Connect to ``host``, say so on ``link``, and do what comes from there until it is closed."""
    # Ctrl-C is the session's to handle; it then asks for a controlled stop.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import rtde_control
    import rtde_receive

    try:
        receive = rtde_receive.RTDEReceiveInterface(host)
        control = rtde_control.RTDEControlInterface(host)
    except RuntimeError as error:
        link.send(FAILED + str(error).encode()[:900])
        return
    if not control.setWatchdog(WATCHDOG):
        link.send(FAILED + b"it did not take the watchdog, without which nothing is driven")
        return
    _seal()
    link.send(READY)
    try:
        _Driver(link, receive, control).serve()
    finally:
        # At once, without ur_rtde's farewells, which may hang: the robot's watchdog stops what moves.
        os._exit(0)


def _seal() -> None:
    # What is open stays open; standard streams hold 0 … 2, so nothing new fits below the limit.
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))


class _Driver:
    """Hands requests to ur_rtde; one at a time."""

    def __init__(self, link: socket.socket, receive: Any, control: Any) -> None:
        self._link, self._receive, self._control = link, receive, control
        self._moving = False
        self._asked = self._commanded = seconds()
        self._turn = threading.Lock()

    def serve(self) -> None:
        """Return when the session has closed its end, or has gone."""
        threading.Thread(target=self._keep_awake, daemon=True).start()
        while request := self._link.recv(REQUEST.size):
            what, number, *values = REQUEST.unpack(request)
            self._asked = seconds()
            signal.setitimer(signal.ITIMER_REAL, _LONGEST)
            with self._turn:
                self._do(what, values)
            if what != SPEED:
                self._link.send(ANSWER.pack(number, *self._packet()))
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            if what == CLOSE:
                return

    def _do(self, what: bytes, values: list[float]) -> None:
        if what == SPEED:
            self._moving = any(values)
            # Refused where the program has ended: the next packet says so, and the session stops on it.
            self._control.speedJ(values, _ACCELERATION, PERIOD)
            self._commanded = seconds()
        elif what == STOP:
            self._control.speedStop(values[0])
            self._moving = False
        elif what == CLOSE:
            self._control.stopScript()

    def _packet(self) -> tuple[float, ...]:
        receive = self._receive
        for _ in range(3):
            stamp = receive.getTimestamp()
            packet = (
                stamp, *receive.getActualQ(), *receive.getActualQd(), receive.getSpeedScaling(),
                receive.getSafetyStatusBits(), receive.getRuntimeState(),
            )  # fmt: skip
            # Each getter locks on its own: a packet that came in between would be mixed with the one before.
            if receive.getTimestamp() == stamp:
                break
        return packet

    def _keep_awake(self) -> None:
        # Between moves a cycle of the session may take longer than the watchdog waits. Only a resting arm is kept
        # awake, and only for a session that is there: in a move, a loop that hangs must stop the arm, and at rest
        # nothing may move after a gap. A sign of life goes through the registers that commands go through, and the
        # robot reads them once a cycle: one that came right behind the command to rest would take its place, and the
        # arm would creep on. A command is a sign of life itself.
        rest, wait = threading.Event(), _AWAKE
        while not rest.wait(wait):
            with self._turn:
                now = seconds()
                lives, left = now - self._asked <= _SESSION_LIVES, self._commanded + _TAKEN - now
                if not self._moving and lives and left <= 0.0:
                    self._control.kickWatchdog()
                wait = _AWAKE if left <= 0.0 else left


if __name__ == "__main__":
    main(sys.argv[1], socket.socket(fileno=int(sys.argv[2])))
