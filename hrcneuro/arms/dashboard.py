"""Questions to the arm's panel before anything is driven."""

from __future__ import annotations

import contextlib
import socket

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import HardwareError

_PORT, _RTDE = 29999, 30004
_VERSION_QUESTION = b"\0\3v"  # "which software is this?", of any RTDE version


def ask(host: str, *questions: str, timeout: float = 2.0) -> list[str]:
    """Return the dashboard's answers, a line each.

    Raises:
        HardwareError: The host does not answer, or not as a dashboard.
    """
    try:
        with socket.create_connection((host, _PORT), timeout) as link, link.makefile("rwb") as lines:
            welcome = lines.readline(1000)
            answers = []
            for question in questions:
                lines.write(question.encode() + b"\n")
                lines.flush()
                answers.append(lines.readline(1000).decode("utf-8", "replace").strip())
    except OSError as error:
        raise HardwareError(
            f"no robot answers at {host}: {error.strerror or error}",
            cure="check the cable and the address on the robot's network page; robot.host or --host sets it",
        ) from None
    if b"Universal Robots" not in welcome:
        raise HardwareError(
            f"{host}:{_PORT} is no robot's dashboard: it said {welcome[:60]!r}", cure="correct robot.host"
        )
    return answers


def check_ready(host: str) -> None:
    """Check that a UR with CB3 software stands ready to be driven.

    Raises:
        HardwareError: It does not answer, has other software, is not running, in a safety stop or runs a program.
    """
    version, robot, safety, program = ask(host, "PolyscopeVersion", "robotmode", "safetymode", "programState")
    if not version.removeprefix("URSoftware ").startswith("3."):
        raise HardwareError(
            f"the robot at {host} runs {version or 'unknown software'!r}; hrcneuro drives CB3 arms at 125 Hz "
            "(URSoftware 3.x)",
            cure="connect a UR10 CB3",
        )
    if not safety.upper().endswith("NORMAL"):
        raise HardwareError(
            f"the robot at {host} is not in its normal safety mode ({safety or 'no answer'})",
            cure="find out why on the pendant, and clear it there; hrcneuro never unlocks a stop",
        )
    if not robot.upper().endswith("RUNNING"):
        raise HardwareError(
            f"the robot at {host} is not running ({robot or 'no answer'})",
            cure="power it on and release its brakes on the pendant",
        )
    if program.upper().startswith(("PLAYING", "PAUSED")):
        raise HardwareError(
            f"a program is on the robot at {host} already ({program}); driving the arm would end it",
            cure="let it finish, or stop it on the pendant",
        )


def check(host: str, max_delay: float) -> None:
    """Check that a robot can be driven, and answers within ``max_delay`` seconds.

    Raises:
        HardwareError: It is not there or not ready, or answers too slowly.
    """
    # In this order: an arm that another session drives is not asked further.
    check_ready(host)
    check_delay(host, max_delay)


def check_delay(host: str, most: float, *, tries: int = 5) -> None:
    """Check that the robot answers quickly, by the quickest of a few questions to its RTDE.

    A delay that is the same for every packet shows in no packet's age: it must be measured there and back.

    Raises:
        HardwareError: The quickest answer takes longer than ``most`` seconds.
    """
    try:
        with socket.create_connection((host, _RTDE), 2.0) as link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            quickest = min(_answer_time(link) for _ in range(tries))
    except OSError:
        # What drives the arm says better what is the matter.
        return
    if quickest > most:
        raise HardwareError(
            f"the robot at {host} answers after {1e3 * quickest:.0f} ms at the quickest; {1e3 * most:.0f} ms are "
            "allowed (robot.max_lead_s); nothing has moved",
            cure="connect it by a cable of its own, without radio, tunnel or busy switches in between",
        )


def _answer_time(link: socket.socket) -> float:
    begin = seconds()
    link.sendall(_VERSION_QUESTION)
    size = int.from_bytes(exactly(link, 2), "big")
    exactly(link, size - 2)
    return seconds() - begin


def exactly(link: socket.socket, size: int) -> bytes:
    """Return the next ``size`` bytes of a connection.

    Raises:
        OSError: It was closed before, or they did not come in time.
    """
    data = b""
    while len(data) < size:
        piece = link.recv(size - len(data))
        if not piece:
            raise OSError("the connection was closed")
        data += piece
    return data


def stop_by_script(host: str, deceleration: float, *, timeout: float = 0.2) -> None:
    """Send ``stopj`` to the script port on a connection of its own: it replaces whatever program runs."""
    # Where even this finds no robot, the watchdog has stopped it.
    with contextlib.suppress(OSError), socket.create_connection((host, 30003), timeout) as link:
        link.sendall(f"stopj({deceleration:.3f})\n".encode())
        link.shutdown(socket.SHUT_WR)
        link.settimeout(timeout)
        link.recv(4096)
