"""The controller's sockets and its clock: one asyncio loop, a cycle every 8 ms on an absolute schedule."""

from __future__ import annotations

import asyncio
import sys
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from hrcneuro.errors import HardwareError
from hrcneuro.ur10 import dashboard, internal, messages, rtde, streams
from hrcneuro.ur10.arm import CYCLE
from hrcneuro.ur10.commands import Commands, compile_names
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.faults import Fault, Network, Schedule
from hrcneuro.ur10.loading import Loadable
from hrcneuro.ur10.modes import Notice
from hrcneuro.ur10.ports import FaultPort, ScriptPort
from hrcneuro.ur10.punctuality import Punctuality
from hrcneuro.ur10.sockets import Sockets
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled, compiled

DASHBOARD, PRIMARY, SECONDARY, REALTIME, RTDE, FAULTS = 29999, 30001, 30002, 30003, 30004, 29998
_BACKLOG = 1 << 17  # bytes a client may leave unread before packets are left out
_LATE = 0.5  # s behind, after which cycles are skipped, not made up for
_QUICK = 2000  # characters of a script that are translated on the spot, …
_QUICK_ONES = 10  # … so many in a cycle; the others in their turn, …
_MOST_WAITING = 100  # … which has an end
_PIECE = 4096  # bytes that are read of a client at once
_MOST_CLIENTS = 32  # on one port


class _Session(Protocol):
    def feed(self, data: bytes) -> None: ...


class _Connection(asyncio.BufferedProtocol):
    """One client: a transport and a session. What it sends is taken in small pieces, with cycles in between."""

    def __init__(self, server: Server, port: int) -> None:
        self._server = server
        self._piece = bytearray(_PIECE)
        self.port = port
        self.transport: asyncio.Transport | None = None
        self.session: _Session | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        self._server.join(self)

    def connection_lost(self, error: Exception | None) -> None:
        self._server.leave(self)

    def get_buffer(self, sizehint: int) -> bytearray:
        """Return where the next piece goes."""
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        """Hand what has come to the protocol, piece by piece."""
        if self.session is not None and not self._closing:
            try:
                self.session.feed(bytes(self._piece[:nbytes]))
            except rtde.ProtocolError:
                self.close()
                return
            if getattr(self.session, "closed", False):
                self.close()

    def send(self, data: bytes) -> None:
        """Send, unless the client does not read."""
        latency = self._server.network.latency
        if latency > 0.0:
            asyncio.get_running_loop().call_later(latency, self._send, data)
        else:
            self._send(data)

    def _send(self, data: bytes) -> None:
        if self.transport is not None and not self._closing and self.transport.get_write_buffer_size() < _BACKLOG:
            self.transport.write(data)

    @property
    def _closing(self) -> bool:
        return self.transport is None or self.transport.is_closing()

    def close(self) -> None:
        """Close the connection; what was sent still goes out."""
        if self.transport is not None:
            self.transport.close()

    def abort(self) -> None:
        """Cut the connection."""
        if self.transport is not None:
            self.transport.abort()


