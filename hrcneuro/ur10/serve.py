"""Run the simulated controller until it is told to end."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence

from hrcneuro.errors import ConfigError
from hrcneuro.ur10 import SOFTWARE
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.faults import parse
from hrcneuro.ur10.loading import Loadable, read_programs
from hrcneuro.ur10.server import Server

_PRIORITY = 20  # of 1 to 99: before all ordinary work, behind the kernel's own


def serve(
    address: str,
    *,
    powered: bool = True,
    faults: Sequence[str] = (),
    version: str = SOFTWARE,
    programs: str | None = None,
    open_network: bool = False,
    as_json: bool = False,
    quiet: bool = False,
    verbose: bool = False,
    until_stdin_closes: bool = False,
) -> int:
    """Serve on ``address`` until SIGINT or SIGTERM, or until standard input closes if asked to; return 0.

    Raises:
        ConfigError: The address is no loopback address and ``open_network`` is not set, an argument is malformed, or
            ``programs`` is no folder that can be read.
        HardwareError: The ports are taken.
    """
    _check_address(address, open_network)
    loadable = Loadable() if programs is None else read_programs(programs)
    controller = Controller(version=_version(version), powered=powered)
    if verbose:
        controller.listeners.append(lambda kind, text: print(f"{kind}: {text}", file=sys.stderr, flush=True))

    def ready() -> None:
        if as_json:
            print(json.dumps({"command": "ur10 serve", "ok": True, "address": address}), flush=True)
        elif not quiet:
            print(f"a simulated UR10 listens on {address}; Ctrl-C ends it", file=sys.stderr, flush=True)

    return asyncio.run(
        _serve(
            address,
            Server(controller, faults=[parse(text) for text in faults], programs=loadable, open_network=open_network),
            ready,
            until_stdin_closes,
            verbose,
        )
    )


async def _serve(
    address: str,
    server: Server,
    ready: Callable[[], None],
    until_stdin_closes: bool,
    verbose: bool,
) -> int:
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    if until_stdin_closes:
        # Whoever started it holds the other end, and lets go of it however it ends.
        def read() -> None:
            if not os.read(sys.stdin.fileno(), 4096):
                ended.set()

        try:
            loop.add_reader(sys.stdin.fileno(), read)
        except PermissionError:  # a file or /dev/null, which no one holds open
            ended.set()
    _run_before_other_work()
    await server.start(address)
    ready()
    try:
        await ended.wait()
    finally:
        await server.close()
        # A second signal would come to a loop that is half closed.
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
            signal.signal(number, signal.SIG_IGN)
        if verbose:
            print(server.punctuality, file=sys.stderr, flush=True)
    return 0


def _run_before_other_work() -> None:
    """Have a cycle every 8 ms, where that is allowed.

    Among ordinary programs Linux shares the processor among terminal sessions first, whatever their priority: on a busy
    machine packets came half a second late.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except (OSError, AttributeError):
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, -15)


def _check_address(address: str, open_network: bool) -> None:
    try:
        given = ipaddress.IPv4Address("127.0.0.1" if address == "localhost" else address)
    except ValueError:
        raise ConfigError(f"--address {address!r} is no IPv4 address", cure="give one such as 127.0.0.2") from None
    if not given.is_loopback and not open_network:
        raise ConfigError(
            f"--address {address} can be reached from outside this machine, and the controller trusts everyone",
            cure="give a loopback address (127.x.y.z), or say --open-network if the network is yours",
        )


def _version(text: str) -> tuple[int, int, int, int]:
    """Return major, minor, bugfix and build; what is left out at the end is 0."""
    parts = text.split(".")
    if not 2 <= len(parts) <= 4 or not all(part.isdecimal() for part in parts) or parts[0] != "3" or int(parts[1]) < 5:
        raise ConfigError(f"--software {text!r} is no CB3 software", cure="give 3.9, or 3.9.1.64192: 3.5 or later")
    major, minor, bugfix, build = map(int, (parts + ["0", "0"])[:4])
    return major, minor, bugfix, build
