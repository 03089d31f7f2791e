"""Helpers: a controller without sockets, one in a process of its own on a loopback address of its own, and a client."""

from __future__ import annotations

import itertools
import os
import select
import socket
import struct
import subprocess
import sys
import time

from hrcneuro.ur10.commands import Commands, compile_names
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.urscript.runtime import compiled

_numbers = itertools.count(1)


class Robot:
    """A controller, its log, and a way to run scripts on it."""

    def __init__(self, **options):
        self.controller = Controller(**options)
        Commands(self.controller)
        self.log = []
        self.controller.listeners.append(lambda kind, text: self.log.append((kind, text)))

    def compile(self, script):
        return compiled(script, *compile_names(self.controller))

    def run(self, script, seconds=20.0):
        """Run a script until it ends, at most ``seconds``; return what it wrote."""
        self.controller.start(self.compile(script))
        self.controller.cycle()
        until = self.controller.now + seconds
        while self.controller.program is not None and self.controller.now < until:
            self.controller.cycle()
        return [text for kind, text in self.log if kind == "text"]

    def wait(self, seconds):
        for _ in range(round(seconds / 0.008)):
            self.controller.cycle()

    @property
    def errors(self):
        return [text for kind, text in self.log if kind == "error"]


def new_address():
    """Return a loopback address that no other test uses."""
    return f"127.0.{1 + os.getpid() % 250}.{next(_numbers) % 250 + 1}"


class Served:
    """A controller in a process of its own."""

    def __init__(self, *options):
        self.address = new_address()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", self.address, "--json",
             "--until-stdin-closes", *options],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        assert b'"ok": true' in self.process.stdout.readline()

    def connect(self, port):
        link = socket.create_connection((self.address, port), 5.0)
        link.settimeout(5.0)
        return link

    def ask(self, *lines, port=29999):
        """Return the answers of the dashboard (or the port for faults), a line each."""
        with self.connect(port) as link, link.makefile("rwb") as file:
            if port == 29999:
                file.readline()
            answers = []
            for line in lines:
                file.write(line.encode() + b"\n")
                file.flush()
                answers.append(file.readline().decode().strip())
            return answers

    def fault(self, *lines):
        assert self.ask(*lines, port=29998) == ["ok"] * len(lines)

    def end(self):
        self.process.stdin.close()
        code = self.process.wait(10)
        self.process.stdout.close()
        return code


class Stream:
    """A client of port 30003."""

    def __init__(self, served):
        self.link = served.connect(30003)

    def packet(self):
        """Return the next packet's numbers."""
        (size,) = struct.unpack(">i", self._exactly(4))
        return struct.unpack(f">{(size - 4) // 8}d", self._exactly(size - 4))

    def _exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self.link.recv(size - len(data))
            assert piece, "the controller closed the connection"
            data += piece
        return data

    def newest(self):
        """Return the newest packet, those that were not read yet left out."""
        while True:
            packet = self.packet()
            if not select.select([self.link], [], [], 0.0)[0]:
                return packet

    def until(self, condition, seconds=10.0):
        """Return the first packet that meets ``condition``."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            packet = self.packet()
            if condition(packet):
                return packet
        raise AssertionError("no packet met the condition in time")
