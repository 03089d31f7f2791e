"""A recording from preflight to footer, at virtual pace: what is lost, comes back, is cut, and what the file holds."""

import errno
import json
import os
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from virtual_streams import Amplifier, Sender, VirtualNetwork

from hrcneuro.cli.console import Console
from hrcneuro.cli.recording_view import View
from hrcneuro.live import journal, part, preparation, selfcheck, session, xdf
from hrcneuro.live.parameters import Declared, RecordOptions
from hrcneuro.live.recorder import OWN

pyxdf = pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")
OPTIONS = RecordOptions(
    streams={"eeg": Declared(type="EEG", sfreq=100.0), "markers": Declared(name="moves", type="Markers")},
    wait_s=1.0,
    look_s=1.0,
)


class AtOnce:
    """An executor that does what it is asked to before it returns."""

    def submit(self, function, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


class Later:
    """An executor that does what it is asked to when it is told to."""

    def __init__(self):
        self.asked = []

    def submit(self, function, *arguments):
        future = Future()
        self.asked.append(lambda: future.set_result(function(*arguments)))
        return future

    def work(self):
        asked, self.asked = self.asked, []
        for one in asked:
            one()


class House:
    """A network with an amplifier and markers, and a recording of them."""

    def __init__(self, folder, **sender):
        self.folder = folder
        self.eeg, self.markers = Sender(**sender), Sender("moves", "Markers", source_id="robot")
        self.network = VirtualNetwork(self.eeg, self.markers)
        self.amplifier = Amplifier(self.network, self.eeg)
        self.told = []

    def begin(self, options=OPTIONS, helper=None):
        opened = preparation.prepare(self.network, self.network.clock, self.network.wait, options)
        preparation.refuse(opened.problems)
        self.notes = journal.Journal(self.folder, {"subject": "s01"})
        number = 1 + len(list(self.folder.glob("part*.xdf")))
        path = part.path_of(self.folder, number)
        self.part = part.Part(path, started="2026-01-01T00:00:00+00:00")
        self.notes.begin({"file": path.name})
        self.session = session.Session(
            self.network, self.network.clock, opened, options, self.part, self.notes,
            tell=lambda stream, event: self.told.append((stream.key, event.kind)), helper=helper or AtOnce(),
        )  # fmt: skip
        return self

    def go_on(self, seconds):
        end = self.network.now + seconds - 1e-9
        while self.network.now < end:
            self.network.wait(0.05)
            self.session.step()

    def read(self, number=1):
        path = part.path_of(self.folder, number)
        streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False)
        return {one["info"]["name"][0]: one for one in streams}


@pytest.fixture
def house(tmp_path):
    return House(tmp_path)


def test_all_that_is_sent_is_in_the_file_with_its_stamps(house):
    house.begin()
    sent = house.amplifier.sent
    house.go_on(3)
    house.markers.push([house.network.now], [["move/trial=1"]])
    house.go_on(7)
    house.session.close()
    file = house.read()
    eeg = file["amp"]
    np.testing.assert_array_equal(eeg["time_series"][:, 0], np.arange(sent, house.amplifier.sent))
    np.testing.assert_array_equal(eeg["time_stamps"], 1000.0 + np.arange(sent, house.amplifier.sent) / 100)
    assert file["moves"]["time_series"] == [["move/trial=1"]]
    assert eeg["footer"]["info"]["sample_count"] == [str(len(eeg["time_stamps"]))]
    assert len(file[OWN]["time_stamps"]) == 0
    assert house.told == []
    assert "hostname" not in eeg["info"]
    about = journal.read(house.folder)["parts"][0]
    assert about["state"] == journal.ENDED
    assert about["streams"]["eeg"]["samples"] == len(eeg["time_stamps"])
    assert all(one.whole for one in selfcheck.check(house.folder))


