"""Write a small BrainVision recording to follow the tutorial with: an oddball, 80 tones, 9 channels, two minutes.

    python docs/start/make_recording.py data          # writes data/demo.vhdr, .vmrk and .eeg

Standard tones are marked ``S  1``, every fifth on average is a target, ``S  2``, with a P300 over Pz. VEOG holds blinks
that leak into the frontal channels. Everything is drawn from one seed.
"""

import sys
from pathlib import Path

import numpy as np
from pybv import write_brainvision

NAMES = ["Fz", "C3", "Cz", "C4", "P3", "Pz", "P4", "Oz", "VEOG"]
P300_UV = np.array([1.5, 3, 5, 3, 6, 7, 6, 2, 0])
BLINK = np.array([0.35, 0.1, 0.12, 0.1, 0.05, 0.05, 0.05, 0.02, 1])
SFREQ = 250


def main(folder: Path) -> None:
    """Write ``demo.vhdr`` and its companions into a folder."""
    rng = np.random.default_rng(1)
    onsets = np.cumsum(rng.uniform(1.3, 1.7, 80)) + 1
    targets = rng.permutation(np.arange(80) % 5 == 0)
    times = np.arange(int((onsets[-1] + 3) * SFREQ)) / SFREQ
    # Pink noise shared by neighbours, some white noise of each channel, alpha over the back of the head.
    data = np.cumsum(rng.normal(size=(9, times.size)), axis=1)
    data = 12 * (data - np.convolve(np.ones(SFREQ) / SFREQ, data.mean(0), "same")) / data.std(axis=1, keepdims=True)
    data += rng.normal(scale=5, size=data.shape)
    data += np.outer([1, 2, 3, 2, 6, 7, 6, 9, 0], np.sin(2 * np.pi * 10 * times))
    for at in rng.uniform(0, times[-1], 25):
        data += np.outer(BLINK, 150 * np.exp(-(((times - at) / 0.08) ** 2)))
    for onset in onsets[targets]:
        size, latency = rng.lognormal(0, 0.5), rng.normal(0.35, 0.05)
        data += np.outer(size * P300_UV, np.exp(-(((times - onset - latency) / 0.09) ** 2)))
    events = [
        {"onset": int(onset * SFREQ), "type": "Stimulus", "description": 2 if target else 1, "channels": "all"}
        for onset, target in zip(onsets, targets, strict=True)
    ]
    write_brainvision(
        data=data * 1e-6,
        sfreq=SFREQ,
        ch_names=NAMES,
        fname_base="demo",
        folder_out=folder,
        events=events,
        overwrite=True,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "data"))
