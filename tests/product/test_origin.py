"""A simulated study that is exported and read back is called synthetic by the report, whichever way it comes back."""

import re

import pytest


@pytest.fixture(scope="module")
def exported(tmp_path_factory, hrcneuro):
    """A tiny simulated study in both layouts: its configuration, the authors' and BIDS."""
    from tiny_study import write_tiny

    pytest.importorskip("mne_bids", reason="needs the extra bids")
    base = write_tiny(tmp_path_factory.mktemp("origin"))
    shared = ["--config", base / "tiny.toml", "--workdir", base / "work"]
    for arguments in (("acquire", "--export", base / "authors"), ("export", "--bids", base / "bids", "--raw")):
        done = hrcneuro(*arguments, *shared)
        assert done.code == 0, done.err
    return base


def headline(hrcneuro, base, workdir, *assignments):
    """Return what the report's first line says of the data, and what acquire told of s01."""
    given = [part for one in assignments for part in ("--set", one)]
    given += ["--config", base / "tiny.toml", "--workdir", workdir]
    done = hrcneuro("acquire", "s01", "s02", *given, "--json")
    assert done.code == 0, done.err
    assert hrcneuro("report", "--no-figures", *given).code == 0
    page = (workdir / "results/report.html").read_text(encoding="utf-8")
    said = re.search(r"<p class='real (\w+)'><strong>([^<]+)</strong> ([^<]+)</p>", page)
    told = {item["unit"]: item["summary"]["origin"] for item in done.json["items"]}
    return said.groups(), told["s01"]


@pytest.mark.parametrize(
    "back",
    [
        ["acquire.source=dataset", "acquire.path={base}/authors"],
        ["acquire.source=file", "acquire.path={base}/authors/{{subject}}/{{subject}}.set"],
        ["acquire.source=file", "acquire.path={base}/bids/sub-{{subject}}/eeg/sub-{{subject}}_task-tiny_eeg.vhdr"],
        ["acquire.source=file", "acquire.path={base}/raw/{{subject}}_raw.fif"],
    ],
    ids=["dataset", "file", "bids", "fif"],
)
def test_a_simulation_that_was_exported_is_still_called_synthetic(hrcneuro, exported, tmp_path, back):
    (exported / "raw").mkdir(exist_ok=True)
    for path in (exported / "work/cache/acquire").rglob("*_raw.fif"):
        (exported / "raw" / path.name).write_bytes(path.read_bytes())
    back = [one.format(base=exported) for one in back]
    (kind, word, sentence), told = headline(hrcneuro, exported, tmp_path, *back, "acquire.recorded=true")
    assert (kind, word) == ("synthetic", "synthetic")
    assert "SYNTHETIC" in sentence
    assert told == {"eeg": "synthetic", "behaviour": "synthetic", "log": ""}


def test_a_header_that_left_its_bids_folder_still_tells(hrcneuro, exported, tmp_path):
    alone = tmp_path / "alone"
    alone.mkdir()
    for path in (exported / "bids").rglob("*_eeg.*"):
        if path.suffix in (".vhdr", ".vmrk", ".eeg"):
            (alone / path.name).write_bytes(path.read_bytes())
    pattern = f"acquire.path={alone}/sub-{{subject}}_task-tiny_eeg.vhdr"
    (_, word, _), _ = headline(hrcneuro, exported, tmp_path, "acquire.source=file", pattern)
    assert word == "synthetic"


def test_what_nothing_tells_of_is_of_unknown_origin_until_someone_vouches(hrcneuro, exported, tmp_path):
    import mne
    import numpy as np

    for k, unit in enumerate(("s01", "s02")):
        noise = np.random.default_rng(k).normal(0, 1e-5, (3, 4096))
        raw = mne.io.RawArray(noise, mne.create_info(["Fz", "Cz", "Pz"], 128.0, "eeg"), verbose="error")
        raw.set_annotations(mne.Annotations([3.0, 9.0], 0.0, "move"))
        raw.save(tmp_path / f"{unit}_raw.fif", verbose="error")
    plain = ["acquire.source=file", f"acquire.path={tmp_path}/{{subject}}_raw.fif"]
    (kind, word, _), told = headline(hrcneuro, exported, tmp_path / "one", *plain)
    assert (kind, word) == ("synthetic", "of unknown origin")
    assert told == {"eeg": "of unknown origin", "behaviour": "of unknown origin", "log": ""}
    (kind, word, _), _ = headline(hrcneuro, exported, tmp_path / "two", *plain, "acquire.recorded=true")
    assert (kind, word) == ("real", "real")
