"""acquire: a subject's recording and trials, from the authors' data set, any other recording, or simulation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.contract import Inputs, Stage, Work, option
from hrcneuro.eeg.synthetic import SyntheticParams
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import layout, origin
from hrcneuro.sources.parameters import HIGHEST_HZ, LOWEST_HZ, Source, users

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.sources.recording import Recording

_MASTOIDS = "mean of TP9 and TP10 (mastoids)"


@dataclass(frozen=True)
class Config(Source):
    """Where a subject's data come from; what is read, and what is simulated."""

    sfreq: float = option(
        published.RECORDED_HZ.value, "sampling rate of a synthetic recording", unit="Hz", low=LOWEST_HZ, high=20000
    )
    seed: int = option(2023, "seed of everything simulated; each subject draws its own from it", low=0)
    contaminated: tuple[str, ...] = option(
        published.EXCLUDED.value, "synthetic subjects whose recording is full of jolts"
    )
    session: SessionParams = option(SessionParams(), "simulated session")
    timing: TimingParams = option(TimingParams(), "when simulated moves begin")
    eeg: SyntheticParams = option(SyntheticParams(), "synthetic recording")


def check(config: Config) -> list[str]:
    """Return what contradicts itself in the configuration."""
    from hrcneuro.errors import did_you_mean

    kinds = ("eeg", "eog", "ecg", "emg", "misc", "stim")
    mistakes = [
        f"channel_types.{name} = {kind!r}{did_you_mean(kind, kinds)}; allowed: {', '.join(kinds)}"
        for name, kind in config.channel_types.items()
        if kind not in kinds
    ]
    mistakes += _unused(config)
    if 0 < config.table_rate < LOWEST_HZ:
        mistakes.append(
            f"table_rate = {config.table_rate:g} Hz; no EEG has that rate: allowed are 0 (by time_column) and "
            f"{LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz"
        )
    timing = config.timing
    if timing.t_f_min_s > timing.t_f_max_s:
        mistakes.append(f"timing.t_f_min_s = {timing.t_f_min_s:g} is above timing.t_f_max_s = {timing.t_f_max_s:g}")
    if config.eeg.line_uv and config.eeg.line_hz >= config.sfreq / 2:
        mistakes.append(
            f"eeg.line_hz = {config.eeg.line_hz:g} lies above the Nyquist frequency of sfreq = {config.sfreq:g}; "
            "raise sfreq or set eeg.line_uv = 0"
        )
    return mistakes


def _unused(config: Config) -> Iterator[str]:
    """Yield a sentence for every option of a recording to read that is set, and that the source has no use for."""
    unset = Config()
    for name in Source.reading():
        if config.source not in users(name) and getattr(config, name) != getattr(unset, name):
            listed = " or ".join(repr(user) for user in users(name))
            yield (
                f"{name} is for source = {listed}; source is {config.source!r}: set acquire.source, "
                f"or leave acquire.{name} out"
            )


