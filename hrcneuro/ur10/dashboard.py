"""One client of port 29999: a line in, a line out ("Dashboard server, CB-series", Universal Robots)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import PurePosixPath
from typing import ClassVar

from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.modes import EMERGENCY, IDLE, NORMAL, POWER_OFF, POWER_ON, PROTECTIVE, RUNNING, SAFEGUARD
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled

WELCOME = "Connected: Universal Robots Dashboard Server\n"
_LONGEST = 8192
_SERIAL = "20183000000"
_ALWAYS = (3, 0)
_INSTALLATION = "default.installation"  # every robot has it
_FOLDERS = (".", "/programs", "/ursim/programs")  # names of the folder of programs, on a robot and in UR's simulator
_ROBOT_MODES = {POWER_OFF: "POWER_OFF", POWER_ON: "POWER_ON", IDLE: "IDLE", RUNNING: "RUNNING"}
_SAFETY_MODES = {
    NORMAL: "NORMAL", PROTECTIVE: "PROTECTIVE_STOP", SAFEGUARD: "SAFEGUARD_STOP", EMERGENCY: "ROBOT_EMERGENCY_STOP"
}  # fmt: skip


class DashboardSession:
    """One connection; ``programs`` are what can be loaded, scripts by file name, ``refused`` why other files cannot."""

    def __init__(
        self,
        controller: Controller,
        send: Callable[[bytes], None],
        *,
        programs: Mapping[str, str],
        compile: Callable[[str], Compiled],
        refused: Mapping[str, str] | None = None,
    ) -> None:
        """Welcome the client."""
        self._c, self._send, self._programs, self._compile = controller, send, programs, compile
        self._refused = refused or {}
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
        for name, (handler, since) in self._COMMANDS.items():
            if (low == name or low.startswith(name + " ")) and self._c.version[:2] >= since:
                return handler(self, text[len(name) :].strip())
        return f"could not understand: {text}"

    def _load(self, argument: str) -> str:
        name = _file(argument)
        if name in self._refused:
            return f"Error while loading program: {argument}: {self._refused[name]}"
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
        if c.loaded not in self._programs or not c.ready:
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

    def _safety_status(self, argument: str) -> str:
        return f"Safetystatus: {_SAFETY_MODES[self._c.safety_mode]}"

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
        return _SERIAL

    def _save_log(self, argument: str) -> str:
        return "Log saved to disk"

    def _flight_report(self, argument: str) -> str:
        if argument.lower() not in ("", "controller", "software", "system"):
            return f"Failed to execute: generate flight report {argument}"
        self._c.tell("text", f"Flight report: {argument or 'system'}")
        return f"Flight Report generated with id: {int(self._c.now * 1000)}"

    def _support_file(self, argument: str) -> str:
        # Nothing is written: the controller has no disk that a client could read.
        return f"Completed successfully: ur_{_SERIAL}.zip" if argument else "Failed to execute: generate support file"

    def _installation(self, argument: str) -> str:
        name = _file(argument)
        if name != _INSTALLATION and name not in self._refused and name not in self._programs:
            return f"File not found: {argument}"
        # What an installation says is not looked at: here all robots are installed alike.
        return f"{'Loading' if name.lower().endswith('.installation') else 'Failed to load'} installation: {argument}"

    # Longest names first where one is the beginning of another; with the first software that has the command. Of
    # safetystatus UR's list does not say: it is taken to have come with the status itself. Model and serial number,
    # which came with 3.12, are told at any time: clients ask for them to know what they talk to.
    _COMMANDS: ClassVar[dict[str, tuple[Callable[[DashboardSession, str], str], tuple[int, int]]]] = {
        "load installation": (_installation, (3, 2)), "load": (_load, _ALWAYS), "play": (_play, _ALWAYS),
        "stop": (_stop, _ALWAYS), "pause": (_pause, _ALWAYS), "quit": (_quit, _ALWAYS),
        "shutdown": (_shutdown, _ALWAYS), "running": (_running, _ALWAYS), "robotmode": (_robot_mode, _ALWAYS),
        "get loaded program": (_loaded, _ALWAYS), "popup": (_popup, _ALWAYS), "close popup": (_close_popup, _ALWAYS),
        "close safety popup": (_close_safety_popup, (3, 1)), "addtolog": (_log, _ALWAYS),
        "isprogramsaved": (_saved, _ALWAYS), "programstate": (_program_state, _ALWAYS),
        "polyscopeversion": (_version, _ALWAYS), "setuserrole": (_set_role, _ALWAYS),
        "getuserrole": (_get_role, _ALWAYS), "power on": (_power_on, _ALWAYS), "power off": (_power_off, _ALWAYS),
        "brake release": (_brake_release, _ALWAYS), "safetymode": (_safety_mode, _ALWAYS),
        "safetystatus": (_safety_status, (3, 10)), "unlock protective stop": (_unlock, (3, 1)),
        "restart safety": (_restart_safety, (3, 7)), "get robot model": (_model, _ALWAYS),
        "get serial number": (_serial, _ALWAYS), "generate flight report": (_flight_report, (3, 13)),
        "generate support file": (_support_file, (3, 13)), "savelog": (_save_log, (3, 13)),
    }  # fmt: skip


def _file(argument: str) -> str:
    """Return the name of a file in the folder of programs; one elsewhere is not found."""
    path = PurePosixPath(argument)
    return path.name if str(path.parent) in _FOLDERS else ""