def test_the_names_of_machines_stay_where_that_is_configured(house):
    house.begin(replace(OPTIONS, host_name=True))
    house.session.close()
    assert house.read()["amp"]["info"]["hostname"] == ["lab"]


def test_a_chunk_that_comes_late_is_told_so_and_all_is_whole(house):
    house.begin()
    house.go_on(1)
    inlet = house.eeg.inlets[-1]
    house.network.wait(0.05)
    held, inlet.waiting = inlet.waiting, []
    house.go_on(0.2)
    inlet.waiting[:0] = held
    house.go_on(1)
    house.session.close()
    assert house.told == [("eeg", "gap"), ("eeg", "late")]
    assert all(one.whole for one in selfcheck.check(house.folder))
    assert journal.read(house.folder)["parts"][0]["streams"]["eeg"]["missing"] == 0


def test_lost_samples_are_told_marked_and_counted(house):
    house.begin()
    house.go_on(2)
    first = house.amplifier.sent + 30
    house.amplifier.skip = set(range(first, first + 7))
    house.go_on(3)
    house.session.close()
    assert house.told == [("eeg", "gap")]
    mark = house.read()[OWN]
    assert mark["time_series"][0][0].startswith("gap/stream=eeg/samples=7/")
    # Stamped with the last sample before it.
    assert mark["time_stamps"][0] == pytest.approx(1000.0 + (first - 1) / 100)
    checked = {one.stream: one for one in selfcheck.check(house.folder)}
    assert (checked["eeg"].missing, checked["eeg"].gaps, checked["eeg"].whole) == (7, 1, False)
    assert checked["markers"].whole


@pytest.mark.parametrize("source_id", ["one", "another", ""])
def test_an_amplifier_that_dies_and_comes_back_is_taken_up_and_the_gap_is_exact(house, source_id):
    house.begin()
    house.go_on(2)
    house.eeg.end()
    house.network.on_wait.remove(house.amplifier)
    ended = house.amplifier.sent
    house.go_on(2)
    assert ("eeg", "lost") in house.told
    again = Sender(source_id=source_id)
    house.network.outlets.append(again)
    amplifier = Amplifier(house.network, again)
    house.go_on(2)
    house.session.close()
    stamps = house.read()["amp"]["time_stamps"]
    last = 1000.0 + (ended - 1) / 100
    assert last in stamps
    # What it sent before anybody listened again is in nobody's file.
    first = stamps[np.searchsorted(stamps, last, side="right")]
    assert 0 <= first - amplifier.began < 0.1
    gap = round((first - last) * 100) - 1
    checked = {one.stream: one for one in selfcheck.check(house.folder)}
    assert checked["eeg"].missing == gap
    assert f"gap/stream=eeg/samples={gap}/" in "".join(row[0] for row in house.read()[OWN]["time_series"])


def test_a_silent_stream_is_told_and_so_is_its_return(house):
    house.begin()
    house.go_on(1)
    house.network.on_wait.remove(house.amplifier)
    house.go_on(1)
    assert house.told == [("eeg", "stall")]
    # What had waited in the amplifier comes, and nothing is missing.
    house.network.on_wait.append(house.amplifier)
    house.go_on(1)
    house.session.close()
    assert house.told == [("eeg", "stall"), ("eeg", "back")]
    assert all(one.whole for one in selfcheck.check(house.folder))


def test_what_a_killed_recorder_left_opens_and_a_resumed_one_goes_on_in_a_new_part(house):
    house.begin()
    house.go_on(3)
    path = house.part.path
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 3)
    before = path.read_bytes()
    stamps = house.read()["amp"]["time_stamps"]
    assert stamps[-1] > house.network.now - 1
    assert journal.read(house.folder)["parts"][0]["state"] == journal.RUNNING
    house.begin()
    house.go_on(2)
    house.session.close()
    assert path.read_bytes() == before
    assert [one["file"] for one in journal.read(house.folder)["parts"]] == ["part1.xdf", "part2.xdf"]
    judged = {(one.part, one.stream): one for one in selfcheck.check(house.folder)}
    assert {key: one.whole for key, one in judged.items()} == {
        (1, "eeg"): False, (1, "markers"): False, (2, "eeg"): True, (2, "markers"): True,
    }  # fmt: skip
    assert "no end mark" in judged[1, "eeg"].flaws[0]


