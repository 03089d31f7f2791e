"""The lead: by how much the arm trails its commands. A wrong one costs up to 4.5 mm at t_f = 0.6 s."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from hrcneuro.robot.backend import PERIOD, ArmError, Cause
from hrcneuro.robot.record import Telemetry


def response_lead(telemetry: Telemetry, *, most: float = 0.2) -> float:
    """Return the lead of the feed-forward, seconds, that makes up for the arm's delay and lag.

    The joints are taken as the integral of their commands, τ late; τ is fitted by least squares over all joints. Half
    a cycle is added for the hold of each command.

    Args:
        telemetry: A few moves of the arm from rest to rest, at an even rate.
        most: Greatest τ considered, seconds.

    Raises:
        ArmError: The arm did not move, or not as commanded.
    """
    time = telemetry.time - telemetry.time[0]
    asked = np.zeros_like(telemetry.command)
    asked[1:] = np.cumsum(telemetry.command[:-1] * np.diff(time)[:, None], axis=0)
    turned = telemetry.q - telemetry.q.mean(axis=0)
    energy = float(np.sum(turned**2))

    def misfit(lag: float) -> float:
        late = np.stack([np.interp(time - lag, time, column) for column in asked.T], axis=1)
        return float(np.sum((turned - (late - late.mean(axis=0))) ** 2))

    if energy < 1e-6 or not np.isfinite(energy):
        raise ArmError(Cause.NO_RESPONSE, "the arm did not move while its lag was measured")
    best = minimize_scalar(misfit, bounds=(0.0, most), method="bounded", options={"xatol": 1e-6})
    if best.fun > 0.01 * energy or best.x > 0.98 * most:
        raise ArmError(
            Cause.OTHER_RESPONSE,
            f"the arm does not follow its commands: {100 * best.fun / energy:.1f} % of its motion is unexplained at "
            f"the best lag, {1e3 * best.x:.0f} ms",
        )
    return float(best.x) + 0.5 * PERIOD
