"""What the configuration names and no subject has is refused; what one of them has is not."""

import pytest

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import absent
from hrcneuro.pipeline.graph import Need, Task

GROUP = Task.of("erp", "group")
UPSTREAM = {
    GROUP: {Task.of("erp", subject): Need(("*",)) for subject in ("a", "b")},
    **{Task.of("erp", subject): {Task.of("acquire", subject): Need(("*",))} for subject in ("a", "b")},
}


def refuse(of_a, of_b, stage="acquire"):
    said = {Task.of(stage, "a"): {"absent": of_a}, Task.of(stage, "b"): {"absent": of_b}}
    absent.refuse(GROUP, lambda task: UPSTREAM.get(task, {}), lambda task: said.get(task, {}))


@pytest.mark.parametrize("stage", ["acquire", "erp"])
def test_what_no_subject_has_is_refused_by_name_though_the_words_differ(stage):
    # The first of the words that subjects have for it.
    with pytest.raises(ConfigError, match="no subject has") as caught:
        refuse([["z", "z"], ["x", "the marker 'x'"]], [["x", "the marker 'x' of another"]], stage)
    assert caught.value.problem == "no subject has the marker 'x'"


def test_what_one_subject_has_passes():
    refuse([["x", "x"]], [])
    refuse([], [["x", "x"]])
    refuse([["x", "x"]], [["z", "z"]])