@pytest.mark.parametrize("ended", [True, False])
def test_a_file_that_is_cut_is_held_against_what_the_recorder_noted(house, ended):
    house.begin()
    house.go_on(25)
    if ended:
        house.session.close()
    path = house.part.path
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size // 2)
    eeg = checked(house)["eeg"]
    assert not eeg.whole
    assert eeg.samples < 1500
    assert any("no end mark" in flaw for flaw in eeg.flaws)
    assert eeg.counted == 2500 if ended else "fewer than the recorder had noted" in eeg.flaws[1]


class Wavering(Amplifier):
    """One whose driver stamps chunks of 50 ms when they arrive: early and late by much, after a quiet beginning."""

    def __call__(self, now):
        late = self.rng.normal(0, 0.01) if now > 1010 else 0.0
        self.ahead = abs(late)
        super().__call__(now)


def test_what_the_recorder_told_to_be_missing_is_not_whole_though_the_whole_shows_no_gap(house):
    house.network.on_wait.remove(house.amplifier)
    house.amplifier = Wavering(house.network, house.eeg)
    house.begin()
    house.go_on(5)
    first = house.amplifier.sent + 20
    house.amplifier.skip = set(range(first, first + 2))
    house.go_on(30)
    house.session.close()
    about = journal.read(house.folder)["parts"][0]
    told = about["counts"]["eeg"]["gap"]
    eeg = checked(house)["eeg"]
    assert (eeg.gaps, eeg.missing) == (told, about["streams"]["eeg"]["missing"])
    assert not eeg.whole
    (house.folder / journal.FILE).unlink()
    assert not all(one.whole for one in selfcheck.check(house.folder))


def test_each_part_is_judged_also_beside_one_that_cannot_be_read(house):
    house.begin()
    house.go_on(2)
    house.session.close()
    whole = house.part.path.read_bytes()
    for number, content in enumerate((b"", whole[:104], whole[:833], b"no such file"), start=2):
        part.path_of(house.folder, number).write_bytes(content)
    judged = selfcheck.check(house.folder)
    assert {one.part for one in judged} == {1, 2, 3, 4, 5}
    assert all(one.whole == (one.part == 1) for one in judged)


def test_a_stream_that_is_not_in_the_file_at_all_is_told(house):
    house.begin()
    house.go_on(2)
    house.session.close()
    with house.part.path.open("r+b") as file:
        file.truncate(len(xdf.MAGIC + xdf.file_header("2026-01-01T00:00:00+00:00")))
    assert checked(house)["eeg"].flaws == ["it is not in the file"]
    assert checked(house)["eeg"].counted == 200


def test_a_part_that_its_disk_ended_is_not_whole_though_its_file_is(house):
    house.begin()
    house.go_on(3)
    house.session.close()
    assert checked(house)["eeg"].whole
    house.notes.part["state"] = journal.FULL
    house.notes.write()
    assert "stopped by its disk" in checked(house)["eeg"].flaws[0]


