"""What this machine offers and whether it can keep a study: versions, libraries, room, and a test of the cache."""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import __version__
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options
from hrcneuro.errors import HrcError

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.disk_forecast import DiskForecast

_REQUIREMENT = re.compile(r"^(?P<name>[\w.-]+)(?:\[(?P<extras>[^\]]*)\])?\s*(?:>=(?P<least>[\d.]+))?")
_EXTRA = re.compile(r"extra\s*==\s*['\"](?P<extra>[\w-]+)['\"]")
_LOW_DISK_GB = 8.0
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
    from hrcneuro.pipeline import disk_forecast
    from hrcneuro.pipeline.workdir import Workdir

    def wanted() -> DiskForecast:
        settings = bring.settings(options)
        return disk_forecast.expected(workdir, bring.planned(options, settings), settings)

    workdir = Workdir(options.workdir)
    view = examine(lambda: bring.settings(options), workdir.cache.root, wanted)
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


def examine(
    settings: Callable[[], Settings], root: Path, wanted: Callable[[], DiskForecast] | None = None
) -> dict[str, Any]:
    """Return what was found, with ``problems`` (something will fail) and ``notes`` (something may).

    Args:
        settings: Reads the configuration of the study, for the devices that it names.
        root: The folder of the cache; a test entry is published in it and removed.
        wanted: Returns how much disk the study still wants.
    """
    import platform

    from hrcneuro.cache.disk import free_bytes
    from hrcneuro.cache.trial import try_cache
    from hrcneuro.pipeline.executors import cores

    view: dict[str, Any] = {"problems": [], "notes": []}
    view["versions"] = {"hrcneuro": __version__, "python": platform.python_version(), "system": _system()}
    view["libraries"], view["extras"] = _packages(view["problems"])
    view["blas"] = _blas()
    view["cores"] = cores()
    view["memory_gb"] = _memory()
    view["disk_free_gb"] = free_bytes(root) / 1e9
    view["cache_test"] = try_cache(root, view["notes"])
    try:
        view["devices"] = _devices(settings())
    except HrcError as error:
        view["devices"] = {}
        view["problems"].append(error.problem)
    view["problems"] += [f"cache: {name}: {said}" for name, said in view["cache_test"].items() if said != "ok"]
    view["disk_wanted_gb"] = None
    if wanted is not None:
        # A study that cannot be planned says so where it is asked for.
        with contextlib.suppress(HrcError):
            _judge_disk(view, wanted())
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
    if view.get("disk_wanted_gb") is not None:
        estimate = ", in part estimated" if view.get("disk_estimated_gb") else ", by what earlier runs wrote"
        rows += [("room", "disk, wanted", f"{view['disk_wanted_gb']:.3g} GB more{estimate}")]
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


def _judge_disk(view: dict[str, Any], disk: DiskForecast) -> None:
    view["disk_wanted_gb"] = disk.size / 1e9 if disk.size or not disk.unknown else None
    view["disk_estimated_gb"] = disk.estimated / 1e9
    if disk.enough is False:
        view["problems"].append(str(disk))


def _judge_room(view: dict[str, Any]) -> None:
    if view["disk_free_gb"] < _LOW_DISK_GB and view["disk_wanted_gb"] is None:
        view["notes"].append(f"only {view['disk_free_gb']:.1f} GB of disk are free; the whole study writes about 8 GB")
    if view["memory_gb"] < _LOW_MEMORY_GB * view["cores"]:
        view["notes"].append(
            f"{view['memory_gb']:.1f} GB of memory for {view['cores']} cores; where it runs out, use fewer workers (-j)"
        )


def _gigabytes(value: float) -> str:
    return f"{value:.1f} GB"


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
