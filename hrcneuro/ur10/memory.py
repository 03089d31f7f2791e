"""What programs, clients and the panel share: registers, inputs and outputs, payload."""

from __future__ import annotations

from dataclasses import dataclass, field

INTEGERS = DOUBLES = 48
BITS = 128
FLAGS = 32


def _ints() -> list[int]:
    return [0] * INTEGERS


def _doubles() -> list[float]:
    return [0.0] * DOUBLES


def _bits() -> list[bool]:
    return [False] * BITS


@dataclass
class Bank:
    """One direction's general purpose registers."""

    ints: list[int] = field(default_factory=_ints)
    doubles: list[float] = field(default_factory=_doubles)
    bits: list[bool] = field(default_factory=_bits)

    def word(self, first: int) -> int:
        """Return 32 bits as a number."""
        return sum(1 << i for i in range(32) if self.bits[first + i])

    def set_word(self, first: int, value: int) -> None:
        """Set 32 bits from a number."""
        self.bits[first : first + 32] = [bool(value >> i & 1) for i in range(32)]


@dataclass
class Io:
    """The control box's and the tool's inputs and outputs. Bits: 0–7 standard, 8–15 configurable, 16–17 tool."""

    digital_in: int = 0
    digital_out: int = 0
    analog_in: list[float] = field(default_factory=lambda: [0.0, 0.0])  # V or A
    analog_out: list[float] = field(default_factory=lambda: [0.0, 0.0])
    analog_types: int = 0b1111  # bits 0, 1 inputs, 2, 3 outputs; 0 current, 1 voltage
    tool_analog_in: list[float] = field(default_factory=lambda: [0.0, 0.0])
    tool_analog_types: int = 0b11  # 0 current, 1 voltage
    tool_voltage: int = 0
    euromap_out: int = 0  # no Euromap67 is built in: bits that go nowhere

    def set_out(self, bit: int, value: bool) -> None:
        """Set one digital output."""
        self.digital_out = self.digital_out | 1 << bit if value else self.digital_out & ~(1 << bit)


@dataclass
class Encoder:
    """What counts a conveyor's ticks: ``counts`` of them from ``lowest`` on; none while it is not enabled."""

    ticks: int = 0
    lowest: int = 0
    counts: int = 0


@dataclass
class Memory:
    """What a controller remembers between cycles and shares among programs and clients."""

    inputs: Bank = field(default_factory=Bank)
    outputs: Bank = field(default_factory=Bank)
    io: Io = field(default_factory=Io)
    payload: float = 0.0  # kg
    cog: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # m
    inertia: list[float] = field(default_factory=lambda: [0.0] * 6)  # kg m²: xx, yy, zz, xy, xz, yz
    flags: list[bool] = field(default_factory=lambda: [False] * FLAGS)
    ports: dict[int, int] = field(default_factory=dict)  # registers of the Modbus server, 16 bits each
    encoders: list[Encoder] = field(default_factory=lambda: [Encoder(), Encoder()])
    modbus: set[str] = field(default_factory=set)  # names of signals; no device is asked
    masks: dict[str, int] = field(default_factory=dict)  # of RTDE's masked outputs, applied with their values
