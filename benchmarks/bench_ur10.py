"""How punctual the simulated UR10 is, how soon its arm rests when its driver is gone, and whether it leaks; a script.

Figures on sockets mean something on an idle machine only; where a time is late there, ``load`` says what else ran.

    python benchmarks/bench_ur10.py punctuality             a minute of streaming: tick lateness
    python benchmarks/bench_ur10.py stops --times 20        SIGKILL and cut connections, both drivers
    python benchmarks/bench_ur10.py soak --minutes 10       streaming, commanding, reconnecting: leaks and drift
    python benchmarks/bench_ur10.py hour                    the same for an hour of the virtual clock, without sockets
    python benchmarks/bench_ur10.py                         all of them, briefly
"""

from __future__ import annotations

import argparse
import contextlib
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
from collections.abc import Callable, Iterator
from pathlib import Path

from hrcneuro.ur10.commands import Commands, compile_names
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.rtde import RtdeSession
from hrcneuro.ur10.streams import realtime, state
from hrcneuro.ur10.urscript.runtime import compiled

WAVE = (
    "def wave():\nwhile True:\nspeedj([0.2,0.1,0,0,0,0],5,0.4)\nspeedj([-0.2,-0.1,0,0,0,0],5,0.4)\n"
    "write_output_integer_register(0, 1)\nend\nend\n"
)
DRIVER = """
import signal
signal.alarm(120)  # whatever becomes of the benchmark
from hrcneuro.arms import connect
arm, clock = connect("ur", host={host!r}, driver={driver!r})
print(arm._process.pid if {driver!r} == "rtde" else 0, flush=True)
begin = clock.now()
for i in range(10 ** 6):
    clock.wait_until(begin + 0.008 * i)
    arm.state()
    arm.speed([0.4, 0.0, 0.3, 0.0, 0.0, 0.0])
"""
RECIPE = b"timestamp,target_q,actual_q,actual_qd,actual_TCP_pose,runtime_state,safety_status_bits"
_hosts = iter(f"127.0.9.{i}" for i in range(10, 250))


