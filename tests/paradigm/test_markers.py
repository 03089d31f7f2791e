"""Markers say what they were made of, also those of earlier versions."""

from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.paradigm import markers

WHERE = st.fixed_dictionaries(
    {
        "scenario": st.sampled_from(["iC", "sC"]),
        "block": st.integers(1, 12),
        "episode": st.integers(1, 20),
        "trial": st.integers(0, 72),
        "practice": st.booleans(),
        "closed": st.booleans(),
    }
)
ACTORS = st.none() | st.sampled_from(["human", "robot"])
NEXT = st.none() | st.sampled_from(["", "N", "E", "S", "W", "NE", "SW"])


@given(WHERE, ACTORS, NEXT)
def test_a_moves_marker_tells_all_that_it_was_made_of_and_nothing_else(where, actor, after):
    said = {name: value for name, value in (("actor", actor), ("next", after)) if value is not None}
    text = markers.of_move("s01", **where, actor=actor, next=after)
    assert markers.move_in(text) == {"subject": "s01", **where, **said}
    assert markers.block_in(text) is None


def test_a_marker_without_actor_and_next_is_what_it_was():
    text = markers.of_move("s01", scenario="iC", block=1, episode=2, trial=3, practice=True)
    assert text == "move/subject=s01/scenario=iC/block=1/episode=2/trial=3/practice"


@given(WHERE)
def test_a_blocks_marker_tells_which_block_begins(where):
    about = {name: where[name] for name in ("scenario", "block", "practice", "closed")}
    text = markers.of_block("s02", **about)
    assert markers.block_in(text) == {"subject": "s02", **about}
    assert markers.move_in(text) is None
    assert markers.block_in("block/subject=s02/block=x") is None