def sources(config: Config, unit: str) -> dict[str, Path]:
    """Return label -> external file that decides the unit's result.

    Raises:
        ConfigError: No path, or of a format that cannot be read.
        DataError: The subject or one of its files is missing.
    """
    if config.source == "synthetic":
        return {}
    if config.source == "recording":
        return layout.session_files(config.path, unit)
    if not config.moves:
        return layout.foreign_files(config, unit)
    return layout.dataset_files(config.path, unit, eeg=config.source == "dataset")


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Write ``{unit}_raw.fif`` and ``trials.parquet`` (synthetic: also ``truth*``); return the summary."""
    from hrcneuro.io.fif import write_raw
    from hrcneuro.sources import channels, recording
    from hrcneuro.tables.trials import write_onsets, write_trials
    from hrcneuro.tables.truth import write_truth

    unit = inputs.unit
    acquired = _read(config, unit)
    signals, table = acquired.signals, acquired.table
    recording.check_signals(signals)
    reference = _reference(config, signals)
    raw = recording.to_raw(signals, table.dropna(subset=["onset_sample"]), reference=reference)
    write_raw(raw, out / f"{unit}_raw.fif")
    write_trials(table, out)
    if acquired.truth is not None:
        write_truth(acquired.truth, out)
    if acquired.onsets is not None:
        write_onsets(acquired.onsets, out)
    return _summary(config, signals, table, channels.without_position(raw), reference)


def inspect(config: Config, unit: str) -> dict[str, Any]:
    """Return markers, channels and log of a unit, and what stands against using them; writes nothing."""
    from hrcneuro.sources import inspection

    view: dict[str, Any] = {"unit": unit, "source": config.source, "problems": []}
    inspection.attempt(view, lambda: _look(config, unit, view))
    return view


def look(config: Config, unit: str) -> tuple[dict[str, str], pd.DataFrame]:
    """Return the mapped markers that a recording lacks, as :func:`absent_markers`, and its trials; writes nothing.

    Raises:
        DataError, ConfigError: It cannot be read, or the options do not fit it.
    """
    acquired = _read(config, unit)
    return absent_markers(acquired.signals.absent), acquired.table


def render(view: dict[str, Any]) -> str:
    """Return an inspection as text for a person."""
    from hrcneuro.sources import inspection

    return inspection.render(view)


@dataclass
class _Acquired:
    """A recording with its trial table; where they are known, the truth, and the onsets by marker and by trigger."""

    signals: Recording
    table: pd.DataFrame
    truth: dict[str, Any] | None = None
    onsets: pd.DataFrame | None = None


def _read(config: Config, unit: str) -> _Acquired:
    from hrcneuro.sources import dataset, foreign
    from hrcneuro.tables.trials import event_trials, study_trials

    if config.source in ("synthetic", "semisynthetic"):
        signals, moves, truth = _simulate(config, unit)
        signals.origins = _simulated_origins(config, unit)
        signals.notes += _log_notes(config, unit)
        return _Acquired(signals, study_trials(moves, unit, signals.sfreq), truth)
    if config.source == "dataset":
        signals, moves = dataset.read_study(config.path, unit, onset_event=config.onset_event)
        foreign.shape(signals, config)
        signals.origins = origin.vouched(signals.origins, config.recorded)
        return _Acquired(signals, study_trials(moves, unit, signals.sfreq))
    if config.source == "recording":
        from hrcneuro.sources import experiments, sessions

        files = layout.session_files(config.path, unit)
        signals, log = sessions.read(files, config), sessions.read_moves(files)
        foreign.shape(signals, config)
        onsets = sessions.match(signals, log, unit, config, begun=experiments.onsets_of(files["log"]))
        signals.origins = origin.vouched(signals.origins, config.recorded)
        table = study_trials(dataset.place(log, onsets.onset_s), unit, signals.sfreq)
        return _Acquired(signals, table, onsets=sessions.table(log, onsets, unit))
    files = layout.foreign_files(config, unit)
    signals = foreign.read(files, config)
    foreign.shape(signals, config)
    events = foreign.events(signals, files, config)
    signals.origins = origin.vouched(signals.origins, config.recorded)
    return _Acquired(signals, event_trials(events, unit, signals.sfreq))


def _simulated_origins(config: Config, unit: str) -> origin.Origins:
    if config.source == "synthetic":
        return origin.SYNTHETIC
    simulated = origin.Origins(origin.Origin.SYNTHETIC, origin.Origin.UNKNOWN)
    known = origin.with_log(simulated, layout.dataset_files(config.path, unit, eeg=False))
    return origin.vouched(known, config.recorded)


def _log_notes(config: Config, unit: str) -> list[str]:
    from hrcneuro.sources import experiments

    files = sources(config, unit)
    return experiments.notes_of(files["log"]) if "log" in files else []


def _simulate(config: Config, unit: str) -> tuple[Recording, pd.DataFrame, dict[str, Any]]:
    from hrcneuro.sources import simulated

    return simulated.record(
        _moves(config, unit),
        unit,
        eeg=config.eeg,
        sfreq=config.sfreq,
        seed=config.seed,
        contaminated=unit in config.contaminated,
    )


def _moves(config: Config, unit: str) -> pd.DataFrame:
    from hrcneuro.sources import simulated

    if config.source == "synthetic":
        return simulated.simulate_trials(unit, session=config.session, timing=config.timing, seed=config.seed)
    return simulated.logged_trials(config.path, unit, timing=config.timing, seed=config.seed)


def _look(config: Config, unit: str, view: dict[str, Any]) -> None:
    """Fill an inspection; what has been seen before an error stays in it."""
    from hrcneuro.sources import inspection

    if config.source in ("synthetic", "semisynthetic"):
        view["notes"] = [f"the recording is synthetic, {config.sfreq:g} Hz: it is made when acquire runs"]
        view["log"] = inspection.view_log(_moves(config, unit))
        return
    from hrcneuro.sources import dataset, experiments, foreign, sessions
    from hrcneuro.sources.recording import check_signals

    files = sources(config, unit)
    read = {"dataset": lambda: dataset.read_eeg(config.path, unit), "recording": lambda: sessions.read(files, config)}
    signals = read.get(config.source, lambda: foreign.read(files, config))()
    view["recording"] = inspection.view_recording(signals)

    def match(*, shaped: bool = True) -> None:
        of_session = config.source == "recording"
        log = sessions.read_moves(files) if of_session else dataset.read_moves(config.path, unit, signals)
        view["log"] = inspection.view_log(log)
        begun = experiments.onsets_of(files["log"])
        if of_session and shaped:
            sessions.match(signals, log, unit, config, begun=begun)
        elif not of_session:
            dataset.match(signals, log, unit, onset_event=config.onset_event, begun=begun)

    # In the order of run, so that the first problem is the one that stops it.
    if config.source == "dataset":
        inspection.attempt(view, match)
    # What is said of channels that are not shaped, or of events that are not chosen, would be said of other ones.
    shaped = inspection.attempt(view, lambda: foreign.shape_channels(signals, config))
    marked = shaped and inspection.attempt(view, lambda: foreign.choose_markers(signals, config))
    if config.source == "recording":
        inspection.attempt(view, lambda: match(shaped=shaped))
    if not config.moves and marked:
        inspection.attempt(view, lambda: foreign.events(signals, files, config))
    if shaped:
        inspection.attempt(view, lambda: check_signals(signals))
    view["recording"] = inspection.view_recording(signals)


def _reference(config: Config, signals: Recording) -> str:
    return config.reference or signals.reference or (_MASTOIDS if config.moves else "")


def _summary(
    config: Config, signals: Recording, table: pd.DataFrame, lost: list[str], reference: str
) -> dict[str, Any]:
    """Return what the report and a person want to know of the unit."""
    from hrcneuro.sources.matching import histogram

    kinds = {kind: len(signals.picks(kind)) for kind in dict.fromkeys(signals.ch_types)}
    return {
        "source": config.source,
        "origin": signals.origins.summary,
        "channels": kinds,
        "sfreq": signals.sfreq,
        "duration_s": round(signals.duration_s, 3),
        "events": histogram(table[table["onset_sample"].notna()]),
        "rows": len(table),
        "bads": signals.bads,
        "breaks": len(signals.breaks_s),
        "reference": reference or "not stated",
        "without_position": lost,
        "notes": signals.notes,
        "absent": list(absent_markers(signals.absent).items()),
    } | ({"warnings": signals.warnings} if signals.warnings else {})


def absent_markers(absent: dict[str, str]) -> dict[str, str]:
    """Return the markers that a recording lacks, by the option that names them, each in a few words."""
    return {
        f"acquire.event_map.{key}": f"the marker {key!r}{hint} of acquire.event_map" for key, hint in absent.items()
    }


STAGE = Stage(
    name="acquire",
    title="Recordings",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "mne", "pymatreader", "pyxdf", "antio", "curryreader", "pyarrow"),
    check=check,
    subject=Work(run),
    sources=sources,
    # What may be odd about one recording; what is simulated, and where all data come from, is the study's.
    by_subject=Source.reading(),
)
