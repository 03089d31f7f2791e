"""A simulation stays known through every format that has room for words; the authors' logs are known by content."""

import gzip
import json
import shutil
from pathlib import Path

import mne
import numpy as np
import pytest
import scipy.io

from hrcneuro.contract import Inputs
from hrcneuro.export.bids import write_dataset
from hrcneuro.io.fif import read_raw
from hrcneuro.sources import layout, origin
from hrcneuro.sources.authors_log import write_log as write_authors_log
from hrcneuro.sources.authors_log import write_metadata
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.formats.statements import statements
from hrcneuro.sources.logs import read_log
from hrcneuro.sources.origin import SYNTHETIC, UNKNOWN, Origin, Origins, marked
from hrcneuro.sources.recording import reference_of
from hrcneuro.stages import acquire

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"
SEMI = Origins(Origin.SYNTHETIC, Origin.UNKNOWN)
MARKS = {origin.mark_of(SYNTHETIC): SYNTHETIC, origin.mark_of(SEMI): SEMI}
NAMES = ["Fz", "Cz", "Pz"]


def test_each_simulation_has_a_mark_of_its_own_and_nothing_else_has_one():
    told = {origin.mark_of(Origins(eeg, behaviour)) for eeg in Origin for behaviour in Origin}
    assert len(told) == 4
    assert "" in told
    for eeg in (Origin.REAL, Origin.UNKNOWN):
        assert {origin.mark_of(Origins(eeg, one)) for one in Origin} == {""}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *MARKS.items(),
        (origin.mark_of(Origins(Origin.SYNTHETIC, Origin.REAL)), SEMI),
        ("Startdate X X X SYNTHETIC:_simulated_by_hrcneuro", SYNTHETIC),
        ("source: synthetic; reference; hrcneuro acquire s01, key 0", SYNTHETIC),
        ("# SYNTHETIC pads against real ones\n\nExported by hrcneuro.", UNKNOWN),
        ("no SYNTHETIC: data, ever", UNKNOWN),
        ("filtered by hrcneuro", UNKNOWN),
        ("NONSYNTHETIC: not by hrcneuro", UNKNOWN),
        ("", UNKNOWN),
    ],
)
def test_only_a_mark_is_a_mark(text, expected):
    assert marked(["first", text, "last"]) == expected


def signal():
    rng = np.random.default_rng(1)
    return mne.io.RawArray(rng.normal(0, 1e-5, (3, 512)), mne.create_info(NAMES, 128.0, "eeg"), verbose="error")


def fif(folder, text, write_set, write_xdf):
    raw = signal()
    raw.info["description"] = text
    raw.save(folder / "one_raw.fif", verbose="error")
    return folder / "one_raw.fif"


def top_level_set(folder, text, write_set, write_xdf):
    path = write_set(folder / "one.set", np.ones((3, 512), np.float32), NAMES, 128.0, [])
    header = scipy.io.loadmat(path)["EEG"][0, 0]
    fields = {name: header[name] for name in header.dtype.names}
    scipy.io.savemat(path, fields | {"comments": text}, oned_as="row")
    return path


def nested_set(folder, text, write_set, write_xdf):
    path = write_set(folder / "one.set", np.ones((3, 512), np.float32), NAMES, 128.0, [])
    header = scipy.io.loadmat(path)["EEG"][0, 0]
    fields = {name: header[name] for name in header.dtype.names}
    # EEGLAB's own comments are an array of lines, padded with blanks.
    scipy.io.savemat(path, {"EEG": fields | {"comments": np.array(["first line", text])}}, oned_as="row")
    return path


def vhdr(folder, text, write_set, write_xdf):
    import pybv

    pybv.write_brainvision(
        data=signal().get_data(), sfreq=128.0, ch_names=NAMES, fname_base="one", folder_out=str(folder)
    )
    with (folder / "one.vhdr").open("a", encoding="utf-8") as file:
        file.write(text + "\n")
    return folder / "one.vhdr"


def edf(folder, text, write_set, write_xdf):
    path = folder / "one.edf"
    header = f"{'0':8}{'X X X X':80}{text[:60].replace(' ', '_'):80}16.09.8520.35.00"
    header += f"{256 * 4!s:8}{'':44}{'4':8}{'1':8}{'3':4}"
    fields = [(16, NAMES), (80, [""] * 3), (8, ["uV"] * 3), (8, ["-100"] * 3), (8, ["100"] * 3), (8, ["-32768"] * 3)]
    fields += [(8, ["32767"] * 3), (80, [""] * 3), (8, ["128"] * 3), (32, [""] * 3)]
    header += "".join(f"{value:{width}}" for width, values in fields for value in values)
    samples = np.random.default_rng(2).integers(-9000, 9000, 4 * 3 * 128).astype("<i2")
    path.write_bytes(header.encode("ascii") + samples.tobytes())
    return path