def test_a_full_disk_ends_it_and_the_file_ends_with_a_whole_chunk(house, monkeypatch):
    house.begin()
    house.go_on(2)
    write = os.write

    def half(file, data):
        if file == house.part._file:
            write(file, data[: len(data) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", half)
        with pytest.raises(OSError, match="No space left"):
            house.go_on(2)
    assert house.part.path.stat().st_size == house.part.size
    assert len(house.read()["amp"]["time_stamps"]) > 150
    # Once there is room again, what was taken by then goes in whole.
    house.session.close()
    assert all(one.whole for one in selfcheck.check(house.folder))


def test_session_json_tells_what_stood_out_as_soon_as_it_does(house):
    house.begin()
    house.go_on(1)
    house.amplifier.skip = {house.amplifier.sent + 5}
    house.go_on(0.2)
    events = json.loads((house.folder / journal.FILE).read_text())["parts"][0]["events"]
    assert [(one["stream"], one["kind"]) for one in events] == [("eeg", "gap")]


def test_a_flood_of_gaps_is_marked_and_counted_and_said_in_part(house):
    house.begin()
    house.go_on(1)
    first = house.amplifier.sent
    house.amplifier.skip = set(range(first, first + 400, 4))
    house.go_on(5)
    house.session.close()
    assert house.told == [("eeg", "gap")] * 10
    about = json.loads((house.folder / journal.FILE).read_text())["parts"][0]
    assert about["counts"] == {"eeg": {"gap": 100}}
    assert len(house.read()[OWN]["time_series"]) == 100


def checked(house):
    return {one.stream: one for one in selfcheck.check(house.folder)}


def test_an_amplifier_that_ends_for_good_is_not_whole(house):
    house.begin()
    house.go_on(3)
    house.eeg.end()
    house.network.on_wait.remove(house.amplifier)
    house.go_on(4)
    house.session.close()
    assert not checked(house)["eeg"].whole
    assert "ended before" in checked(house)["eeg"].flaws[0]


@pytest.mark.parametrize("text", ["end/subject=s01", "move/trial=1"])
def test_markers_that_end_are_whole_where_they_said_that_none_comes_any_more(house, text):
    house.begin()
    house.go_on(1)
    house.markers.push([house.network.now], [[text]])
    house.go_on(1)
    house.network.outlets.remove(house.markers)
    house.go_on(4)
    house.session.close()
    assert checked(house)["markers"].whole == text.startswith("end")


def test_eeg_that_is_silent_at_the_beginning_or_the_end_is_not_whole(house):
    house.begin()
    house.network.on_wait.remove(house.amplifier)
    house.go_on(4)
    house.network.on_wait.append(house.amplifier)
    house.amplifier.began, house.amplifier.sent = house.network.now, 0
    house.go_on(2)
    house.network.on_wait.remove(house.amplifier)
    house.go_on(4)
    house.session.close()
    late, silent = checked(house)["eeg"].flaws
    assert "came after 4" in late
    assert "silent for 4" in silent


def test_a_share_of_all_samples_lost_all_the_time_is_not_whole(house):
    house.begin()
    house.go_on(1)
    house.amplifier.skip = {n for n in range(5000) if n % 30 == 7}
    house.go_on(20)
    house.session.close()
    assert checked(house)["eeg"].missing == pytest.approx(2000 / 30, abs=3)


def test_markers_of_another_run_under_another_source_id_are_taken_up(house):
    house.begin()
    house.go_on(1)
    house.network.outlets.remove(house.markers)
    again = Sender("moves", "Markers", source_id="robot-2")
    house.network.outlets.append(again)
    house.go_on(4)
    again.push([house.network.now], [["move/trial=9"]])
    house.go_on(1)
    house.session.close()
    assert house.read()["moves"]["time_series"] == [["move/trial=9"]]
    assert checked(house)["markers"].whole


@pytest.mark.parametrize("recovers", [True, False])
def test_markers_that_vanish_are_told_once_and_so_is_their_return(house, recovers):
    """Also where nobody who pulls is told of it, as with LSL."""
    house.network.recovers = recovers
    house.begin()
    house.go_on(1)
    house.markers.push([house.network.now], [["move/trial=1"]])
    house.markers.end()
    house.go_on(6)
    assert house.told == [("markers", "lost")]
    (stream,) = (one for one in house.session.recorder.streams if one.key == "markers")
    assert "gone" in View(Console(), house.folder, OPTIONS)._line(stream)
    again = Sender("moves", "Markers", source_id="robot")
    house.network.outlets.append(again)
    house.go_on(2)
    house.session.close()
    assert house.told == [("markers", "lost"), ("markers", "back")]
    marks = [row[0].partition("/samples")[0] for row in house.read()[OWN]["time_series"]]
    assert marks == ["lost/stream=markers", "back/stream=markers"]


@pytest.mark.parametrize("recovers", [True, False])
def test_markers_that_end_on_purpose_are_not_told_to_be_lost(house, recovers):
    house.network.recovers = recovers
    house.begin()
    house.markers.push([house.network.now], [["end/subject=s01"]])
    house.go_on(1)
    house.markers.end()
    house.go_on(6)
    assert house.told == []


def test_a_stream_whose_samples_come_is_not_lost_where_no_look_sees_it(house):
    house.begin()
    house.network.visible = list
    house.go_on(6)
    assert house.told == [("markers", "lost")]


def sources_of(house):
    (stream,) = (one for one in house.session.recorder.streams if one.key == "eeg")
    return stream.inlet and stream.inlet.description.source_id


def test_an_amplifier_that_stalls_is_not_exchanged_for_its_neighbour(house):
    house.begin()
    house.go_on(1)
    twin = Sender(source_id="two")
    house.network.outlets.append(twin)
    Amplifier(house.network, twin, scale=1e4)
    house.network.on_wait.remove(house.amplifier)
    house.go_on(4)
    assert sources_of(house) == "one"
    house.network.on_wait.append(house.amplifier)
    house.go_on(1)
    house.session.close()
    assert house.told == [("eeg", "stall"), ("eeg", "back")]
    assert not np.diff(house.read()["amp"]["time_series"][:, 0]).std()


def test_of_several_streams_that_fit_the_one_with_the_same_source_id_is_taken(house):
    house.begin()
    house.go_on(1)
    house.network.outlets.remove(house.eeg)
    house.network.on_wait.remove(house.amplifier)
    house.network.outlets += [Sender(source_id="two"), Sender(source_id="one")]
    for one in house.network.outlets[-2:]:
        Amplifier(house.network, one)
    house.go_on(5)
    assert sources_of(house) == "one"
    assert ("eeg", "source") not in house.told


def test_another_source_id_is_told_and_marked_each_time(house):
    house.begin()
    for source_id in ("two", "three"):
        house.go_on(1)
        house.network.outlets.pop(0)
        house.network.outlets.insert(0, Sender(source_id=source_id))
        house.go_on(5)
        assert sources_of(house) == source_id
    house.session.close()
    assert house.told.count(("eeg", "source")) == 2
    events = journal.read(house.folder)["parts"][0]["events"]
    assert "'two', now 'three'" in [one["text"] for one in events if one["kind"] == "source"][1]
    assert sum(row[0].startswith("source/stream=eeg/") for row in house.read()[OWN]["time_series"]) == 2


@pytest.mark.parametrize("known", [True, False])
def test_two_streams_alike_that_come_back_together_are_both_taken_up_each_its_own(house, known):
    keys = [Sender("keys", "Markers", source_id=name if known else "") for name in "ab"]
    house.network.outlets += keys
    helper = Later()
    house.begin(helper=helper)
    house.go_on(1)
    for one in keys:
        house.network.outlets.remove(one)
        one.end()
    house.go_on(4)
    again = [Sender("keys", "Markers", source_id=name if known else "") for name in "ba"]
    house.network.outlets += again
    house.go_on(2)  # both are asked for before the first one has answered
    helper.work()
    house.go_on(1)
    helper.work()
    house.go_on(1)
    streams = {one.key: one for one in house.session.recorder.streams}
    uids = [streams[key].inlet.description.uid for key in ("keys", "keys#2")]
    if known:
        assert uids == [again[1].description.uid, again[0].description.uid]
    assert set(uids) == {one.description.uid for one in again}


def test_a_stream_is_not_taken_for_another_that_is_away_too(house):
    keys = [Sender("keys", "Markers", source_id=name) for name in "ab"]
    house.network.outlets += keys
    house.begin()
    house.go_on(1)
    for one in keys:
        house.network.outlets.remove(one)
    house.network.outlets.append(Sender("keys", "Markers", source_id="b"))
    house.go_on(5)
    gone = {one.key: one.gone for one in house.session.recorder.streams}
    assert gone == {"eeg": False, "markers": False, "keys": True, "keys#2": False}


def test_a_stream_that_comes_back_another_is_recorded_as_one_of_its_own(house):
    house.begin()
    house.go_on(1)
    house.eeg.end()
    house.network.on_wait.remove(house.amplifier)
    house.go_on(1)
    other = Sender(labels=("b", "a"), unit="volts", sfreq=250.0)
    house.network.outlets.append(other)
    Amplifier(house.network, other)
    house.go_on(2)
    house.session.close()
    assert ("eeg", "changed") in house.told
    path = part.path_of(house.folder, 1)
    streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False)
    rates = [float(one["info"]["nominal_srate"][0]) for one in streams if one["info"]["name"] == ["amp"]]
    assert rates == [100.0, 250.0]
    assert all(len(one["time_stamps"]) > 50 for one in streams if one["info"]["name"] == ["amp"])
    assert set(checked(house)) == {"eeg", "markers", "eeg#2"}


OTHERS = {"unit": {"unit": "volts"}, "labels": {"labels": ("b", "a")}, "rate": {"sfreq": 250.0}}


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("answers", ["soon", "late", "never"])
def test_no_sample_of_another_run_goes_under_the_header_of_the_one_before(house, other, answers):
    """As LSL does it: who receives is connected by itself to whatever has the same source id, and gets its samples."""
    house.network.recovers = True
    helper = AtOnce() if answers == "soon" else Later()
    house.begin(helper=helper)
    house.go_on(2)
    house.network.on_wait.remove(house.amplifier)
    first = house.amplifier.sent
    house.eeg.end()
    again = Sender(**OTHERS[other])
    house.network.outlets.append(again)
    amplifier = Amplifier(house.network, again)
    amplifier.sent = amplifier_began = 10**6
    amplifier.began -= amplifier_began / amplifier.sfreq
    house.go_on(3)
    if answers == "late":
        helper.work()
        house.go_on(2)
    elif answers == "never":
        house.go_on(20)
    house.session.close()
    one, two = by_header(house, "amp")
    assert one["time_series"][:, 0].max() < first
    numbers = two["time_series"][:, 0]
    # Single precision counts that far.
    np.testing.assert_array_equal(np.diff(numbers), 1)
    assert numbers[0] == pytest.approx(amplifier_began, abs=14)  # what was sent before it was connected
    assert numbers[-1] == pytest.approx(amplifier.sent - 1, abs=25)
    assert house.told.count(("eeg", "changed")) == 1
    if answers != "never":
        said = two["info"]["desc"][0]["channels"][0]["channel"]
        assert (said[0]["unit"], said[0]["label"], float(two["info"]["nominal_srate"][0])) == (
            [again.description.units[0]], [again.description.labels[0]], again.description.sfreq
        )  # fmt: skip


def by_header(house, name):
    path = part.path_of(house.folder, 1)
    streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False)
    return sorted((s for s in streams if s["info"]["name"] == [name]), key=lambda s: s["info"]["stream_id"])


