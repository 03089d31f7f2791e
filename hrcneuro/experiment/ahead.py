"""What the arm is asked for is looked ahead to before it is asked: beside the flow, not in the arm's loop."""

from __future__ import annotations

from typing import Any

from hrcneuro.arms.cures import with_cure
from hrcneuro.errors import ConfigError
from hrcneuro.experiment.messages import Approach, Go, Request
from hrcneuro.paradigm.grid import CENTRE, Tile
from hrcneuro.robot.assembly import rehearsing
from hrcneuro.robot.lookahead import LookAhead
from hrcneuro.robot.plan import TooQuick
from hrcneuro.robot.rehearsal import Foreseen
from hrcneuro.robot.workspace import CellError, Workspace

_REFUSED = (CellError, TooQuick, Foreseen)


class Ahead:
    """Follows what is asked for from tile to tile, and refuses what the arm cannot do."""

    def __init__(self, config: Any, *, shortest_s: float) -> None:
        """Check the whole grid, so that a session is refused before it begins and not in its middle.

        Args:
            config: The robot stage's options.
            shortest_s: The shortest duration of a move that may be drawn, seconds.

        Raises:
            ConfigError: The arm cannot work in the cell, or make all its moves so quickly.
        """
        try:
            self.workspace = Workspace(config.cell)
            self._look = LookAhead(
                self.workspace,
                pace=config,
                acceleration=config.max_acceleration,
                lead_given=config.lead_s is not None,
                make_loop=rehearsing(self.workspace, tracking=config, safety=config),
            )
            self._look.grid(shortest_s)
        except _REFUSED as error:
            raise with_cure(error) from error
        self._tile = CENTRE
        self._before: tuple[Tile, float] | None = None  # a move from which the next one may take over

    def restart(self) -> None:
        """Begin over the grid's centre, as an arm does that has come home; what has passed is remembered."""
        self._tile, self._before = CENTRE, None

    def check(self, request: Request) -> None:
        """Take in the next request.

        Raises:
            ConfigError: The arm cannot do it; nothing of it was begun.
        """
        try:
            if isinstance(request, Approach):
                self._look.approach(self._tile, request.tile)
                self._tile, self._before = request.tile, None
            elif isinstance(request, Go):
                if request.start != self._tile:
                    raise ValueError(
                        f"move {request.index} begins over tile {request.start}; the arm will be over {self._tile}"
                    )
                self._look.move(request.start, request.end, request.t_f, after=self._before)
                moved = request.start != request.end
                self._tile, self._before = request.end, (request.start, request.t_f) if moved else None
        except _REFUSED as error:
            raise with_cure(error) from error
        except ValueError as error:
            raise ConfigError(str(error), cure="report it: the flow asked for what the arm cannot do") from error
