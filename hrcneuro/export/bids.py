"""A study as a BIDS data set (Brain Imaging Data Structure 1.x), written by mne-bids, with what EEG needs beside it.

The recordings as acquired are the raw data set (BrainVision), the clean ones the derivative ``derivatives/hrcneuro``.
Epochs and averages, for which BIDS has no form yet, lie as FIF in ``derivatives/mne``, which claims none.
"""

from __future__ import annotations

import importlib
import json
import re
import shutil
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import __version__
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.export.bids_events import describe_events
from hrcneuro.export.sidecars import write_json, write_text
from hrcneuro.sources.origin import Origins, mark_of
from hrcneuro.sources.recording import reference_of

if TYPE_CHECKING:
    import mne

CLEAN = Path("derivatives") / "hrcneuro"
FIF = Path("derivatives") / "mne"
_MARK = "hrcneuro"
_SCALE = 2.0**20
_RESOLUTION_UV = 1e6 / _SCALE  # 0.95367431640625, exactly
_ADDRESS = "https://doi.org/10.1371/journal.pone.0287958"


@dataclass(frozen=True)
class Subject:
    """The artifacts of one subject, and where they come from; a derivative that has not been made is None."""

    name: str
    origins: Origins
    raw: Path
    trials: Path
    clean: Path | None = None
    epochs: Path | None = None
    evokeds: Path | None = None


def prepare(folder: Path, subjects: Sequence[str]) -> None:
    """Refuse what cannot be exported, before anything is computed for it.

    Raises:
        ConfigError: mne-bids is missing, two subjects would get one label, or the folder holds something else.
    """
    for package in ("mne_bids", "pybv"):
        try:
            importlib.import_module(package)
        except ImportError as error:
            raise ConfigError(
                f"export --bids needs {package.replace('_', '-')}, which is not installed",
                cure="pip install 'hrcneuro[bids]'",
            ) from error
    labels: dict[str, str] = {}
    for name in subjects:
        other = labels.setdefault(label(name), name)
        if other != name or not label(name):
            raise ConfigError(
                f"BIDS labels have letters and digits only: {name!r} would be {label(name)!r}, as {other!r} is",
                cure="rename the subjects (study.subjects) so that they differ in letters and digits",
            )
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--bids {folder} is a file", cure="name a folder")
    if folder.is_dir() and any(folder.iterdir()) and not _ours(folder):
        raise ConfigError(
            f"--bids {folder} holds something that hrcneuro did not write", cure="name a new or an empty folder"
        )


def write_dataset(folder: Path, origins: Sequence[Origins], *, study: str, paradigm: bool) -> None:
    """Write what describes the data set as a whole: descriptions, and for people a README in each part.

    Args:
        folder: The root of the data set.
        origins: Of every subject.
        study: Its name.
        paradigm: Whether it is the paper's: a recording of one's own has nothing to do with it.
    """
    about = {
        "BIDSVersion": "1.10.0",
        "License": "n/a",
        "Authors": ["n/a"],
        **({"ReferencesAndLinks": [_ADDRESS]} if paradigm else {}),
        "GeneratedBy": [{"Name": _MARK, "Version": __version__}],
    }
    simulated, origin = _said_of_all(origins)
    write_json(folder / "dataset_description.json", {"Name": f"{study}{simulated}", "DatasetType": "raw", **about})
    write_text(folder / "README.md", f"# {study}\n\n{origin}\n\n{_README}")
    derived = folder / CLEAN
    write_json(
        derived / "dataset_description.json",
        {"Name": f"{study}{simulated}: hrcneuro's derivatives", "DatasetType": "derivative", **about},
    )
    write_text(derived / "README.md", f"# {study}: derivatives\n\n{origin}\n\n{_DERIVED}")
    write_text(folder / FIF / "README.md", f"# {study}: epochs and averages\n\n{origin}\n\n{_EPOCHS}")


def _said_of_all(origins: Sequence[Origins]) -> tuple[str, str]:
    """Return what the data set's name and its README say of where the data come from.

    What they say counts for every recording in it, so a mark that only some have stands in those sidecars alone.
    """
    marks = sorted({mark_of(one) for one in origins})
    if not any(marks):
        return "", "\n\n".join(sorted({f"The EEG is {one.eeg}." for one in origins}))
    if len(marks) == 1:
        return f" ({marks[0].partition(':')[0].lower()} data)", marks[0]
    return (
        " (partly synthetic data)",
        "Some of the data were simulated: the sidecar of each such recording says so (`HrcneuroOrigin`).",
    )


def write_subject(
    folder: Path, subject: Subject, *, task: str, line_hz: float | None, clean_reference: str
) -> list[Path]:
    """Write one subject anew and return its files, relative to ``folder``.

    Args:
        folder: The root of the data set.
        subject: Its artifacts.
        task: Label of the task.
        line_hz: Frequency of the mains, in Hz, where known.
        clean_reference: Reference of the clean recording.

    Raises:
        DataError: mne-bids refuses the recording.
    """
    from hrcneuro.io.fif import read_raw
    from hrcneuro.io.tables import read_table

    homes = [root / f"sub-{label(subject.name)}" for root in (folder, folder / CLEAN, folder / FIF)]
    for home in homes:
        shutil.rmtree(home, ignore_errors=True)
    raw = read_raw(subject.raw, preload=True)
    trials = read_table(subject.trials)
    base = _write_recording(raw, folder, subject, task=task, line_hz=line_hz)
    describe_events(base, raw, trials)
    if subject.clean is not None:
        clean = read_raw(subject.clean, preload=True)
        derived = _write_recording(clean, folder / CLEAN, subject, task=task, line_hz=line_hz)
        _describe_clean(derived, reference=clean_reference)
    for path, suffix in ((subject.epochs, "epo"), (subject.evokeds, "ave")):
        if path is not None:
            target = homes[2] / "eeg" / f"{base.name}_{suffix}.fif"
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
    return sorted(p.relative_to(folder) for home in homes for p in home.rglob("*") if p.is_file())