def test_another_run_of_the_same_kind_goes_on_in_the_same_stream_without_a_sample_less(house):
    house.network.recovers = True
    helper = Later()
    house.begin(helper=helper)
    house.go_on(2)
    house.network.on_wait.remove(house.amplifier)
    house.eeg.end()
    again = Sender()
    house.network.outlets.append(again)
    amplifier = Amplifier(house.network, again)
    amplifier.sent, amplifier.began = 5000, amplifier.began - 50.0
    house.go_on(3)
    helper.work()
    house.go_on(1)
    house.session.close()
    (eeg,) = by_header(house, "amp")
    numbers = eeg["time_series"][:, 0]
    (gap,) = np.flatnonzero(np.diff(numbers) != 1)
    assert numbers[gap + 1] == pytest.approx(5000, abs=6)
    assert numbers[-1] == amplifier.sent - 1
    assert ("eeg", "changed") not in house.told


def test_what_a_held_up_recorder_pulls_of_two_runs_at_once_is_told_apart(house):
    house.network.recovers = True
    house.begin()
    house.go_on(2)
    house.amplifier(house.network.now + 0.2)  # on its way when the sender ends
    house.network.on_wait.remove(house.amplifier)
    (inlet,) = house.eeg.inlets
    old, house.amplifier.sent = inlet.waiting, house.amplifier.sent
    house.eeg.end()
    again = Sender(unit="volts")
    house.network.outlets.append(again)
    house.network.wait(1.5)
    inlet._recover()
    inlet.waiting = [*old, ([house.network.now], [[7e6, 0.0]])]
    house.go_on(3)
    house.session.close()
    one, two = by_header(house, "amp")
    assert one["time_series"][-1, 0] == house.amplifier.sent - 1
    assert two["time_series"][0, 0] == 7e6