@contextlib.contextmanager
def controller() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Serve in a process of its own; what it says of its punctuality goes to standard output."""
    host = next(_hosts)
    command = [sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", host, "--json", "--verbose",
               "--until-stdin-closes"]  # fmt: skip
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe)
    process.stdout.readline()
    try:
        yield host, process
    finally:
        process.stdin.close()
        print("   controller:", process.stderr.read().decode().strip().splitlines()[-1])
        process.wait()


class Client(threading.Thread):
    """Reads port 30003 and remembers when packets were made and came; commands a wave if asked to."""

    def __init__(self, host: str, *, commanding: bool = False, keep: int = 10**9) -> None:
        super().__init__(daemon=True)
        self.link = socket.create_connection((host, 30003), 5.0)
        self.commanding, self.keep = commanding, keep
        self.packets: list[tuple[float, ...]] = []
        self.first, self.count, self.ended = (0.0, 0.0), 0, False
        self.start()

    def run(self) -> None:
        with contextlib.suppress(OSError, ValueError), self.link.makefile("rb") as stream:
            while not self.ended:
                data = stream.read(1108)
                if len(data) < 1108:
                    break
                packet, now = struct.unpack(">138d", data[4:]), time.monotonic()
                self.count += 1
                if self.count == 1:
                    self.first = (packet[0], now)
                self.last = (packet[0], now)
                self.packets.append(packet)
                del self.packets[: -self.keep]
                if self.commanding:
                    speed = 0.01 if int(packet[0]) % 2 else -0.01
                    self.link.sendall(b"speedj([0,0,%.3f,0,0,0],5,0.1)\n" % speed)
        self.ended = True

    def close(self) -> None:
        self.ended = True
        with contextlib.suppress(OSError):
            self.link.shutdown(socket.SHUT_RDWR)
        self.join(2.0)
        self.link.close()


def punctuality(seconds: float) -> None:
    print(f"punctuality: {seconds:.0f} s, a client streams on 30003 and commands in every cycle")
    with controller() as (host, _):
        client = Client(host, commanding=True, keep=1)
        time.sleep(seconds)
        client.close()


def hour() -> None:
    robot, sent = Controller(), []
    Commands(robot)
    names = compile_names(robot)
    robot.start(compiled(WAVE, *names))
    rtde = RtdeSession(robot, {}, sent.append)
    for kind, payload in ((b"V", b"\0\2"), (b"O", struct.pack(">d", 125.0) + RECIPE),
                          (b"I", b"input_double_register_0,input_int_register_5"), (b"S", b"")):  # fmt: skip
        rtde.feed(struct.pack(">H", 3 + len(payload)) + kind + payload)

    def cycles(n: int) -> None:
        for i in range(n):
            rtde.feed(struct.pack(">HBBdi", 16, ord("U"), 1, 0.001 * i, i))
            robot.cycle()
            rtde.tick()
            realtime(robot)
            if i % 12 == 0:
                state(robot)
            if i % 500 == 0:
                robot.start(compiled(f"sec s():\nwrite_output_float_register(1, {i})\nend\n", *names))
            sent.clear()

    cycles(40_000)  # fills the cache of translated programs
    gc.collect()
    objects, memory, start = len(gc.get_objects()), rss("self"), time.process_time()
    cycles(450_000)
    took = time.process_time() - start
    gc.collect()
    grown, more = rss("self") - memory, len(gc.get_objects()) - objects
    robot.stop_program()
    for _ in range(125):
        robot.cycle()
    drift = max(abs(a - b) for a, b in zip(robot.arm.target_q, robot.arm.q, strict=True))
    print(f"hour: 450,000 cycles of streaming, commanding and programs, virtual clock, {took:.0f} s of processor time, "
          f"{1e6 * took / 450_000:.0f} µs a cycle\n   memory {grown:+d} kB, objects {more:+d}, clock "
          f"{robot.now - 0.008 * robot.cycles:+.1e} s, joints off their targets {drift:.1e} rad")  # fmt: skip


def rss(pid: str | int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize() // 1024


def usage(pid: int) -> tuple[int, int, int]:
    """Return a process's memory in kB, its descriptors and its threads."""
    return rss(pid), len(os.listdir(f"/proc/{pid}/fd")), len(os.listdir(f"/proc/{pid}/task"))