def label(name: str) -> str:
    """Return a name's letters and digits: what BIDS allows in a label."""
    return re.sub(r"[^0-9A-Za-z]", "", name)


def _ours(folder: Path) -> bool:
    try:
        about = json.loads((folder / "dataset_description.json").read_text(encoding="utf-8"))
        return any(one.get("Name") == _MARK for one in about.get("GeneratedBy", ()))
    except (OSError, ValueError, AttributeError):
        return False


def _write_recording(raw: mne.io.BaseRaw, root: Path, subject: Subject, *, task: str, line_hz: float | None) -> Path:
    """Write a recording as BrainVision with its sidecars; return the path that their names begin with."""
    import mne_bids

    raw.set_meas_date(None)
    raw.info["line_freq"] = line_hz
    name, reference, origin = subject.name, reference_of(raw) or "n/a", mark_of(subject.origins)
    raw.info["description"] = None
    where = mne_bids.BIDSPath(subject=label(name), task=task, datatype="eeg", root=root)
    with _quiet():
        try:
            mne_bids.write_raw_bids(
                raw, where, format="BrainVision", allow_preload=True, overwrite=True, readme=False, verbose="error"
            )
        except (ValueError, RuntimeError) as error:
            raise DataError(
                f"mne-bids cannot write {name}: {error}",
                cure="look at channels and markers: hrcneuro acquire --inspect",
            ) from error
    base = root / f"sub-{label(name)}" / "eeg" / where.basename
    _keep_every_bit(base, raw)
    # pybv's format says nothing of who made the amplifier, whatever mne-bids infers from it.
    _amend(base, EEGReference=reference, Manufacturer="n/a", **({"HrcneuroOrigin": origin} if origin else {}))
    if origin:
        # pybv ends the header with an empty section for comments; it stays with the file, wherever that is copied.
        header = base.with_name(f"{base.name}_eeg.vhdr")
        write_text(header, f"{header.read_text(encoding='utf-8').rstrip()}\n{origin}\n")
    return base


def _keep_every_bit(base: Path, raw: mne.io.BaseRaw) -> None:
    """Write the samples anew so that whoever reads them gets the very numbers of the recording, which are single ones.

    A number of volts times a power of two is exact; the resolution in µV that belongs to it is written out in full.
    """
    import numpy as np

    header = base.with_name(f"{base.name}_eeg.vhdr")
    lines = header.read_text(encoding="utf-8").splitlines()
    rows = [i for i, line in enumerate(lines) if re.fullmatch(r"Ch\d+=.*,0\.1,µV", line)]
    if not rows:
        return
    data = header.with_suffix(".eeg")
    samples = np.fromfile(data, "<f4").reshape(raw.n_times, len(raw.ch_names))
    for i in rows:
        lines[i] = lines[i].replace(",0.1,µV", f",{_RESOLUTION_UV!r},µV")
        channel = int(lines[i].partition("=")[0].removeprefix("Ch")) - 1
        samples[:, channel] = raw.get_data(picks=[channel])[0] * _SCALE
    samples.tofile(data)
    write_text(header, "\n".join(lines) + "\n")


def _amend(base: Path, **values: Any) -> None:
    path = base.with_name(f"{base.name}_eeg.json")
    write_json(path, {**json.loads(path.read_text(encoding="utf-8")), **values})


def _describe_clean(base: Path, *, reference: str) -> None:
    """Give a clean recording the ``desc-clean`` of a derivative, in its names and wherever files name each other."""
    stem = f"{base.name}_desc-clean"
    for path in sorted(base.parent.glob(f"{base.name}_*")):
        path.rename(path.with_name(path.name.replace(base.name, stem)))
    subject = base.parent.parent
    named = [base.with_name(f"{stem}_eeg.{kind}") for kind in ("vhdr", "vmrk")]
    for path in (*named, subject / f"{subject.name}_scans.tsv"):
        path.write_text(path.read_text(encoding="utf-8").replace(f"{base.name}_eeg", f"{stem}_eeg"), encoding="utf-8")
    done = "filtered, eye movements removed, bad channels repaired, re-referenced, down-sampled by hrcneuro"
    _amend(base.with_name(stem), EEGReference=reference, Description=done)


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        # Of the conversion to BrainVision, which is wanted, and of a missing date, which is kept back on purpose.
        warnings.simplefilter("ignore")
        yield


_README = """\
Exported by hrcneuro. Each recording is as it was acquired (BrainVision, single precision), with every move or event and
what is known of it in `*_events.tsv`. Dates are left out. What was computed lies in `derivatives`.
"""

_DERIVED = """\
The recordings after hrcneuro's preprocess: band-pass, regression of eye movements, bad channels interpolated, common
reference, lower rate.
"""

_EPOCHS = """\
`*_epo.fif` are epochs with the trial table as their metadata (`mne.read_epochs`), `*_ave.fif` averages by condition
(`mne.read_evokeds`). BIDS has no form for either yet, so this folder is no BIDS data set.
"""
