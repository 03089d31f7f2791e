"""A SLURM cluster of one node on this machine, of Debian's packages, in a folder of its own; for root alone.

Without accounting, as small clusters are. It ends with whoever started it.
"""

import contextlib
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

PROGRAMS = ("slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "scancel", "munged")
CONFIGURATION = """
ClusterName=lab
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
# More jobs at a time than there are cores: tests hold some of them.
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1,batch_sched_delay=0
KillWait=5
OverTimeLimit=0
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory_mb} State=UNKNOWN
PartitionName=lab Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def _end_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


_BOUND = {"start_new_session": True, "preexec_fn": _end_with_parent}


def why_not():
    """Return why no cluster can be started here; empty where one can."""
    missing = [name for name in PROGRAMS if not _program(name)]
    if missing:
        return f"{', '.join(missing)} not installed (apt-get install slurm-wlm munge)"
    if os.geteuid():
        return "only root may start SLURM's daemons"
    return ""


@contextlib.contextmanager
def slurm(folder, *, cores=2):
    """Yield the environment in which SLURM's commands, and what submits jobs, run."""
    folder = Path(folder)
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir(parents=True)
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    memory_mb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
    (folder / "slurm.conf").write_text(
        CONFIGURATION.format(
            folder=folder, host=socket.gethostname(), controller=_port(), node=_port(), cores=cores, memory_mb=memory_mb
        )
    )
    started = []
    try:
        started.append(_munged(folder))
        for daemon in ("slurmctld", "slurmd"):
            with (folder / f"{daemon}.out").open("w") as log:
                command = [_program(daemon), "-D"]
                started.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log, **_BOUND))
        _wait_until_idle(environment)
        yield environment
    finally:
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            subprocess.run(["scancel", "--state=RUNNING", "--user=root"], env=environment, timeout=30, check=False)
        for process in reversed(started):
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _munged(folder):
    """Start munge with a key of its own, beside any that the machine has."""
    place = folder / "munge"
    key = place / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    place.chmod(0o711)
    options = {
        "key-file": key, "socket": folder / "munge.socket", "pid-file": place / "pid", "log-file": place / "log",
        "seed-file": place / "seed",
    }  # fmt: skip
    process = subprocess.Popen(
        [_program("munged"), "--foreground", "--force", *(f"--{name}={value}" for name, value in options.items())],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        **_BOUND,
    )
    deadline = time.monotonic() + 20
    while not (folder / "munge.socket").exists():
        assert process.poll() is None, "munged ended at once"
        assert time.monotonic() < deadline, "munged did not start"
        time.sleep(0.05)
    return process


def _wait_until_idle(environment):
    deadline = time.monotonic() + 60
    while True:
        done = subprocess.run(["sinfo", "-h", "-o", "%t"], env=environment, capture_output=True, text=True, check=False)
        if done.stdout.strip() == "idle":
            return
        assert time.monotonic() < deadline, f"SLURM did not start: {done.stdout} {done.stderr}"
        time.sleep(0.2)


def _program(name):
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def _port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]
