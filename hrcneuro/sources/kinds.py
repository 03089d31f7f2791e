"""Names and types of channels as files spell them."""

from __future__ import annotations

_KINDS = {
    "eeg": ("eeg",),
    "eog": ("eog", "heog", "veog", "reog"),
    "ecg": ("ecg", "ekg"),
    "emg": ("emg",),
    "stim": ("stim", "trig", "trigger", "triggers", "status", "marker", "markers"),
    "misc": (
        "misc", "aux", "resp", "respiration", "temp", "temperature", "gsr", "eda", "scr", "ppg", "pleth", "spo2",
        "sao2", "acc", "accelerometer", "gyro", "gyroscope", "magnetometer", "audio", "bio", "physio", "pos", "pupil",
        "gaze", "eyegaze", "eye", "seeg", "ecog", "dbs", "meg", "timestamp", "counter", "battery", "impedance",
        "quality",
    ),
}  # fmt: skip
_BY_WORD = {word: kind for kind, words in _KINDS.items() for word in words}


def kind_of_type(word: str) -> str | None:
    """Return eeg, eog, ecg, emg, stim or misc for what a file calls a channel's type, None where it is not known."""
    return _BY_WORD.get(word.strip().lower())


def numbered(names: list[str], notes: list[str]) -> list[str]:
    """Return the names with a number behind each that repeats, from 0, as MNE numbers them: ``EOG3-0``, ``EOG3-1``.

    Args:
        names: As the file has them.
        notes: What is to be said of them is added here.
    """
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        notes.append(f"labels that repeat are numbered: {', '.join(twice)}")
    return [f"{name}-{names[:i].count(name)}" if name in twice else name for i, name in enumerate(names)]
