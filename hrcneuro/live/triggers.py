"""Trigger ports: a code on a parallel port or a serial trigger box, by byte-triggers."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from hrcneuro.contract import option
from hrcneuro.errors import HardwareError


@dataclass(frozen=True)
class TriggerOptions:
    """Where triggers go."""

    port: str = option(
        "none",
        "parallel: a parallel port; serial: a trigger box that takes bytes; mock: nowhere, to try the rest",
        choices=("none", "parallel", "serial", "mock"),
        keyed=False,
    )
    address: str = option("", "of the port, such as /dev/parport0, /dev/ttyUSB0 or COM3", keyed=False)
    move_code: int = option(1, "code of a motion onset", low=1, high=255, keyed=False)
    pulse_ms: float = option(
        10.0, "how long a code stands before it returns to 0", unit="ms", low=1.0, high=500.0, keyed=False
    )


def mistakes(options: TriggerOptions, name: str) -> list[str]:
    """Return the contradictions between values; ``name`` is the options' in the configuration."""
    if options.port in ("parallel", "serial") and not options.address:
        return [f"{name}.port = {options.port!r} needs {name}.address, such as /dev/parport0 or /dev/ttyUSB0"]
    return []


class TriggerPort:
    """A port; a context manager.

    byte-triggers waits in ``signal`` until the code has returned to 0 (version 0.4.1), longer than a cycle of the
    robot's loop lasts: so a thread of its own does the waiting.

    Attributes:
        delays_s: From the call of :meth:`signal` to the code on the port, of each, seconds.
    """

    def __init__(
        self,
        options: TriggerOptions,
        clock: Callable[[], float],
        *,
        failed: Callable[[HardwareError], object] = lambda error: None,
    ) -> None:
        """Open it.

        Args:
            options: Which port.
            clock: Seconds.
            failed: Is told once, in the port's own thread, that a code did not go out; it must not wait.

        Raises:
            HardwareError: byte-triggers is not installed, or the port cannot be opened.
        """
        self._port, self._clock = _opened(options), clock
        self._options, self._failed = options, failed
        self.delays_s: list[float] = []
        self._codes: queue.SimpleQueue[tuple[int, float] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="triggers", daemon=True)
        self._thread.start()

    def __enter__(self) -> TriggerPort:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._codes.put(None)
        self._thread.join(2.0)
        with contextlib.suppress(Exception):
            self._port.close()

    def signal(self, code: int) -> None:
        """Let a code stand on the port, and return at once."""
        self._codes.put((code, self._clock()))

    def _write(self) -> None:
        told = False
        while (job := self._codes.get()) is not None:
            code, asked = job
            self.delays_s.append(self._clock() - asked)
            try:
                self._port.signal(code)
            except Exception as error:
                # The next codes are tried all the same.
                if not told:
                    told = True
                    self._failed(self._fault(code, error))

    def _fault(self, code: int, error: Exception) -> HardwareError:
        why = (str(error) or type(error).__name__).splitlines()[0]
        return HardwareError(
            f"the {self._options.port} trigger port {self._options.address!r} did not take code {code}: {why}",
            cure="see that the box is plugged in; codes may be missing until a new start opens the port again",
        )


def _opened(options: TriggerOptions) -> Any:
    try:
        from byte_triggers import MockTrigger, ParallelPortTrigger
    except ImportError as error:
        raise HardwareError(
            "triggers go out through byte-triggers, which is not installed",
            cure="pip install 'hrcneuro[triggers]', or do without them: port = 'none'",
        ) from error
    if options.port == "mock":
        return MockTrigger()
    # byte-triggers knows one serial device by name, and speaks to it as to any that takes bytes.
    kind = "pport" if options.port == "parallel" else "arduino"
    try:
        return ParallelPortTrigger(options.address, port_type=kind, delay=round(options.pulse_ms))
    except Exception as error:
        raise HardwareError(
            f"the {options.port} trigger port {options.address!r} cannot be opened: {str(error).splitlines()[0]}",
            cure="see that the box is plugged in, that the address is right, and that your account may use it (groups "
            "lp and dialout)",
        ) from error