def test_what_is_told_is_in_the_file_by_then(house):
    house.begin()
    house.go_on(1)
    seen = []

    def look(stream, event):
        seen.append((house.read()["amp"]["time_series"][-1, 0], house.amplifier.sent - 1))
        raise KeyboardInterrupt

    house.session._say = look
    first = house.amplifier.sent
    house.amplifier.skip = {first + 7}
    with pytest.raises(KeyboardInterrupt):
        house.go_on(1)
    ((written, sent),) = seen
    assert written == sent > first + 7


def test_how_late_samples_are_counts_the_oldest_of_a_pull_and_the_writing(house):
    house.begin()
    house.go_on(1)
    write = house.part.write

    def slowly(**options):
        write(**options)
        house.network.now += 0.02

    house.part.write = slowly
    house.go_on(20)
    house.session.close()
    said = journal.read(house.folder)["parts"][0]["streams"]["eeg"]
    # A pull comes each 70 ms, and the writing takes 20 of them: samples are 20 to 90 ms old when they are in the file.
    assert said["lag_ms"]["worst"] == pytest.approx(90, abs=11)
    assert said["lag_ms"]["median"] == pytest.approx(60, abs=11)
    assert said["disk_ms"] == pytest.approx(1050, abs=120)


def test_the_truth_is_never_taken_up_in_place_of_a_stream_that_is_gone(house):
    house.begin(replace(OPTIONS, streams={"eeg": Declared(type="EEG"), "markers": Declared(type="Markers")}))
    truth = Sender("hrcneuro-truth", "Markers", source_id="truth")
    house.network.outlets.append(truth)
    house.network.outlets.remove(house.markers)
    house.go_on(5)
    truth.push([house.network.now], [["what nobody may know"]])
    house.go_on(1)
    house.session.close()
    assert house.read()["moves"]["time_series"] == []
    assert not checked(house)["markers"].whole