def visit(host: str, number: int) -> None:
    """Connect as other clients do, take something, and go, at times without a word."""
    for port, hello in ((29999, b"robotmode\n"), (30001, b""), (30002, b"sec s():\ntextmsg(1)\nend\n"),
                        (30004, b"\0\5V\0\2"), (30004, b"\0\2x"), (30003, b"fly(\n")):  # fmt: skip
        with contextlib.suppress(OSError), socket.create_connection((host, port), 2.0) as link:
            link.sendall(hello)
            link.recv(4096)
            if number % 2:
                link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def soak(minutes: float) -> None:
    from hrcneuro.arms import connect
    from hrcneuro.robot.backend import PLAYING

    print(f"soak: {minutes:g} min; our driver commands through ur_rtde, a client streams, others come and go")
    with controller() as (host, process):
        arm, clock = connect("ur", host=host, driver="rtde")
        watching = Client(host, keep=1)
        begin, lost, fewest, most = clock.now(), 0, (), (0,) * 6
        for cycle in range(round(60.0 * minutes / 0.008)):
            clock.wait_until(begin + 0.008 * cycle)
            if arm.state().runtime != PLAYING:
                # A machine that keeps the driver waiting for 0.1 s: the watchdog has ended the program.
                arm.close()
                lost += 1
                arm, _ = connect("ur", host=host, driver="rtde")
            arm.speed([0.0, 0.0, 0.05 if cycle // 250 % 2 else -0.05, 0.0, 0.0, 0.0])
            if cycle % 625 == 0:
                threading.Thread(target=visit, args=(host, cycle // 625), daemon=True).start()
            if cycle % 125 == 60:
                now = usage(process.pid) + usage(os.getpid())
                # The first tenth fills caches.
                fewest = fewest or (now if cycle > 7500 * minutes / 10 else ())
                most = tuple(map(max, most, now))
        last = usage(process.pid) + usage(os.getpid())
        made, came = (watching.last[i] - watching.first[i] for i in (0, 1))
        missing = round(made / 0.008) + 1 - watching.count
        arm.stop(4.0)
        arm.close()
        watching.close()
    for name, i in (("controller", 0), ("driver", 3)):
        print(f"   {name:<11}" + "; ".join(
            f"{what} {fewest[i + k]} → {last[i + k]} (most {most[i + k]})"
            for k, what in enumerate(("memory in kB", "descriptors", "threads"))
        ))  # fmt: skip
    print(f"   {watching.count} packets in {came:.1f} s, {missing} missing; the controller's clock against the "
          f"machine's {1e3 * (made - came):+.1f} ms; driver connected anew {lost} times")  # fmt: skip


def stops(times: int) -> None:
    for driver, way in (("rtde", "SIGKILL"), ("rtde", "SIGKILL of ur_rtde's process"), ("rtde", "cut"),
                        ("script", "SIGKILL"), ("script", "cut")):  # fmt: skip
        rests, moved = [], 0
        with controller() as (host, _):
            for _ in range(times):
                rest, again = stop(host, driver, way)
                rests.append(rest)
                moved += again
        print(f"stops: {driver:<7}{way:<30}{min(rests):.3f} … {max(rests):.3f} s to rest, "
              f"{sum(r <= 0.25 for r in rests)} of {times} within 0.25 s, moved again {moved}")  # fmt: skip


def stop(host: str, driver: str, way: str) -> tuple[float, bool]:
    """Return the time, by the controller's clock, to rest, and whether the arm moved again in the second after it."""
    program = DRIVER.format(host=host, driver=driver)
    client = Client(host)
    for _ in range(20):
        victim = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
        own = int(victim.stdout.readline())
        # On a machine under load the watchdog may stop a driver before the arm is under way.
        with contextlib.suppress(TimeoutError):
            wait(lambda: client.packets and abs(client.packets[-1][37] - 0.4) < 0.01, 3.0)
            break
        lose(victim)
        wait(lambda: client.packets[-1][131] == 1.0)
    begin = client.packets[-1][0]
    if way == "cut":
        with socket.create_connection((host, 29998)) as faults:
            faults.sendall(b"cut\n")
            faults.recv(10)
        wait(lambda: client.ended)
        client = Client(host)
    else:
        os.kill(own if "process" in way else victim.pid, signal.SIGKILL)
    wait(lambda: any(p[0] > begin and speed(p) < 5e-3 for p in client.packets))
    rest = next(p[0] for p in client.packets if p[0] > begin and speed(p) < 5e-3)
    wait(lambda: client.packets[-1][0] > rest + 1.0)
    again = any(speed(p) > 0.01 for p in client.packets if p[0] > rest)
    lose(victim)
    client.close()
    return rest - begin, again


def lose(victim: subprocess.Popen[bytes]) -> None:
    victim.kill()
    victim.wait()
    victim.stdout.close()


def speed(packet: tuple[float, ...]) -> float:
    return max(map(abs, packet[37:43]))


def wait(condition: Callable[[], object], seconds: float = 20.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError(f"the arm did not do it within {seconds:g} s")
        time.sleep(1e-3)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("what", nargs="?", default="all", choices=("all", "punctuality", "stops", "soak", "hour"))
    options.add_argument("--seconds", type=float, default=0.0, help="of punctuality; 60, within all 15")
    options.add_argument("--times", type=int, default=3, help="of each way to lose a driver")
    options.add_argument("--minutes", type=float, default=0.5, help="of the soak")
    given = options.parse_args()
    print(f"load {os.getloadavg()[0]:.1f}")
    if given.what in ("all", "punctuality"):
        punctuality(given.seconds or (60.0 if given.what == "punctuality" else 15.0))
    if given.what in ("all", "stops"):
        stops(given.times)
    if given.what in ("all", "soak"):
        soak(given.minutes)
    if given.what in ("all", "hour"):
        hour()
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
