"""Which arm it is, and how it is driven; values only, so that a configuration loads at once."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Address

from hrcneuro.contract import option


def _loopback(host: str) -> bool:
    try:
        return IPv4Address(host).is_loopback
    except ValueError:
        return False


def _where(host: str) -> str:
    """Return what a key has of an address: a simulated controller's session must not be taken for a real arm's."""
    return "" if not host else "this machine" if _loopback(host) else "an arm"


@dataclass(frozen=True)
class Connection:
    """An arm as the options name it."""

    backend: str = option(
        "sim", "the arm: sim in-process on a virtual clock, ursim a simulated controller, ur a UR10, ros behind ROS",
        choices=("sim", "ursim", "ur", "ros"),
    )  # fmt: skip
    driver: str = option(
        "rtde", "how ur and ursim are driven: ur_rtde's speedJ, or speedj lines on port 30003 as in the paper",
        choices=("rtde", "script"),
    )  # fmt: skip
    host: str = option("", "address of the arm's controller, for backend ur", private=True, keyed_as=_where)
    at_the_robot: bool = option(False, "someone stands at the arm's emergency stop: a real arm needs it", keyed=False)

    @property
    def there_once(self) -> bool:
        """Whether two sessions would share the arm: ``sim`` and ``ursim`` make one for each."""
        return self.backend not in ("sim", "ursim")

    @property
    def named_soundly(self) -> bool:
        """Whether ``host`` may be an address or a name at all."""
        try:
            self.host.encode("idna")
        except UnicodeError:
            return False
        return not any(letter.isspace() or not letter.isprintable() for letter in self.host)

    @property
    def simulated(self) -> bool:
        """Whether nothing real can move."""
        # By its number: a name that begins with 127. may stand for any robot.
        return not self.there_once or (self.backend == "ur" and _loopback(self.host))