def xdf(folder, text, write_set, write_xdf):
    pytest.importorskip("pyxdf", reason="needs the extra xdf")
    labels = [*NAMES[:2], f"Pz</label><note>{text}</note><label>"]
    stream = {
        "name": "amp", "type": "EEG", "srate": 128, "format": "float32", "labels": labels,
        "stamps": np.arange(512) / 128, "samples": np.random.default_rng(3).normal(0, 10, (512, 3)),
    }  # fmt: skip
    return write_xdf(folder / "one.xdf", [stream])


def zipped_xdf(folder, text, write_set, write_xdf):
    path = xdf(folder, text, write_set, write_xdf)
    (folder / "two.xdf.gz").write_bytes(gzip.compress(path.read_bytes()))
    return folder / "two.xdf.gz"


FORMATS = [fif, top_level_set, nested_set, vhdr, edf, xdf, zipped_xdf]


@pytest.mark.parametrize("make", FORMATS, ids=lambda make: make.__name__)
@pytest.mark.parametrize(("text", "expected"), [*MARKS.items(), ("recorded on a Tuesday", UNKNOWN)])
def test_every_format_gives_its_words_back(make, text, expected, tmp_path, write_set, write_xdf):
    if make is edf and expected is not UNKNOWN:
        text = text.partition(":")[0] + ": simulated by hrcneuro"  # eighty letters, no blanks
    path = make(tmp_path, text, write_set, write_xdf)
    assert read_recording(path).origins == expected


@pytest.mark.parametrize("name", ["README", "README.md", "dataset_description.json"])
def test_a_bids_data_set_tells_for_all_its_recordings_and_belongs_to_their_key(name, tmp_path, write_set):
    root = tmp_path / "bids"
    path = write_set(root / "sub-1/eeg/sub-1_task-x_eeg.set", np.ones((3, 512), np.float32), NAMES, 128.0, [])
    described = {"Name": "x", "GeneratedBy": [{"Name": "hrcneuro"}]}
    (root / "dataset_description.json").write_text(json.dumps(described))
    assert marked(statements(path)) == UNKNOWN
    (root / name).write_text(f"# x\n\n{origin.mark_of(SYNTHETIC)}\n")
    assert marked(statements(path)) == SYNTHETIC
    files = layout.recording_files(str(root / "sub-{subject}/eeg/sub-{subject}_task-x_eeg.set"), "1")
    assert files[name] == root / name
    # Another data set above it says nothing of this one.
    (tmp_path / "dataset_description.json").write_text(origin.mark_of(SEMI))
    assert marked(statements(path)) == SYNTHETIC


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ("task-x_eeg.json", SYNTHETIC),
        ("sub-1/sub-1_eeg.json", SYNTHETIC),
        ("eeg.json", SYNTHETIC),
        ("task-y_eeg.json", UNKNOWN),
        ("sub-1/sub-1_acq-2_eeg.json", UNKNOWN),
        ("sub-2/sub-1_eeg.json", UNKNOWN),
    ],
)
def test_a_sidecar_further_up_tells_of_the_recordings_that_its_name_fits(place, expected, tmp_path, write_set):
    root = tmp_path / "bids"
    path = write_set(root / "sub-1/eeg/sub-1_task-x_eeg.set", np.ones((3, 512), np.float32), NAMES, 128.0, [])
    (root / "dataset_description.json").write_text("{}")
    (root / place).parent.mkdir(exist_ok=True)
    (root / place).write_text(json.dumps({"HrcneuroOrigin": origin.mark_of(SYNTHETIC)}))
    assert marked(statements(path)) == expected
    files = layout.recording_files(str(root / "sub-{subject}/eeg/sub-{subject}_task-x_eeg.set"), "1")
    assert (root / place in files.values()) == (expected == SYNTHETIC)


@pytest.mark.parametrize("other", [Origins(Origin.REAL, Origin.REAL), UNKNOWN, SEMI])
def test_a_data_set_of_several_origins_says_of_none_what_counts_for_others(other, tmp_path):
    write_dataset(tmp_path, [other, SYNTHETIC], study="x", paradigm=True)
    assert marked(statements(tmp_path / "sub-1/eeg/sub-1_task-x_eeg.vhdr.gone")) == UNKNOWN
    assert "partly synthetic" in (tmp_path / "dataset_description.json").read_text()
    write_dataset(tmp_path, [other, other], study="x", paradigm=True)
    assert marked(statements(tmp_path / "sub-1/eeg/sub-1_task-x_eeg.vhdr.gone")).eeg == (
        Origin.SYNTHETIC if other == SEMI else Origin.UNKNOWN
    )


def test_a_sidecar_tells_of_its_recording_alone(tmp_path, write_set):
    one, two = (
        write_set(tmp_path / f"sub-{k}_eeg.set", np.ones((3, 512), np.float32), NAMES, 128.0, []) for k in (1, 2)
    )
    (tmp_path / "sub-1_eeg.json").write_text(json.dumps({"Origin": origin.mark_of(SYNTHETIC)}))
    assert marked(statements(one)) == SYNTHETIC
    assert marked(statements(two)) == UNKNOWN


