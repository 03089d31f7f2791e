"""URScript's functions for field buses: Modbus signals, the controller's own ports, Euromap67.

No device is on the other end: signals are named and written, and a program that reads one goes wrong, as it does on a
robot whose device does not answer. Ports are memory. No Euromap67 is built in: its inputs are off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.ur10.memory import Memory
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.values import Values, index

_PORTS = 1 << 16
_EUROMAP = 32  # bits


def fieldbus(memory: Memory) -> dict[str, Callable[..., Any]]:
    """Return the functions by their names in a script."""
    return {**_modbus(memory.modbus), **_ports(memory.ports), **_euromap(memory)}


def _modbus(signals: set[str]) -> dict[str, Callable[..., Any]]:
    def modbus_add_signal(
        IP: str, slave_number: int, signal_address: int, signal_type: int, signal_name: str,
        sequential_mode: bool = False, register_count: int = 1,
    ) -> None:  # fmt: skip
        signals.add(signal_name)

    def known(signal_name: str) -> None:
        if signal_name not in signals:
            raise ScriptError(f"runtime error: no Modbus signal {signal_name!r}: modbus_add_signal names it")

    def modbus_delete_signal(signal_name: str) -> None:
        known(signal_name)
        signals.remove(signal_name)

    def modbus_get_signal_status(signal_name: str, is_secondary_program: bool = False) -> None:
        known(signal_name)
        raise ScriptError(f"runtime error: Modbus signal {signal_name!r} is not valid: no device answers")

    return {
        "modbus_add_signal": modbus_add_signal,
        "modbus_delete_signal": modbus_delete_signal, "modbus_get_signal_status": modbus_get_signal_status,
        "modbus_send_custom_command": lambda IP, slave_number, function_code, data: None,
        "modbus_set_output_register": lambda signal_name, register_value, is_secondary_program=0: known(signal_name),
        "modbus_set_output_signal": lambda signal_name, digital_value, is_secondary_program=0: known(signal_name),
        "modbus_set_signal_update_frequency": lambda signal_name, update_frequency: known(signal_name),
        "modbus_set_runstate_dependent_choice": lambda signal_name, runstate_choice: known(signal_name),
        "modbus_set_digital_input_action": lambda signal_name, action: known(signal_name),
    }  # fmt: skip


def _ports(registers: dict[int, int]) -> dict[str, Callable[..., Any]]:
    def write_port_bit(address: int, value: bool) -> None:
        at, bit = divmod(index(address, _PORTS), 16)
        word = registers.get(at, 0) & ~(1 << bit)
        registers[at] = word | Values.boolean(value) << bit

    def write_port_register(address: int, value: int) -> None:
        registers[index(address, _PORTS)] = int(value) & 0xFFFF

    def read_port_register(address: int) -> int:
        word = registers.get(index(address, _PORTS), 0)
        return word - (word >> 15 << 16)

    return {
        "read_port_bit": lambda address: bool(
            registers.get(index(address, _PORTS) // 16, 0) >> index(address, _PORTS) % 16 & 1
        ),
        "read_port_register": read_port_register,
        "write_port_bit": write_port_bit, "write_port_register": write_port_register,
    }  # fmt: skip


def _euromap(memory: Memory) -> dict[str, Callable[..., Any]]:
    io = memory.io

    def set_euromap_output(port_number: int, signal_value: bool) -> None:
        bit = 1 << index(port_number, _EUROMAP)
        io.euromap_out = io.euromap_out | bit if Values.boolean(signal_value) else io.euromap_out & ~bit

    def get_euromap_input(port_number: int) -> bool:
        index(port_number, _EUROMAP)
        return False

    def set_euromap_runstate_dependent_choice(port_number: int, runstate_choice: int) -> None:
        index(port_number, _EUROMAP)
        index(runstate_choice, 3)

    functions: Sequence[Callable[..., Any]] = (
        set_euromap_output, get_euromap_input, set_euromap_runstate_dependent_choice
    )  # fmt: skip
    return {
        "get_euromap_output": lambda port_number: bool(io.euromap_out >> index(port_number, _EUROMAP) & 1),
        **{function.__name__: function for function in functions},
    }
