"""Each fault that the documentation says is refused before a recording, brought about and named."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from virtual_streams import Amplifier, Sender, VirtualNetwork

from hrcneuro.errors import HardwareError
from hrcneuro.live import preparation
from hrcneuro.live.parameters import Declared, RecordOptions, check_record, undeclared

PAGE = Path(__file__).parents[2] / "docs" / "recording.md"
EEG = Declared(type="EEG", sfreq=100.0, channels=("a", "b"), unit="microvolts")
OPTIONS = RecordOptions(streams={"eeg": EEG, "markers": Declared(name="moves", type="Markers")}, wait_s=1.0, look_s=2.0)


def house(*, amplifier=None, markers=True, twin=False, **sender):
    """Return a network with an amplifier as described."""
    eeg = Sender(**sender)
    network = VirtualNetwork(eeg, *([Sender("moves", "Markers", source_id="robot")] if markers else []))
    if twin:
        network.outlets.append(Sender(source_id="two"))
    if amplifier is not None:
        Amplifier(network, eeg, **amplifier)
    return network


def blocked():
    network = house(amplifier={})
    network.outlets[1].connects = False
    return network


FAULTS = {
    "missing": lambda: house(amplifier={}, markers=False),
    "doubled": lambda: house(amplifier={}, twin=True),
    "no connection": blocked,
    "other rate": lambda: house(amplifier={}, sfreq=500.0),
    "other channels": lambda: house(amplifier={}, labels=("a", "c")),
    "other unit": lambda: house(amplifier={"scale": 1e-5}, unit="volts"),
    "not moving": house,
    "flat": lambda: house(amplifier={"scale": 0.0}),
    "railed": lambda: house(amplifier={"scale": 1e6}),
}


def prepared(network, options=OPTIONS):
    return preparation.prepare(network, network.clock, network.wait, options)


def test_streams_as_they_should_be_pass():
    opened = prepared(house(amplifier={}))
    assert opened.problems == []
    assert list(opened.inlets) == ["eeg", "markers"]


@pytest.mark.parametrize("after_s", [0.0, 0.5])
def test_a_twin_that_is_seen_only_a_look_later_is_refused(after_s):
    network = house(amplifier={})
    twin = Sender(source_id="two")
    Amplifier(network, twin)
    seen, looks = network.visible, []

    def visible():
        looks.append(network.now)
        return [*seen(), *([twin.description] if len(looks) > 1 and network.now >= looks[0] + after_s else [])]

    network.visible = visible
    assert [(one.kind, one.stream) for one in prepared(network).problems] == [("doubled", "eeg")]


@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_is_refused_and_its_cause_named(kind):
    opened = prepared(FAULTS[kind](), replace(OPTIONS, rail_uv=1e5 if kind == "railed" else 0.0))
    assert {one.kind for one in opened.problems} == {kind}
    with pytest.raises(HardwareError, match=kind) as refused:
        preparation.refuse(opened.problems)
    assert refused.value.exit_code == 4


def test_the_documentation_lists_each_fault():
    rows = re.findall(r"^\| `([a-z ]+)` \|", PAGE.read_text(), re.MULTILINE)
    assert set(rows) >= set(FAULTS)


def test_all_problems_are_told_at_once():
    network = house(labels=("a", "c"), sfreq=500.0, markers=False)
    kinds = [one.kind for one in prepared(network).problems]
    assert kinds == ["missing", "other rate", "other channels", "not moving"]


def test_a_rate_that_is_stated_and_not_kept_is_told_with_both_figures():
    network = house(amplifier={"rate": 97.0})
    (problem,) = prepared(network).problems
    assert "states 100 Hz and comes at 97 Hz" in problem.text


def test_what_is_no_number_is_no_signal():
    assert {one.kind for one in prepared(house(amplifier={"scale": float("nan")})).problems} == {"flat"}


def test_channels_that_may_be_flat_are_named_in_the_configuration():
    network = house(amplifier={"scale": 0.0})
    eeg = replace(EEG, flat=("a", "b"))
    assert prepared(network, replace(OPTIONS, streams={"eeg": eeg})).problems == []


def test_a_stream_that_appears_while_it_is_looked_for_is_taken():
    network = house(amplifier={}, markers=False)

    def appear(now):
        if now > 1000.6 and len(network.outlets) == 1:
            network.outlets.append(Sender("moves", "Markers"))

    network.on_wait.append(appear)
    assert prepared(network).problems == []


def test_microvolts_by_any_name_are_microvolts():
    assert prepared(house(amplifier={}, unit="uV")).problems == []


@pytest.mark.parametrize(
    ("values", "mistake"),
    [
        ({"streams": {"eeg": Declared()}}, "neither name nor type"),
        ({"streams": {"eeg": Declared(type="EEG", channels=("a",), n_channels=2)}}, "n_channels = 2"),
        ({"streams": {"eeg": Declared(type="EEG", channels=("a", "a"))}}, "names 'a' twice"),
        ({"folder": ""}, "folder is empty"),
        ({"streams": {}, "others": False}, "records nothing"),
    ],
)
def test_contradictions_of_the_configuration(values, mistake):
    assert any(mistake in one for one in check_record(RecordOptions(**values)))
    assert np.size(check_record(RecordOptions())) == 0


@pytest.mark.parametrize(
    ("streams", "said"),
    [
        ({}, False),
        ({"streams": {"eeg": Declared(type="EEG")}}, True),
        ({"streams": {"eeg": Declared(type="EEG"), "keys": Declared(type="Markers")}}, False),
        ({"streams": {"eeg": Declared(type="EEG"), "mine": Declared(name="hrcneuro-moves")}}, False),
        ({"streams": {}}, True),
    ],
)
def test_that_no_markers_are_declared_is_said(streams, said):
    assert ("no stream of markers is declared" in undeclared(RecordOptions(**streams))) == said
