"""How late the controller's cycles are, in bounded memory whatever the time it runs."""

from __future__ import annotations

_BIN = 5e-5  # s
_BINS = 2000  # the last one holds everything from 0.1 s on


class Punctuality:
    """Counts of cycles by lateness."""

    def __init__(self) -> None:
        self.cycles = self.skipped = 0
        self.most = 0.0  # s
        self._counts = [0] * _BINS

    def add(self, late: float) -> None:
        """Note a cycle that began ``late`` seconds after it was due."""
        self.cycles += 1
        self.most = max(self.most, late)
        self._counts[min(int(max(late, 0.0) / _BIN), _BINS - 1)] += 1

    def quantile(self, share: float) -> float:
        """Return the lateness, seconds, that a ``share`` of the cycles did not exceed: the upper edge of its bin."""
        seen = 0
        for i, count in enumerate(self._counts[:-1]):
            seen += count
            if seen >= share * self.cycles:
                return min((i + 1) * _BIN, self.most)
        return self.most

    def __str__(self) -> str:
        late = ", ".join(
            f"{1e3 * self.quantile(share):.2f} ({name})" for share, name in ((0.5, "median"), (0.99, "p99"))
        )
        return f"{self.cycles} cycles, {self.skipped} skipped; late by {late}, {1e3 * self.most:.2f} (most) ms"
