"""URScript's functions that PolyScope writes at the head of every program: how inputs and outputs are set up.

Analog domains count; what inputs and outputs do when a program starts or stops is taken and checked, but not done.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hrcneuro.ur10.memory import BITS, Io
from hrcneuro.ur10.urscript.values import index


def configuration(io: Io) -> dict[str, Callable[..., Any]]:
    """Return the functions by their names in a script."""
    return {**_domains(io), **_actions(), **_run_states(), "set_safety_mode_transition_hardness": _hardness}


def _domains(io: Io) -> dict[str, Callable[..., Any]]:
    def set_standard_analog_input_domain(port: int, domain: int) -> None:
        io.analog_types = _with(io.analog_types, index(port, 2), index(domain, 2))

    def set_tool_analog_input_domain(port: int, domain: int) -> None:
        io.tool_analog_types = _with(io.tool_analog_types, index(port, 2), index(domain, 2))

    def set_analog_outputdomain(port: int, domain: int) -> None:
        io.analog_types = _with(io.analog_types, 2 + index(port, 2), index(domain, 2))

    def set_analog_inputrange(port: int, range: int) -> None:
        # Before there were domains. Ports 0 and 1 are the box's, volts in any range: 1 and 3, which reach below zero,
        # are no longer supported, and PolyScope only says so. Of the tool's ranges, 2 is 4 … 20 mA.
        index(range, 4)
        if index(port, 4) < 2:
            set_standard_analog_input_domain(port, 1)
        else:
            set_tool_analog_input_domain(port - 2, 0 if range == 2 else 1)

    functions = (
        set_standard_analog_input_domain, set_tool_analog_input_domain, set_analog_outputdomain, set_analog_inputrange
    )  # fmt: skip
    return {function.__name__: function for function in functions}


def _actions() -> dict[str, Callable[..., Any]]:
    def action_of(size: int) -> Callable[[int, str], None]:
        def set_action(port: int, action: str) -> None:
            index(port, size)

        return set_action

    sizes = {"standard_digital": 8, "configurable_digital": 8, "tool_digital": 2, "gp_boolean": BITS}
    return {
        "set_input_actions_to_default": lambda: None,
        **{f"set_{kind}_input_action": action_of(size) for kind, size in sizes.items()},
    }


def _run_states() -> dict[str, Callable[..., Any]]:
    def choice_of(size: int) -> Callable[[int, int], None]:
        def set_choice(outputId: int, state: int) -> None:
            index(outputId, size)
            index(state, 8)

        return set_choice

    sizes = {
        "standard_digital": 8, "configurable_digital": 8, "tool_digital": 2, "standard_analog": 2, "gp_boolean": BITS
    }  # fmt: skip
    return {
        "set_runstate_outputs": lambda outputs: None,
        **{f"set_runstate_{kind}_output_to_value": choice_of(size) for kind, size in sizes.items()},
    }


def _hardness(type: int) -> None:
    index(type, 2)


def _with(types: int, bit: int, domain: int) -> int:
    return types & ~(1 << bit) | domain << bit
