"""A UR10 through ur_rtde: joint velocities over RTDE, with a watchdog from the first moment on."""

from __future__ import annotations

import threading
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import NORMAL, PERIOD, PLAYING, State
from hrcneuro.robot.backends.clock import Stamps, WallClock
from hrcneuro.robot.backends.dashboard import check_ready, stop_by_script

# Of speedJ: it must exceed the tile moves' 5 rad/s², or the arm falls behind; the loop bounds what is asked.
_ACCELERATION = 15.0
# Inputs must come this often, Hz, or the controller stops the program: a killed driver's arm rests within 0.25 s.
_WATCHDOG = 10.0
_GUARD_DECELERATION = 8.0  # rad/s²
_PATIENCE = 1.0  # s, for a stop to be acknowledged


class UrArm:
    """A backend; connecting uploads ur_rtde's program and moves nothing."""

    def __init__(self, host: str, clock: WallClock) -> None:
        """Connect.

        Raises:
            HardwareError: ur_rtde is not installed, or the robot is not there, not ready, or taken by another client.
        """
        control_module, receive_module = _library()
        check_ready(host)
        self._host, self._clock, self._stamps = host, clock, Stamps()
        try:
            self._receive: Any = receive_module.RTDEReceiveInterface(host)
            self._control: Any = control_module.RTDEControlInterface(host)
        except RuntimeError as error:
            raise _refused(host, str(error)) from None
        if not self._control.setWatchdog(_WATCHDOG):
            self._control.disconnect()
            raise HardwareError(
                f"the robot at {host} did not take the watchdog", cure="restart its controller; without it none drives"
            )
        self._packet: State | None = None
        self._stamp = -1.0
        self._moving, self._sent, self._closed = False, clock.now(), threading.Event()
        self._turn = threading.Lock()
        threading.Thread(target=self._keep_awake, daemon=True).start()
        threading.Thread(target=self._guard, daemon=True).start()

    def align(self) -> None:
        """Return just after a packet has come: a loop that begins now reads fresh packets."""
        first, until = self._receive.getTimestamp(), self._clock.now() + 0.1
        while self._receive.getTimestamp() == first and self._clock.now() < until:
            self._clock.wait_until(self._clock.now() + 2e-4)
        self._clock.wait_until(self._clock.now() + 1e-3)

    def state(self) -> State:
        """Return the newest packet."""
        receive = self._receive
        for _ in range(3):
            stamp = receive.getTimestamp()
            if stamp == self._stamp and self._packet is not None:
                return self._packet
            packet = State(
                0.0,
                receive.getActualQ(),
                receive.getActualQd(),
                receive.getSafetyStatusBits(),
                receive.getRuntimeState(),
                receive.getSpeedScaling(),
            )
            # Each getter locks on its own: a packet that came in between would be mixed with the one before.
            if receive.getTimestamp() == stamp:
                break
        packet.stamp = self._stamps.local(stamp, self._clock.now())
        self._stamp, self._packet = stamp, packet
        return packet

    def speed(self, qd: list[float]) -> None:
        """Command joint velocities, six, rad/s.

        Raises:
            HardwareError: The command did not leave at once. ur_rtde reconnects by itself, without the watchdog, and
                would then move the arm on: an interrupted move must stay one.
        """
        with self._turn:
            begin = self._clock.now()
            late = self._moving and begin - self._sent > 1 / _WATCHDOG
            self._moving, self._sent = any(qd), begin
            taken = not late and self._control.speedJ(qd, _ACCELERATION, PERIOD)
            if not taken or self._clock.now() - begin > 1 / _WATCHDOG:
                self._closed.set()
                raise HardwareError(
                    f"the connection to the robot at {self._host} was interrupted in mid-move; the arm was stopped",
                    cure="check the cable and what else loads this machine, then start the session again",
                )

    def stop(self, deceleration: float) -> None:
        """Bring the arm to rest; where ur_rtde's program does not answer, by a program of its own."""
        self._closed.set()
        packet = self.state()
        running = packet.safety == NORMAL and packet.runtime == PLAYING
        if running and self._clock.now() - packet.stamp < 0.1 and self._finishes(self._control.speedStop, deceleration):
            return
        if packet.safety == NORMAL:
            stop_by_script(self._host, deceleration)

    def close(self) -> None:
        """End ur_rtde's program and disconnect."""
        self._closed.set()
        if self._finishes(self._control.stopScript):
            self._finishes(self._control.disconnect)
        self._finishes(self._receive.disconnect)

    def _keep_awake(self) -> None:
        # Between moves the session may compute for longer than the watchdog waits. Only a resting arm is kept awake:
        # in a move, a loop that hangs must stop the arm.
        while not self._closed.wait(0.03):
            with self._turn:
                if not self._moving and not self._closed.is_set():
                    self._control.kickWatchdog()

    def _guard(self) -> None:
        # A cut connection makes ur_rtde wait inside speedJ, reconnect and upload its program anew, which reads the last
        # command from the robot's registers and has no watchdog yet. Whoever waits in speedJ cannot stop that.
        while not self._closed.wait(0.02):
            if self._moving and self._clock.now() - self._sent > 1 / _WATCHDOG:
                self._closed.set()
                stop_by_script(self._host, _GUARD_DECELERATION)
                self._finishes(self._control.disconnect)
                stop_by_script(self._host, _GUARD_DECELERATION)

    def _finishes(self, call: Any, *arguments: Any) -> bool:
        # ur_rtde waits minutes for a controller that has gone silent; nobody here may.
        done = threading.Event()

        def work() -> None:
            call(*arguments)
            done.set()

        threading.Thread(target=work, daemon=True).start()
        return done.wait(_PATIENCE)


def _library() -> tuple[Any, Any]:
    try:
        import rtde_control
        import rtde_receive
    except ImportError:
        raise HardwareError("ur_rtde is not installed", cure="pip install 'hrcneuro[ur]'") from None
    return rtde_control, rtde_receive


def _refused(host: str, problem: str) -> HardwareError:
    text = " ".join(problem.split())
    if "in use" in text:
        return HardwareError(
            f"another client holds the RTDE inputs of the robot at {host}",
            cure="end it; on the robot, disable EtherNet/IP and PROFINET in the installation",
        )
    return HardwareError(
        f"the robot at {host} cannot be driven: {text}",
        cure="see that no other program holds it and that its pendant shows no message",
    )
