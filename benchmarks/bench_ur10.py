"""How punctual the simulated UR10 is, how soon it rests when its driver dies, and an hour without drift; a script.

Figures on sockets mean something on an idle machine only. ``--minutes N`` streams and commands in real time for longer.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

import numpy as np

from hrcneuro.ur10.commands import Commands, compile_names
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.server import Server
from hrcneuro.ur10.streams import realtime, state
from hrcneuro.ur10.urscript.runtime import compiled

WAVE = (
    "def wave():\nwhile True:\nspeedj([0.2,0.1,0,0,0,0],5,0.4)\nspeedj([-0.2,-0.1,0,0,0,0],5,0.4)\n"
    "write_output_integer_register(0, 1)\nend\nend\n"
)
DRIVER = """
from hrcneuro.robot.backends import connect
arm, clock = connect("ur", host={host!r}, driver={driver!r})
begin = clock.now()
for i in range(10 ** 6):
    clock.wait_until(begin + 0.008 * i)
    arm.speed([0.4, 0.0, 0.3, 0.0, 0.0, 0.0])
"""


def packets(host: str, stop: threading.Event, found: list[tuple[float, ...]]) -> None:
    with socket.create_connection((host, 30003)) as link, link.makefile("rb") as stream:
        while not stop.is_set():
            found.append(struct.unpack(">138d", stream.read(1108)[4:]))


def hour() -> None:
    controller = Controller()
    Commands(controller)
    controller.start(compiled(WAVE, *compile_names(controller)))
    for _ in range(10_000):
        controller.cycle()
    gc.collect()
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    for i in range(450_000):
        controller.cycle()
        realtime(controller)
        if i % 12 == 0:
            state(controller)
    took = time.perf_counter() - start
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    controller.stop_program()
    for _ in range(125):
        controller.cycle()
    drift = max(abs(a - b) for a, b in zip(controller.arm.target_q, controller.arm.q, strict=True))
    print(f"an hour of streaming, virtual clock    {took:9.1f} s   {1e6 * took / 450_000:.0f} µs a cycle, "
          f"memory +{grown} kB, joints off their targets {drift:.1e} rad")  # fmt: skip


def lateness(seconds: float) -> None:
    """Serve in this process, with a streaming and commanding client in another thread's socket."""

    async def run() -> Server:
        server = Server(Controller())
        await server.start("127.0.9.9")
        reader, writer = await asyncio.open_connection("127.0.9.9", 30003)
        begin = asyncio.get_running_loop().time()
        while asyncio.get_running_loop().time() < begin + seconds:
            await reader.readexactly(1108)
            writer.write(
                b"speedj([0,0,0.01,0,0,0],5,0.1)\n" if int(time.time()) % 2 else b"speedj([0,0,-0.01,0,0,0],5,0.1)\n"
            )
        writer.close()
        await server.close()
        return server

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    server = asyncio.run(run())
    late = 1e3 * np.array(server.lateness)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(f"tick lateness over {seconds:.0f} s, client on 30003  p50 {np.percentile(late, 50):.2f}  p99 "
          f"{np.percentile(late, 99):.2f}  most {late.max():.2f} ms; {server.skipped} skipped; memory +{grown} kB; "
          f"{len(late) / seconds:.2f} Hz")  # fmt: skip


def kills(driver: str, times: int) -> None:
    host, rests = f"127.0.9.{10 + (driver == 'rtde')}", []
    serve = [sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", host, "--json", "--until-stdin-closes"]
    server = subprocess.Popen(serve, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    server.stdout.readline()
    stop, found = threading.Event(), []
    thread = threading.Thread(target=packets, args=(host, stop, found))
    thread.start()
    for _ in range(times):
        victim = subprocess.Popen(
            [sys.executable, "-c", DRIVER.format(host=host, driver=driver)], stdout=subprocess.DEVNULL
        )
        while not found or abs(found[-1][37] - 0.4) > 0.01:
            time.sleep(1e-3)
        time.sleep(0.1)
        victim.send_signal(signal.SIGKILL)
        begin = found[-1][0]
        victim.wait()
        while max(map(abs, found[-1][37:43])) > 5e-3:
            time.sleep(1e-3)
        rests.append(next(p[0] for p in found if p[0] > begin and max(map(abs, p[37:43])) <= 5e-3) - begin)
        time.sleep(0.2)
    stop.set()
    thread.join()
    server.stdin.close()
    server.wait()
    print(f"SIGKILL of the {driver} driver to rest      {min(rests):9.3f} … {max(rests):.3f} s   "
          f"{sum(r <= 0.25 for r in rests)} of {times} within 0.25 s")  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=0.25)
    options.add_argument("--kills", type=int, default=5)
    given = options.parse_args()
    try:
        os.setpriority(os.PRIO_PROCESS, 0, -15)
    except OSError:
        print("note: no right to a higher priority")
    print(f"load {os.getloadavg()[0]:.1f}")
    hour()
    lateness(60 * given.minutes)
    for driver in ("script", "rtde"):
        kills(driver, given.kills)


if __name__ == "__main__":
    main()
