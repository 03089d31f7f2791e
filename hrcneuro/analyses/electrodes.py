"""Where a recording's electrodes are, around the centre that the interpolation of bad channels takes for the head's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mne
    import numpy as np


def positions(raw: mne.io.BaseRaw, picks: Sequence[int], splines: str) -> np.ndarray:
    """Return the electrodes' positions around the head's centre: ndarray, shape (n_picks, 3), m; NaN where unknown.

    Args:
        raw: The recording.
        picks: Rows of its channels.
        splines: ``eeglab`` or ``perrin``: which splines are to go through them.
    """
    import numpy as np

    places = np.array([raw.info["chs"][i]["loc"][:3] for i in picks], float)
    places[~np.any(places != 0, axis=1)] = np.nan
    return places - _centre(raw, places, splines)


def _centre(raw: mne.io.BaseRaw, places: np.ndarray, splines: str) -> np.ndarray:
    """Return the centre of the head's sphere: MNE's for Perrin's splines, else that of the electrodes."""
    import warnings

    import mne
    import numpy as np

    from hrcneuro.eeg.interpolation import sphere_centre

    if splines == "perrin" and raw.info["dig"] is not None:
        # MNE refuses a handful of points and warns of few or of an odd centre; the electrodes' own fit serves then.
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            try:
                return np.asarray(mne.bem.fit_sphere_to_headshape(raw.info, units="m", verbose="error")[1])
            except (ValueError, RuntimeError):
                pass
    return sphere_centre(places[np.isfinite(places).all(axis=1)])
