"""Whether another process is at its end, seen before its files close.

Linux closes the pipes of a process that was killed only when its last thread has gone, and a thread that waits for a
busy disk may stay for a second. What the process is told, and the state of its first thread, are known at once.
"""

from __future__ import annotations

from pathlib import Path

_PROC = Path("/proc")
_KILL = 1 << 8  # SIGKILL in a mask of signals


def at_its_end(pid: int) -> bool:
    """Return whether a process has ended, or was killed and only waits for its last threads, or for its core dump.

    False where the system does not tell, as macOS: then the end of a pipe must do.
    """
    try:
        text = (_PROC / str(pid) / "status").read_text(encoding="utf-8", errors="replace")
    except (FileNotFoundError, ProcessLookupError):
        return (_PROC / "self" / "status").exists()
    except OSError:
        return False
    fields = dict(line.partition(":")[::2] for line in text.splitlines())
    pending = (int(fields.get(name, "0"), 16) for name in ("SigPnd", "ShdPnd"))
    return (
        fields.get("State", "").strip()[:1] in {"Z", "X"}
        or any(mask & _KILL for mask in pending)
        or fields.get("CoreDumping", "").strip() == "1"
    )
