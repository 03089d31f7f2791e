"""Trigger channels: which values are triggers, and when they are taken instead of annotations."""

from __future__ import annotations

import mne
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.errors import ConfigError
from hrcneuro.sources.recording import Recording, markers_of
from hrcneuro.sources.triggers import choose_markers, triggers_of

FS = 100.0
SAMPLES = 2000


def line(*pulses: tuple[int, int, int], rest: int = 0) -> np.ndarray:
    """Return a channel with pulses (first sample, first after, value)."""
    values = np.full(SAMPLES, rest)
    for start, stop, value in pulses:
        values[start:stop] = value
    return values


def read(values: np.ndarray) -> list[tuple[int, int]]:
    found = triggers_of(values, "STI")
    return list(zip(found.samples.tolist(), found.codes.tolist(), strict=True))


@pytest.mark.parametrize(
    ("pulses", "expected"),
    [
        pytest.param([(100, 110, 5), (200, 210, 6)], [(100, 5), (200, 6)], id="pulses"),
        pytest.param([(100, 101, 5), (200, 201, 6)], [(100, 5), (200, 6)], id="pulses of one sample"),
        pytest.param([(100, 200, 5), (200, 300, 6)], [(100, 5), (200, 6)], id="held codes"),
        pytest.param([(99, 100, 16), (100, 110, 17)], [(100, 17)], id="a step up"),
        pytest.param([(98, 99, 16), (99, 100, 20), (100, 110, 17)], [(100, 17)], id="two steps up"),
        pytest.param([(98, 100, 16), (100, 110, 17)], [(100, 17)], id="a step of two samples"),
        pytest.param([(100, 110, 17), (110, 111, 16)], [(100, 17)], id="a step down"),
        pytest.param([(97, 100, 16), (100, 110, 17)], [(97, 16), (100, 17)], id="three samples are a code"),
        pytest.param([(100, 101, 16), (101, 102, 17)], [(101, 17)], id="steps only: the last is the settled one"),
        pytest.param([(100, 110, 5), (111, 120, 5)], [(100, 5)], id="a dip of one code"),
        pytest.param([(100, 110, 5), (111, 120, 6)], [(100, 5), (111, 6)], id="two codes with a short rest"),
        pytest.param([(100, 110, 5), (113, 120, 5)], [(100, 5), (113, 5)], id="a rest of three samples"),
        pytest.param([(100, 101, 5), (102, 103, 5)], [(100, 5), (102, 5)], id="short pulses near each other"),
        pytest.param([(100, 110, 5), (110, 111, 7), (111, 120, 5)], [(100, 5)], id="a flicker"),
        pytest.param([(0, 10, 9), (100, 110, 5)], [(100, 5)], id="on from before the recording"),
        pytest.param([], [], id="silence"),
    ],
)
def test_which_values_are_triggers(pulses, expected):
    assert read(line(*pulses)) == expected


def test_steps_are_noted():
    found = triggers_of(line((99, 100, 16), (100, 110, 17), (199, 200, 16), (200, 210, 17)), "STI")
    assert found.notes == [
        "STI: codes that hold for one or two samples beside another are steps of one trigger: 16 × 2"
    ]


def test_a_code_that_holds_where_the_recording_goes_on_is_none():
    found = triggers_of(line((0, 10, 9), (100, 110, 5), (500, 520, 7), (600, 610, 5)), "STI", joins=[500])
    assert found.codes.tolist() == [5, 5]
    assert found.notes == ["STI holds a code where a segment begins, which is left out: 7 × 1, 9 × 1"]


def test_a_line_that_is_pulled_up_comes_back_to_rest_in_steps():
    pulses = [(a, a + 10, 246) for a in range(100, 1900, 150)]
    steps = [(start - 1, start, 247) for start, _, _ in pulses] + [(stop, stop + 1, 254) for _, stop, _ in pulses]
    assert read(line(*pulses, *steps, rest=255)) == [(start, 246) for start, _, _ in pulses]


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(3, 40), st.integers(1, 255), st.integers(3, 40)), max_size=20),
)
def test_clean_pulses_are_found_as_mne_finds_them(plan):
    at, pulses = 50, []
    for width, code, rest in plan:
        pulses.append((at, at + width, code))
        at += width + rest
    values = line(*pulses)
    raw = mne.io.RawArray(
        values[None].astype(float), mne.create_info(["STI"], FS, "stim", verbose="error"), verbose="error"
    )
    events = mne.find_events(raw, "STI", verbose="error") if pulses else np.zeros((0, 3), int)
    assert read(values) == [(int(sample), int(code)) for sample, _, code in events]


