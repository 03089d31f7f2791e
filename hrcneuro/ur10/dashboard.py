"""One client of port 29999: a line in, a line out ("Dashboard server, CB-series", Universal Robots)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePosixPath
from typing import ClassVar

from hrcneuro.ur10.controller import (
    EMERGENCY,
    IDLE,
    NORMAL,
    POWER_OFF,
    POWER_ON,
    PROTECTIVE,
    RUNNING,
    SAFEGUARD,
    Controller,
)
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled

WELCOME = "Connected: Universal Robots Dashboard Server\n"
_LONGEST = 8192
_ROBOT_MODES = {POWER_OFF: "POWER_OFF", POWER_ON: "POWER_ON", IDLE: "IDLE", RUNNING: "RUNNING"}
_SAFETY_MODES = {
    NORMAL: "NORMAL", PROTECTIVE: "PROTECTIVE_STOP", SAFEGUARD: "SAFEGUARD_STOP", EMERGENCY: "ROBOT_EMERGENCY_STOP"
}  # fmt: skip


class DashboardSession:
    """One connection; programs that can be loaded come from ``programs``, a mapping of file names to scripts."""

    def __init__(
        self,
        controller: Controller,
        send: Callable[[bytes], None],
        *,
        programs: dict[str, str],
        compile: Callable[[str], Compiled],
    ) -> None:
        """Welcome the client."""
        self._c, self._send, self._programs, self._compile = controller, send, programs, compile
        self._buffer = b""
        self._role = ""
        self.closed = False
        send(WELCOME.encode())

    def feed(self, data: bytes) -> None:
        """Answer the lines that ``data`` completes."""
        self._buffer += data
        while b"\n" in self._buffer and not self.closed:
            line, self._buffer = self._buffer.split(b"\n", 1)
            text = line.decode("utf-8", "replace").strip()
            if text:
                self._send((self._answer(text) + "\n").encode())
        if len(self._buffer) > _LONGEST:
            self._buffer = b""
            self.closed = True

    def _answer(self, text: str) -> str:
        low = text.lower()
        for name, handler in self._COMMANDS.items():
            if low == name or low.startswith(name + " "):
                return handler(self, text[len(name) :].strip())
        return f"could not understand: {text}"

    def _load(self, argument: str) -> str:
        if not argument:
            return "File not found: "
        name = PurePosixPath(argument).name
        if name not in self._programs:
            return f"File not found: {argument}"
        try:
            self._compile(self._programs[name])
        except ScriptError as error:
            return f"Error while loading program: {argument}: {error}"
        self._c.stop_program()
        self._c.loaded = name
        return f"Loading program: {argument}"

    def _play(self, argument: str) -> str:
        c = self._c
        if c.program is not None and c.resume():
            return "Starting program"
        if c.loaded not in self._programs or c.robot_mode != RUNNING or c.safety_mode != NORMAL:
            return "Failed to execute: play"
        c.start(self._compile(self._programs[c.loaded]))
        return "Starting program"

    def _stop(self, argument: str) -> str:
        self._c.stop_program()
        return "Stopped"

    def _pause(self, argument: str) -> str:
        return "Pausing program" if self._c.pause() else "Failed to execute: pause"

    def _quit(self, argument: str) -> str:
        self.closed = True
        return "Disconnected"

    def _shutdown(self, argument: str) -> str:
        self._c.power_off()
        return "Shutting down"

    def _running(self, argument: str) -> str:
        return f"Program running: {str(self._c.runtime_state == 2).lower()}"

    def _robot_mode(self, argument: str) -> str:
        return f"Robotmode: {_ROBOT_MODES[self._c.robot_mode]}"

    def _safety_mode(self, argument: str) -> str:
        return f"Safetymode: {_SAFETY_MODES[self._c.safety_mode]}"

    def _program_state(self, argument: str) -> str:
        name = self._c.loaded or "<unnamed>"
        return f"{({2: 'PLAYING', 4: 'PAUSED'}).get(self._c.runtime_state, 'STOPPED')} {name}"

    def _loaded(self, argument: str) -> str:
        return f"Loaded program: /programs/{self._c.loaded}" if self._c.loaded else "No program loaded"

    def _popup(self, argument: str) -> str:
        self._c.popup = argument
        self._c.tell("popup", argument)
        return "showing popup"

    def _close_popup(self, argument: str) -> str:
        self._c.popup = ""
        return "closing popup"

    def _close_safety_popup(self, argument: str) -> str:
        self._c.safety_popup = ""
        return "closing safety popup"

    def _log(self, argument: str) -> str:
        self._c.tell("text", argument)
        return "Added log message"

    def _saved(self, argument: str) -> str:
        return f"true {self._c.loaded}" if self._c.loaded else "false"

    def _version(self, argument: str) -> str:
        return "URSoftware " + ".".join(map(str, self._c.version)) + " (Jan 01 2019)"

    def _set_role(self, argument: str) -> str:
        roles = ("programmer", "operator", "none", "locked", "restricted")
        if argument.lower() not in roles:
            return f"Failed setting user role: {argument}"
        self._role = argument.upper()
        return f"Setting user role: {self._role}"

    def _get_role(self, argument: str) -> str:
        return self._role or "PROGRAMMER"

    def _power_on(self, argument: str) -> str:
        self._c.power_on()
        return "Powering on"

    def _power_off(self, argument: str) -> str:
        self._c.power_off()
        return "Powering off"

    def _brake_release(self, argument: str) -> str:
        self._c.release_brakes()
        return "Brake releasing"

    def _unlock(self, argument: str) -> str:
        if self._c.unlock_protective_stop():
            return "Protective stop releasing"
        return (
            "Cannot unlock protective stop until 5s after occurrence. "
            "Always inspect cause of protective stop before unlocking"
        )

    def _restart_safety(self, argument: str) -> str:
        self._c.emergency_stop(False)
        self._c.power_off()
        return "Restarting safety"

    def _model(self, argument: str) -> str:
        return "UR10"

    def _serial(self, argument: str) -> str:
        return "20183000000"

    def _remote(self, argument: str) -> str:
        # The CB series has no remote control mode.
        return "could not understand: is in remote control"

    def _installation(self, argument: str) -> str:
        return f"Loading installation: {argument}" if argument else "File not found: "

    # Longest names first where one is the beginning of another.
    _COMMANDS: ClassVar[dict[str, Callable[[DashboardSession, str], str]]] = {
        "load installation": _installation, "load": _load, "play": _play, "stop": _stop, "pause": _pause,
        "quit": _quit, "shutdown": _shutdown, "running": _running, "robotmode": _robot_mode,
        "get loaded program": _loaded, "popup": _popup, "close popup": _close_popup,
        "close safety popup": _close_safety_popup, "addtolog": _log, "isprogramsaved": _saved,
        "programstate": _program_state, "polyscopeversion": _version, "setuserrole": _set_role,
        "getuserrole": _get_role, "power on": _power_on, "power off": _power_off, "brake release": _brake_release,
        "safetymode": _safety_mode, "safetystatus": _safety_mode, "unlock protective stop": _unlock,
        "restart safety": _restart_safety, "get robot model": _model, "get serial number": _serial,
        "is in remote control": _remote,
    }  # fmt: skip
