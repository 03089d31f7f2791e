"""A synthetic recording of the study: continuous EEG and EOG driven by the list of moves, with its ground truth.

Read in this order: ``params`` (what can be set), ``head`` (the forward model), ``background`` (everything that goes on
without the task), ``responses`` (what the moves evoke, and which trials carry the effect), ``ocular``, ``defects``,
``generator`` (puts them together).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hrcneuro.eeg.synthetic.params import CALIBRATED_UV, EFFECTS, SyntheticParams

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic.generator import Synthetic, generate
    from hrcneuro.eeg.synthetic.responses import planted_average

__all__ = ["CALIBRATED_UV", "EFFECTS", "Synthetic", "SyntheticParams", "generate", "planted_average"]

# Numeric libraries load on first use, so that naming the parameters (configuration, --help) costs nothing.
_LAZY = {"Synthetic": "generator", "generate": "generator", "planted_average": "responses"}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