@pytest.mark.parametrize("rest", [255, -32768, 65280, 1])
def test_a_line_that_does_not_rest_at_zero(rest):
    pulses = [(at, at + 5, rest + 1 + at % 300 // 100) for at in range(100, 1900, 100)]
    found = triggers_of(line(*pulses, rest=rest), "STI")
    assert found.samples.tolist() == [at for at, _, _ in pulses]
    assert found.codes.tolist() == [code for _, _, code in pulses]
    assert f"STI rests at {rest}, not at 0: a trigger is what differs from {rest}" in found.notes


def test_a_pulled_up_line_has_its_triggers_where_it_falls():
    recording = study(stim={"STI 014": line((300, 305, 0), (900, 905, 0), rest=1)})
    choose_markers(recording)
    assert recording.markers.to_numpy().tolist() == [[3.0, "zero"], [9.0, "zero"]]


def test_codes_that_are_held_have_no_rest():
    values = line((0, 800, 1), (800, 1000, 2), (1000, 1800, 1), (1800, 2000, 3))
    assert read(values) == [(800, 2), (1000, 1), (1800, 3)]


def study(
    stim: dict[str, np.ndarray] | None = None, annotations: list[tuple[float, str]] | None = None, **more
) -> Recording:
    names = ["Cz", *(stim or {})]
    data = np.vstack([np.zeros(SAMPLES), *(stim or {}).values()]).astype(float)
    onsets, events = zip(*annotations, strict=True) if annotations else ([], [])
    kinds = ["eeg"] + ["stim"] * len(stim or {})
    return Recording(data, names, kinds, FS, markers_of(list(onsets), list(events)), **more)


TWO = line((300, 310, 1), (900, 910, 2))
TWICE = [(1.0, "go"), (5.0, "go")]
REMARK = [(1.0, "eyes closed"), (5.0, "coughs")]


@pytest.mark.parametrize(
    ("annotations", "source", "events", "note"),
    [
        ([], "auto", ["1", "2"], "markers taken from the trigger channel STI 014"),
        (TWICE, "auto", ["go", "go"], "trigger channel STI 014 left aside: 1 × 1, 2 × 1; acquire.markers = 'channel'"),
        (REMARK, "auto", ["1", "2"], "annotations left aside: eyes closed × 1, coughs × 1; acquire.markers = 'annot"),
        (TWICE, "channel", ["1", "2"], "annotations left aside: go × 2"),
        (REMARK, "annotations", ["eyes closed", "coughs"], ""),
        (TWICE, "STI 014", ["1", "2"], "annotations left aside: go × 2"),
    ],
)
def test_annotations_or_channel(annotations, source, events, note):
    recording = study({"STI 014": TWO}, annotations)
    choose_markers(recording, source)
    assert recording.markers["event"].tolist() == events
    assert any(note in one for one in recording.notes) == bool(note)


def test_a_silent_channel_takes_no_remark_away():
    recording = study({"STI 014": line()}, REMARK)
    choose_markers(recording)
    assert recording.markers["event"].tolist() == ["eyes closed", "coughs"]
    assert recording.notes == []


def test_of_known_channels_the_first_that_has_triggers():
    recording = study({"STI 014": TWO, "STI101": line(), "STATUS": line((50, 60, 3))})
    choose_markers(recording)
    assert recording.markers["event"].tolist() == ["1", "2"]
    assert "other trigger channels left aside: STATUS" in recording.notes


def test_single_lines_are_the_bits_of_one_code():
    lines = {f"STI00{bit}": line() for bit in range(1, 9)}
    lines["STI001"] = line((300, 310, 5), (900, 910, 5))
    lines["STI003"] = line((900, 910, 5), (1500, 1510, 5))
    recording = study(lines)
    choose_markers(recording)
    assert recording.markers["event"].tolist() == ["1", "5", "4"]
    assert any("STI001 … (bits of one code)" in note for note in recording.notes)


def test_several_unknown_channels_are_not_chosen_by_chance():
    stim = {"left": line((300, 310, 1)), "right": line((900, 910, 1))}
    with pytest.raises(
        ConfigError, match=r"several trigger channels hold triggers: left: 1 × 1; right: 1 × 1"
    ) as caught:
        choose_markers(study(stim))
    assert "acquire.markers = 'left'" in caught.value.cure
    recording = study(stim)
    choose_markers(recording, "right")
    assert recording.markers.to_numpy().tolist() == [[9.0, "1"]]
    recording = study(stim, REMARK)
    choose_markers(recording)
    assert recording.markers["event"].tolist() == ["eyes closed", "coughs"]
    assert [note[:35] for note in recording.notes] == [
        "trigger channel left left aside: 1 ",
        "trigger channel right left aside: 1",
    ]


def test_a_mask_leaves_the_bits_that_count():
    recording = study({"STI 014": line((300, 310, 0x0105), (900, 910, 0x0200))})
    choose_markers(recording, mask=255)
    assert recording.markers.to_numpy().tolist() == [[3.0, "5"]]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("STI O14", r"acquire\.markers = 'STI O14' \(did you mean 'STI 014'\?\); allowed: auto, annotations, channel"),
        ("Cz", r"or a trigger channel: STI 014"),
        ("chanel", r"did you mean 'channel'"),
    ],
)
def test_a_wrong_source_names_what_there_is(source, message):
    with pytest.raises(ConfigError, match=message):
        choose_markers(study({"STI 014": TWO}), source)


def test_a_channel_that_is_not_there():
    with pytest.raises(ConfigError, match=r"has no trigger channel: Cz \(eeg\)"):
        choose_markers(study(), "channel")


def test_the_channels_name_in_the_file_will_do():
    recording = study({"Triggers": TWO}, file_names={"Triggers": "Trig In"})
    choose_markers(recording, "Trig In")
    assert recording.markers["event"].tolist() == ["1", "2"]