def test_a_recorder_that_was_held_up_says_so_and_takes_what_waited(house):
    house.begin()
    house.go_on(1)
    for _ in range(100):
        house.network.wait(0.05)
    house.go_on(1)
    house.session.close()
    assert ("recorder", "slept") in house.told
    assert checked(house)["eeg"].whole


def test_what_two_inlets_received_of_one_stream_counts_once(house):
    house.begin()
    house.go_on(1)
    (stream,) = (one for one in house.session.recorder.streams if one.key == "eeg")
    second = house.network.open(house.eeg.description)
    house.go_on(1)
    house.session.recorder.resume(stream, second)
    house.go_on(1)
    house.session.close()
    numbers = house.read()["amp"]["time_series"][:, 0]
    np.testing.assert_array_equal(np.diff(numbers), 1)


def test_a_session_json_that_cannot_be_written_ends_nothing(house):
    house.begin()
    house.go_on(1)
    (house.folder / journal.FILE).unlink()
    (house.folder / journal.FILE).mkdir()
    house.go_on(11)
    house.session.close()
    assert "cannot be written" in house.session.unwritten
    assert len(house.read()["amp"]["time_stamps"]) > 1100


@pytest.mark.parametrize("content", ["{", '{"parts": null}', "[]", '{"parts": [1]}'])
def test_a_session_json_that_cannot_be_understood_is_kept_and_begun_anew(house, content):
    (house.folder / journal.FILE).write_text(content)
    house.begin()
    house.go_on(1)
    house.session.close()
    assert checked(house)["eeg"].whole
    kept = [path.read_text() for path in house.folder.glob("session-unreadable-*.json")]
    assert kept == ([] if content.startswith('{"parts"') else [content])


