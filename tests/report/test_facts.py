"""What the report says of setup and parameters beside the paper's."""

import pandas as pd

from hrcneuro.report.facts import steps


def test_distances_are_counted_from_where_the_first_move_came_from():
    # From (2, 1) east to (2, 2) and south twice: three tiles from start to goal. The second episode goes west once.
    moves = pd.DataFrame(
        {
            "block": 1,
            "episode": [1, 1, 1, 2],
            "trial": [1, 2, 3, 4],
            "executed": ["E", "S", "S", "W"],
            "row": [2, 3, 4, 0],
            "col": [2, 2, 2, 3],
        }
    )
    assert steps(moves).tolist() == [3, 1]
