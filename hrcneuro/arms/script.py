"""A UR10 through port 30003 as in the paper: its state from the real-time stream, its speed by ``speedj`` lines.

Each line is a program that ends after a tenth of a second, so silence stops the arm. Universal Robots deprecated this
way from software 3.5 on: ``ur`` is the default.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading

from hrcneuro.arms.clock import Stamps, WallClock
from hrcneuro.arms.dashboard import check, exactly
from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PLAYING, PROTECTIVE, Packet

_ACCELERATION = 15.0
_HOLD = 0.1  # s, that a line acts
# Of the packet's doubles behind its length: time, q, qd, safety mode, speed scaling, program state.
_TIME, _Q, _QD, _SAFETY, _SCALING, _PROGRAM = 0, 31, 37, 101, 117, 131
_DOUBLES = 138
_SAFETY_BITS = {1: NORMAL, 3: PROTECTIVE, 6: EMERGENCY, 7: EMERGENCY}


class ScriptArm:
    """A backend; connecting sends nothing."""

    def __init__(self, host: str, clock: WallClock, *, max_delay: float = 0.2) -> None:
        """Connect, and wait for the first packet.

        Raises:
            HardwareError: The robot is not there, not ready, or sends other packets.
        """
        check(host, max_delay)
        self._host, self._clock, self._stamps = host, clock, Stamps()
        self._packet: Packet | None = None
        self._arrived = threading.Condition()
        self._problem = ""
        try:
            self._link = socket.create_connection((host, 30003), 2.0)
        except OSError as error:
            raise HardwareError(f"no robot answers at {host}:30003: {error.strerror or error}") from None
        self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._link.settimeout(2.0)
        threading.Thread(target=self._read, daemon=True).start()
        with self._arrived:
            self._arrived.wait_for(lambda: self._packet is not None or self._problem, 2.0)
        if self._packet is None:
            self.close()
            raise HardwareError(
                f"{host}:30003 sends no real-time packets{': ' + self._problem if self._problem else ''}",
                cure="use a CB3 with software 3.5 or later",
            )

    def align(self) -> None:
        """Return just after a packet has come."""
        with self._arrived:
            self._arrived.wait(0.1)
        self._clock.wait_until(self._clock.now() + 1e-3)

    def state(self) -> Packet:
        """Return the newest packet."""
        assert self._packet is not None
        return self._packet

    def speed(self, qd: list[float]) -> None:
        """Command joint velocities, six, rad/s."""
        # A broken link shows as packets that do not come: the supervisor sees it.
        with contextlib.suppress(OSError):
            self._link.sendall(f"speedj([{','.join(f'{v:.6f}' for v in qd)}],{_ACCELERATION},{_HOLD})\n".encode())

    def stop(self, deceleration: float) -> None:
        """Bring the arm to rest."""
        with contextlib.suppress(OSError):
            self._link.sendall(f"stopj({deceleration:.3f})\n".encode())

    def close(self) -> None:
        """Disconnect."""
        with contextlib.suppress(OSError):
            self._link.shutdown(socket.SHUT_RDWR)
        self._link.close()

    def _read(self) -> None:
        try:
            while True:
                (size,) = struct.unpack(">i", exactly(self._link, 4))
                if not 4 + 8 * _DOUBLES <= size <= 4096:
                    raise OSError(f"packets of {size} bytes, not 1108 or more")
                values = struct.unpack_from(f">{_DOUBLES}d", exactly(self._link, size - 4))
                with self._arrived:
                    self._packet = self._state(values)
                    self._arrived.notify_all()
        except OSError as error:
            with self._arrived:
                self._problem = str(error)
                self._arrived.notify_all()

    def _state(self, values: tuple[float, ...]) -> Packet:
        # Between two lines no program runs, which is no reason to stop; a paused one is.
        runtime = PAUSED if int(values[_PROGRAM]) == PAUSED else PLAYING
        return Packet(
            self._stamps.local(values[_TIME], self._clock.now()),
            list(values[_Q : _Q + 6]),
            list(values[_QD : _QD + 6]),
            _SAFETY_BITS.get(int(values[_SAFETY]), 0),
            runtime,
            values[_SCALING],
        )