def test_what_acquire_writes_says_so_and_still_tells_the_reference(tmp_path, tiny):
    out, _ = tiny
    raw = read_raw(out / "s01_raw.fif")
    assert origin.mark_of(SYNTHETIC) in raw.info["description"]
    assert reference_of(raw) == "mean of TP9 and TP10 (mastoids)"
    config = acquire.Config(source="file", path=str(out / "s01_raw.fif"))
    assert read(config, tmp_path)["origin"] == SYNTHETIC.summary


def test_a_mark_outweighs_who_vouches_and_a_voucher_what_is_unknown(tmp_path, tiny, study):
    out, _ = tiny
    marked_file = acquire.Config(source="file", path=str(out / "s01_raw.fif"), recorded=True)
    assert read(marked_file, tmp_path / "one")["origin"] == SYNTHETIC.summary
    study()
    plain = {"source": "file", "path": str(tmp_path / "study/s01/s01.set")}
    assert read(acquire.Config(**plain), tmp_path / "two")["origin"] == UNKNOWN.summary
    summary = read(acquire.Config(**plain, recorded=True), tmp_path / "three")["origin"]
    assert summary == Origins(Origin.REAL, Origin.REAL).summary


@pytest.fixture
def tiny(tmp_path):
    """A simulated subject: the folder that acquire left, and its trials."""
    from hrcneuro.io.tables import read_table
    from hrcneuro.paradigm.params import SessionParams

    out = tmp_path / "made"
    session = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=1)
    read(acquire.Config(session=session, sfreq=128.0), out)
    return out, read_table(out / "trials.parquet")


def read(config, out, unit="s01"):
    out.mkdir(exist_ok=True)
    return acquire.run(config, Inputs(unit, {}), out)


def test_a_simulated_log_says_so_in_its_metadata(tmp_path, tiny):
    _, trials = tiny
    home = tmp_path / "layout" / "s04"
    home.mkdir(parents=True)
    write_authors_log(trials, home / "subject04.csv")
    for told, expected in ((SYNTHETIC, Origin.SYNTHETIC), (UNKNOWN, Origin.UNKNOWN)):
        write_metadata(trials, home / "metadata04.csv", origin=origin.mark_of(told))
        config = acquire.Config(source="semisynthetic", path=str(home.parent), sfreq=128.0)
        found = read(config, tmp_path / expected.name, "s04")["origin"]
        assert found == Origins(Origin.SYNTHETIC, expected).summary
    assert "Origin" not in (home / "metadata04.csv").read_text()


LINES = [
    "Scenario,Block,Episode,Trial,Target direction,Subject_key_pressed or agent,Movement direction,"
    "Error/NonError,Current x,Current y",
    "Shared_Responsibility,Test 1,1,0,North,Agent,north,NonError,4,1",
    "Shared_Responsibility,Test 1,1,1,North,Subject Up,north,NonError,3,1",
]


@pytest.mark.parametrize("ends", ["\r\n", "\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize(("first_line", "separator"), [("", ","), ("", ";"), ("", "\t"), ("sep=;", ";")])
def test_a_log_is_known_however_it_was_saved(first_line, separator, ends, encoding, tmp_path, monkeypatch):
    first, again = tmp_path / "subject01.csv", tmp_path / "subject77.csv"
    first.write_text("\n".join(LINES) + "\n")
    saved = [first_line] * bool(first_line) + [f'{line},"x"'.replace(",", separator) for line in LINES]
    again.write_bytes(ends.join(saved).encode(encoding))
    monkeypatch.setitem(origin._SUBJECTS, origin.log_digest(first), "s01")
    assert origin.authors_subject(again) == "s01"
    again.write_text("\n".join(LINES).replace("Subject Up", "Subject Left"))
    assert origin.authors_subject(again) == ""


def test_what_is_no_log_is_nobodys(tmp_path):
    for text in (b"", b"a,b\n1,2\n", b"\xff\xfe\x00", ",".join(LINES[0].split(",")[:4]).encode()):
        (tmp_path / "x.csv").write_bytes(text)
        assert origin.authors_subject(tmp_path / "x.csv") == ""
    assert origin.authors_subject(tmp_path / "none.csv") == ""


def test_each_of_the_twelve_logs_has_a_digest_of_its_own():
    assert sorted(origin.AUTHORS_LOGS) == [f"s{k:02d}" for k in range(1, 13)]
    assert len(set(origin.AUTHORS_LOGS.values())) == 12


@pytest.mark.parametrize("subject", ["s01", "s12"])
def test_the_authors_logs_are_known_under_another_name_and_after_an_export(subject, tmp_path):
    if not LOGS.is_dir():
        pytest.skip("the authors' logs are not there (../shared/data)")
    home = tmp_path / "renamed" / "s40"
    home.mkdir(parents=True)
    for kind in ("subject", "metadata"):
        text = (LOGS / subject / f"{kind}{subject[1:]}.csv").read_bytes()
        (home / f"{kind}40.csv").write_bytes(text.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"))
    assert origin.authors_subject(home / "subject40.csv") == subject
    shutil.rmtree(home)
    home.mkdir()
    write_authors_log(read_log(LOGS, subject), home / "subject40.csv")
    assert origin.authors_subject(home / "subject40.csv") == subject