class Server:
    """A controller on the network."""

    def __init__(
        self,
        controller: Controller,
        *,
        faults: Sequence[Fault] = (),
        programs: Loadable | None = None,
        open_network: bool = False,
    ) -> None:
        """Take over ``controller``; ``programs`` are what the dashboard can load.

        Scripts may open sockets to this machine, and where the network is open to any.
        """
        self.controller = controller
        self.network = Network()
        self.punctuality = Punctuality()
        self._sockets = Sockets(anywhere=open_network)
        Commands(controller, self._sockets)
        self._names = compile_names(controller)
        self._schedule = Schedule(controller, self.network, faults)
        self._programs = programs or Loadable()
        self._clients: dict[int, list[_Connection]] = {
            port: [] for port in (DASHBOARD, PRIMARY, SECONDARY, REALTIME, RTDE, FAULTS)
        }
        self._taken: dict[str, rtde.RtdeSession] = {}
        self._translator = ThreadPoolExecutor(1, "translate")
        self._translating: deque[asyncio.Future[Compiled]] = deque()
        self._servers: list[asyncio.Server] = []
        self._next = 0.0
        self._quick = 0  # programs translated on the spot in this cycle
        controller.outlets.append(self._tell)

    async def start(self, address: str) -> None:
        """Listen on ``address`` and begin the cycles.

        Raises:
            HardwareError: A port is taken, or the address is not this machine's.
        """
        loop = asyncio.get_running_loop()
        # Translating a long program in the other thread must not hold the interpreter for a whole cycle.
        sys.setswitchinterval(5e-4)
        try:
            for port in self._clients:
                self._servers.append(
                    await loop.create_server(lambda port=port: _Connection(self, port), address, port)  # type: ignore[misc]
                )
        except OSError as error:
            await self.close()
            raise HardwareError(
                f"the controller cannot listen on {address}:{port}: {error.strerror or error}",
                cure="stop what listens there, or give another address of this machine: --address 127.0.0.3",
            ) from None
        self._next = loop.time() + CYCLE
        loop.call_at(self._next, self._cycle)

    async def close(self) -> None:
        """Cut all connections and stop listening."""
        for clients in self._clients.values():
            for client in list(clients):
                client.abort()
        for server in self._servers:
            server.close()
        self._servers = []
        self._sockets.close_all()
        self._translator.shutdown(wait=False, cancel_futures=True)

    def join(self, client: _Connection) -> None:
        """Take a new client."""
        c = self.controller
        if len(self._clients[client.port]) >= _MOST_CLIENTS:
            client.abort()
            return
        self._clients[client.port].append(client)
        if client.port == DASHBOARD:
            client.session = dashboard.DashboardSession(
                c,
                client.send,
                programs=self._programs.scripts,
                refused=self._programs.refused,
                compile=self._compiled,
            )
        elif client.port == RTDE:
            client.session = rtde.RtdeSession(c, self._taken, client.send)
        elif client.port == FAULTS:
            client.session = FaultPort(self._schedule, client.send)
        else:
            client.session = ScriptPort(self._run)
            if client.port != REALTIME:
                client.send(messages.version(c))

    def leave(self, client: _Connection) -> None:
        """Take a client out of those that are served."""
        if isinstance(client.session, rtde.RtdeSession):
            client.session.close()
        if client in self._clients[client.port]:
            self._clients[client.port].remove(client)

    def _compiled(self, script: str) -> Compiled:
        return compiled(script, *self._names)

    def _run(self, script: str) -> None:
        if internal.obey(self.controller, script):
            return
        # Scripts run in the order in which they came, so a short one waits for a long one before it.
        loop = asyncio.get_running_loop()
        if len(self._translating) >= _MOST_WAITING:
            self.controller.tell("error", "Too many programs at a time: one was not started")
            return
        self._quick += 1
        if len(script) > _QUICK or self._translating or self._quick > _QUICK_ONES:
            future = loop.run_in_executor(self._translator, self._compiled, script)
            self._translating.append(future)
            future.add_done_callback(lambda _: self._start_translated())
            return
        try:
            self.controller.start(self._compiled(script))
        except ScriptError as error:
            self.controller.refuse(error)

    def _start_translated(self) -> None:
        while self._translating and self._translating[0].done():
            future = self._translating.popleft()
            if future.cancelled():
                continue
            try:
                self.controller.start(future.result())
            except ScriptError as error:
                self.controller.refuse(error)

    def _tell(self, notice: Notice) -> None:
        if self._clients[PRIMARY]:
            packet = messages.message(self.controller, notice)
            if notice.kind == "safety":
                # Nobody is told a mode that the last state message contradicts.
                packet = streams.state(self.controller) + packet
            for client in self._clients[PRIMARY]:
                client.send(packet)

    def _cycle(self) -> None:
        loop = asyncio.get_running_loop()
        now = loop.time()
        self.punctuality.add(now - self._next)
        if now - self._next > _LATE:
            self.punctuality.skipped += int((now - self._next) / CYCLE)
            self._next = now
        self._next += CYCLE
        if self._servers:
            # Before the work: whatever goes wrong in one cycle, the next one comes.
            loop.call_at(self._next, self._cycle)
        self.tick()

    def tick(self) -> None:
        """Go on by a cycle, and send what is due."""
        c, network = self.controller, self.network
        self._quick = 0
        self._schedule.cycle()
        c.cycle()
        if network.cut:
            network.cut = False
            for port, clients in self._clients.items():
                for client in list(clients) if port != FAULTS else ():
                    client.abort()
        if network.loses(c.now):
            return
        for client in self._clients[RTDE]:
            assert isinstance(client.session, rtde.RtdeSession)
            client.session.tick()
        if self._clients[REALTIME]:
            packet = streams.realtime(c)
            for client in self._clients[REALTIME]:
                client.send(packet)
        if c.cycles % streams.EVERY == 0 and (self._clients[PRIMARY] or self._clients[SECONDARY]):
            packet = streams.state(c)
            for client in self._clients[PRIMARY] + self._clients[SECONDARY]:
                client.send(packet)
