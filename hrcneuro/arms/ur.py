"""A UR10 through ur_rtde: joint velocities over RTDE, with a watchdog from the first moment on."""

from __future__ import annotations

import contextlib
import importlib.util
import socket
import subprocess
import sys

from hrcneuro.arms import ur_process as process
from hrcneuro.arms.clock import Stamps, WallClock
from hrcneuro.arms.dashboard import check, stop_by_script
from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import NORMAL, PERIOD, PLAYING, Packet

_START = 20.0  # s, for ur_rtde to connect
_PROMPT = PERIOD / 2  # s, for a packet that has come already
_PATIENCE = 1.0  # s, for a stop to be acknowledged
_FRESH = 0.1  # s; a driver without packets for longer is not asked to stop the arm, but ended


class UrArm:
    """A backend; connecting uploads ur_rtde's program and moves nothing."""

    def __init__(self, host: str, clock: WallClock, *, max_delay: float = 0.2) -> None:
        """Connect.

        Raises:
            HardwareError: ur_rtde is not installed, or the robot is not there, not ready, or taken by another client.
        """
        if importlib.util.find_spec("rtde_control") is None:
            raise HardwareError("ur_rtde is not installed", cure="pip install 'hrcneuro[ur]'")
        check(host, max_delay)
        self._host, self._clock, self._stamps = host, clock, Stamps()
        self._number = 0
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            # In a session of its own, so that Ctrl-C reaches it through us only.
            self._process = subprocess.Popen(
                [sys.executable, "-m", process.__name__, host, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        try:
            self._await_ready()
            packet = self._ask(process.PACKET, within=_PATIENCE)
            if packet is None:
                raise _refused(host, "its packets do not come")
        except BaseException:
            self._end()
            raise
        self._packet: Packet = packet

    def align(self) -> None:
        """Return just after a packet has come: a loop that begins now reads fresh packets."""
        first, until = self.state().stamp, self._clock.now() + 0.1
        while self.state().stamp == first and self._clock.now() < until:
            self._clock.wait_until(self._clock.now() + 2e-4)
        self._clock.wait_until(self._clock.now() + 1e-3)

    def state(self) -> Packet:
        """Return the newest packet; where the driver does not answer, the last one, which grows old."""
        packet = self._ask(process.PACKET, within=_PROMPT)
        if packet is not None:
            self._packet = packet
        return self._packet

    def speed(self, qd: list[float]) -> None:
        """Command joint velocities, six, rad/s."""
        # A driver that is gone shows as packets that do not come: the supervisor sees it.
        with contextlib.suppress(OSError):
            self._link.send(process.REQUEST.pack(process.SPEED, 0, *qd))

    def stop(self, deceleration: float) -> None:
        """Bring the arm to rest; where ur_rtde's program does not answer, by a program of its own."""
        packet = self.state()
        running = packet.safety == NORMAL and packet.runtime == PLAYING
        fresh = self._clock.now() - packet.stamp < _FRESH
        if running and fresh and self._ask(process.STOP, deceleration, within=_PATIENCE) is not None:
            return
        if not fresh or running:
            self._end()
        if packet.safety == NORMAL:
            stop_by_script(self._host, deceleration)

    def close(self) -> None:
        """End ur_rtde's program and disconnect."""
        self._ask(process.CLOSE, within=_PATIENCE)
        self._end()

    def _await_ready(self) -> None:
        self._link.settimeout(_START)
        try:
            answer = self._link.recv(1000)
        except OSError:
            answer = b""
        if answer != process.READY:
            raise _refused(self._host, answer.removeprefix(process.FAILED).decode("utf-8", "replace"))

    def _ask(self, what: bytes, value: float = 0.0, *, within: float) -> Packet | None:
        """Return the packet that answers a request, None where none comes ``within`` seconds."""
        self._number = (self._number + 1) % 2**32
        until = self._clock.now() + within
        try:
            self._link.settimeout(within)
            self._link.send(process.REQUEST.pack(what, self._number, value, *(0.0,) * 5))
            while answer := self._link.recv(process.ANSWER.size):
                number, *values = process.ANSWER.unpack(answer)
                if number == self._number:
                    return self._state(values)
                # The answer to a request that was given up.
                self._link.settimeout(max(1e-6, until - self._clock.now()))
        except OSError:
            pass
        return None

    def _state(self, values: list[float]) -> Packet:
        stamp, scaling, safety, runtime = values[0], *values[13:]
        local = self._stamps.local(stamp, self._clock.now())
        return Packet(local, values[1:7], values[7:13], int(safety), int(runtime), scaling)

    def _end(self) -> None:
        # Its sockets close with it, and the robot's watchdog stops what moves.
        self._link.close()
        self._process.kill()
        self._process.wait()


def _refused(host: str, problem: str) -> HardwareError:
    text = " ".join(problem.split()) or "ur_rtde does not get a connection"
    if "in use" in text:
        return HardwareError(
            f"another client holds the RTDE inputs of the robot at {host}",
            cure="end it; on the robot, disable EtherNet/IP and PROFINET in the installation",
        )
    return HardwareError(
        f"the robot at {host} cannot be driven: {text}",
        cure="see that no other program holds it and that its pendant shows no message",
    )
