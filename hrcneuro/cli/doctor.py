"""What this machine offers and whether it can keep a study: versions, libraries, room, and a test of the cache."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import __version__
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options
from hrcneuro.errors import HrcError

if TYPE_CHECKING:
    from hrcneuro.cache.store import Store
    from hrcneuro.config.settings import Settings

_REQUIREMENT = re.compile(r"^(?P<name>[\w.-]+)(?:\[(?P<extras>[^\]]*)\])?\s*(?:>=(?P<least>[\d.]+))?")
_EXTRA = re.compile(r"extra\s*==\s*['\"](?P<extra>[\w-]+)['\"]")
_LOW_DISK_GB = 5.0
_LOW_MEMORY_GB = 3.0


@command(
    "Say what this machine offers: versions, libraries, extras, room, and a test of the cache.",
    "doctor",
    "doctor --json",
    name="doctor",
)
def doctor(options: Options) -> int:
    """Print what this machine offers, and what is wrong with it; return 0 where nothing is, else 1."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline.workdir import Workdir

    view = examine(lambda: bring.settings(options), Workdir(options.workdir).cache.root)
    code = exit_code(view)
    if options.json:
        print(json.dumps({"command": "doctor", "ok": code == 0, **view}, indent=1))
        return code
    print("\n".join(lines(view)))
    for kind in ("notes", "problems"):
        for text in view[kind]:
            print(f"{kind.removesuffix('s')}: {text}")
    print("everything needed is there" if code == 0 else f"{len(view['problems'])} problems")
    return code


def examine(settings: Callable[[], Settings], root: Path) -> dict[str, Any]:
    """Return what was found, with ``problems`` (something will fail) and ``notes`` (something may).

    Args:
        settings: Reads the configuration of the study, for the devices that it names.
        root: The folder of the cache; a test entry is published in it and removed.
    """
    import platform

    from hrcneuro.pipeline.executors import cores

    view: dict[str, Any] = {"problems": [], "notes": []}
    view["versions"] = {"hrcneuro": __version__, "python": platform.python_version(), "system": _system()}
    view["libraries"], view["extras"] = _packages(view["problems"])
    view["blas"] = _blas()
    view["cores"] = cores()
    view["memory_gb"] = _memory()
    view["disk_free_gb"] = _free(root)
    view["cache_test"] = _try_cache(root, view["notes"])
    try:
        view["devices"] = _devices(settings())
    except HrcError as error:
        view["devices"] = {}
        view["problems"].append(error.problem)
    view["problems"] += [f"cache: {name}: {said}" for name, said in view["cache_test"].items() if said != "ok"]
    _judge_room(view)
    return view


def lines(view: dict[str, Any]) -> list[str]:
    """Return the findings as text for a person."""
    rows = [("", name, text) for name, text in view["versions"].items()]
    rows += [("libraries", name, text) for name, text in view["libraries"].items()]
    rows += [("extras", name, text) for name, text in view["extras"].items()]
    rows += [("numerics", pool["name"], f"{pool['version']}, {pool['threads']} threads") for pool in view["blas"]]
    rows += [("room", "cores", str(view["cores"]))]
    rows += [
        ("room", "memory", _gigabytes(view["memory_gb"])),
        ("room", "disk, free", _gigabytes(view["disk_free_gb"])),
    ]
    rows += [("cache", name, said) for name, said in view["cache_test"].items()]
    rows += [("devices", name, said) for name, said in view["devices"].items()]
    text, section = [], ""
    for head, name, value in rows:
        text.append(f"{head if head != section else '':<10} {name:<16} {value}".rstrip())
        section = head
    return text


def _system() -> str:
    import platform

    return f"{platform.system()} {platform.release()} {platform.machine()}"


