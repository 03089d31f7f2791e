"""How much a decoder's answer is worth: log-odds of human against robot, from the decision alone or from the score."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from hrcneuro.learning.rates import Rates, case

_EDGE = 0.001  # rates and draws closer to 0 or 1 than this would claim infinite evidence


def decision_odds(before: np.ndarray, predicted: np.ndarray, rates: Rates) -> np.ndarray:
    """Return log P(answer | human next) / P(answer | robot next), float32, given who acted before.

    Args:
        before: Whether the human did the event before, bool.
        predicted: The decoder's answer, bool (true: the human), same shape.
        rates: The decoder's four rates.
    """
    # By 2·(human before) + (human predicted): each answer is right in one situation and wrong in its sibling.
    rr, rh, hr, hh = np.clip(rates.by_case / 100.0, _EDGE, 1.0 - _EDGE)
    odds = np.log([(1 - rh) / rr, rh / (1 - rr), (1 - hh) / hr, hh / (1 - hr)])
    return odds.astype(np.float32)[case(before, predicted)]


def graded_odds(before: np.ndarray, acting: np.ndarray, epsilon: np.ndarray, rates: Rates) -> np.ndarray:
    """Return the log-odds of a decoder whose scores are Gaussian with equal variance in its two classes, float32.

    The score is read off Eq 4's own draw: it is on the right side of the threshold exactly where the draw does not
    exceed the rate, so the decisions are those of :func:`hrcneuro.learning.decoder.decide`.

    Args:
        before, acting: Whether the human did the event before and does this one, bool.
        epsilon: Draws of U(0, 100), same shape.
        rates: The decoder's four rates.
    """
    now = case(before, acting)
    z_rate = ndtri(np.clip(rates.by_case / 100.0, _EDGE, 1.0 - _EDGE)).astype(np.float32)
    # How far on the right side of the threshold, in units of the score's SD.
    right = z_rate[now] - ndtri(np.clip(epsilon / 100.0, 1e-7, 1 - 1e-7).astype(np.float32))
    toward_human = np.where(acting, right, -right)
    rr, rh, hr, hh = z_rate
    separation = np.array([rr + rh, hr + hh], np.float32)[before.view(np.uint8)]
    middle = np.array([(rh - rr) / 2, (hh - hr) / 2], np.float32)[before.view(np.uint8)]
    return separation * (toward_human - middle)