def test_without_session_json_the_parts_are_judged_by_themselves(house):
    for _ in range(2):
        house.begin()
        house.go_on(1)
        house.session.close()
    (house.folder / journal.FILE).unlink()
    assert all(one.whole and one.counted is None for one in selfcheck.check(house.folder))


def test_two_streams_of_one_name_are_told_apart_by_their_numbers(house):
    house.network.outlets += [
        Sender("gaze", "Gaze", sfreq=50.0, source_id=""),
        Sender("gaze", "Gaze", sfreq=20.0, source_id=""),
    ]
    for sender in house.network.outlets[2:]:
        Amplifier(house.network, sender)
    house.begin()
    house.go_on(3)
    house.session.close()
    assert {one.stream: one.whole for one in selfcheck.check(house.folder)} == dict.fromkeys(
        ("eeg", "markers", "gaze", "gaze#2"), True
    )


def test_other_streams_are_recorded_too_but_never_the_truth(house):
    house.network.outlets += [Sender("gaze", "Gaze", sfreq=50.0), Sender("hrcneuro-truth", "Markers")]
    house.begin()
    assert [one.key for one in house.session.recorder.streams] == ["eeg", "markers", "gaze"]
    house.session.close()
    assert set(house.read()) == {"amp", "moves", "gaze", OWN}


def test_only_declared_streams_where_that_is_configured(house):
    house.network.outlets.append(Sender("gaze", "Gaze", sfreq=50.0))
    house.begin(replace(OPTIONS, others=False))
    assert [one.key for one in house.session.recorder.streams] == ["eeg", "markers"]


@pytest.mark.parametrize("until", [0.0, 30.0, 200.0])
def test_clocks_that_were_not_compared_are_not_whole(house, until):
    for one in (house.eeg, house.markers):
        one.compared_until = house.network.now + until
    house.begin()
    house.markers.push([house.network.now], [["move/trial=1"]])
    house.go_on(100)
    house.session.close()
    eeg, markers = (checked(house)[name] for name in ("eeg", "markers"))
    assert eeg.whole == (until > 100)
    assert markers.whole == (until > 0)
    if not until:
        assert "never compared" in eeg.flaws[0]
        assert "never compared" in markers.flaws[0]
    elif not eeg.whole:
        assert eeg.flaws == ["its clock was not compared with the recorder's for 75 s"]


def test_drift_of_the_senders_clock_is_read_back(house):
    house.begin()
    for _ in range(30):
        house.eeg.offset -= 5 * 50e-6
        house.go_on(5)
    house.session.close()
    checked = {one.stream: one for one in selfcheck.check(house.folder)}
    assert checked["eeg"].drift_ppm == pytest.approx(50, abs=1)
    assert checked["markers"].drift_ppm == pytest.approx(0, abs=1)