def _packages(problems: list[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the versions of what must be there, and of each extra whether it is."""
    import importlib.metadata

    from hrcneuro.cache import fingerprint

    needed: dict[str, str] = {}
    missing: dict[str, list[str]] = {}
    for text in importlib.metadata.requires("hrcneuro") or ():
        match, extra = _REQUIREMENT.match(text), _EXTRA.search(text)
        if match is None or match["name"] == "hrcneuro":
            continue
        version = fingerprint.version(match["name"])
        if extra is not None:
            missing.setdefault(extra["extra"], []).extend([match["name"]] * (version == "absent"))
            continue
        needed[match["name"]] = version
        if version == "absent" or _older(version, match["least"] or "0"):
            problems.append(f"{match['name']} is {version}; needed: {match['least'] or 'any version'} or newer")
    extras = {
        name: f"absent: {', '.join(absent)}  (pip install 'hrcneuro[{name}]')" if absent else "present"
        for name, absent in sorted(missing.items())
    }
    return needed, extras


def _older(version: str, least: str) -> bool:
    def numbers(text: str) -> list[int]:
        return [int(n) for n in re.findall(r"\d+", text)[:3]]

    return numbers(version) < numbers(least)


def _blas() -> list[dict[str, Any]]:
    """Return the thread pools of the numeric libraries; a worker of the pipeline holds each of them to one thread."""
    import numpy  # noqa: F401  loads its BLAS
    import scipy.linalg  # noqa: F401  loads its own
    from threadpoolctl import threadpool_info

    pools = {}
    for pool in threadpool_info():
        name = str(pool.get("internal_api") or pool.get("user_api"))
        pools[Path(pool["filepath"]).name] = {
            "name": name,
            "version": str(pool.get("version") or "of unknown version"),
            "threads": pool["num_threads"],
            "architecture": str(pool.get("architecture") or ""),
        }
    return list(pools.values())


def _memory() -> float:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    except (ValueError, OSError, AttributeError):
        return float("nan")


def _free(root: Path) -> float:
    while not root.exists() and root != root.parent:
        root = root.parent
    return shutil.disk_usage(root).free / 1e9


def _judge_room(view: dict[str, Any]) -> None:
    if view["disk_free_gb"] < _LOW_DISK_GB:
        view["notes"].append(f"only {view['disk_free_gb']:.1f} GB of disk are free; the whole study writes about 5 GB")
    if view["memory_gb"] < _LOW_MEMORY_GB * view["cores"]:
        view["notes"].append(
            f"{view['memory_gb']:.1f} GB of memory for {view['cores']} cores; where it runs out, use fewer workers (-j)"
        )


def _gigabytes(value: float) -> str:
    return f"{value:.1f} GB"


def _try_cache(root: Path, notes: list[str]) -> dict[str, str]:
    """Return step -> ``ok`` or what went wrong, of an entry's whole life in the cache's own file system."""
    import tempfile

    from hrcneuro.cache.store import Store

    steps: dict[str, Callable[[Store], None]] = {
        "write, publish": _publish,
        "read, verify": _read_back,
        "notice damage": _damage,
        "lock": _lock,
        "rename": _rename,
    }
    new = not root.exists()
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".doctor-", dir=root) as folder:
            store = Store(Path(folder))
            notes += [flaw] if (flaw := store.flaw_of_locks(root)) else []
            return {name: _attempt(lambda step=step: step(store)) for name, step in steps.items()}  # type: ignore[misc]
    except OSError as error:
        return {"write, publish": f"{root} cannot be written: {error.strerror}"}
    finally:
        # Who only asks wants no folder.
        with contextlib.suppress(OSError):
            root.rmdir() if new else None


def _attempt(step: Callable[[], None]) -> str:
    try:
        step()
    except Exception as error:
        return f"{type(error).__name__}: {error}".splitlines()[0]
    return "ok"


_ENTRY = ("doctor", "test", "0" * 16)


def _publish(store: Store) -> None:
    from hrcneuro.cache.record import Record

    with store.workspace(*_ENTRY) as work:
        (work / "data.bin").write_bytes(bytes(range(256)) * 4096)
        store.publish(Record(*_ENTRY, {}, {}), work)


def _read_back(store: Store) -> None:
    if store.lookup(*_ENTRY, verify=True) is None:
        raise OSError("what was written is not what is read")


def _damage(store: Store) -> None:
    path = store.folder(*_ENTRY) / "data.bin"
    path.write_bytes(b"\xff" + path.read_bytes()[1:])
    if store.lookup(*_ENTRY, verify=True) is not None:
        raise OSError("a changed byte was not noticed")
    store.quarantine(*_ENTRY)


def _lock(store: Store) -> None:
    from hrcneuro.cache.locks import Lock

    place = store.root / "lock"
    mine, other = Lock(place), Lock(place)
    if not mine.take():
        raise OSError("a lock that nobody holds cannot be taken")
    try:
        if other.take():
            other.release()
            raise OSError("two could hold the same lock: on this file system, start only one run at a time")
    finally:
        mine.release()


def _rename(store: Store) -> None:
    old, new = store.root / "old", store.root / "new"
    for folder in (old, new):
        folder.mkdir()
        (folder / folder.name).touch()
    aside = store.root / "aside"
    new.rename(aside)
    old.rename(new)
    if not (new / "old").exists() or not (aside / "new").exists():
        raise OSError("a renamed folder does not hold its files")
    before = time.time_ns()
    (new / "now").touch()
    if abs((new / "now").stat().st_mtime_ns - before) > 60_000_000_000:
        raise OSError("the file system's clock is more than a minute off this machine's")


def _devices(settings: Settings) -> dict[str, str]:
    """Return what is said about the arm that the configuration names; a simulated one is always there."""
    robot = settings.sections["robot"]
    if robot.backend == "sim" or not robot.host:
        return {"arm": f"{robot.backend}, in this process" if robot.backend == "sim" else f"{robot.backend}, no host"}
    return {"arm": f"{robot.backend} at {robot.host}: {_ports(robot.host, (29999, 30003, 30004))}"}


def _ports(host: str, ports: Iterable[int]) -> str:
    # A connection that is opened and closed: nothing is sent, so nothing can move.
    import socket

    closed = []
    for port in ports:
        try:
            socket.create_connection((host, port), timeout=1).close()
        except OSError:
            closed.append(str(port))
    return f"no answer on port {', '.join(closed)}" if closed else "answers"


def exit_code(view: dict[str, Any]) -> int:
    """Return 0 where everything needed is there and works, else 1."""
    return 1 if view["problems"] else 0
