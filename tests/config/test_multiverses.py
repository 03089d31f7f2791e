"""Files of choices: the forms they may have, and every mistake at once."""

from pathlib import Path

import pytest

from hrcneuro.analyses.multiverse import universes
from hrcneuro.config import settings, shipped
from hrcneuro.config.multiverses import read_multiverse
from hrcneuro.config.universes import own_first, settings_of
from hrcneuro.errors import ConfigError


def read(folder, text):
    (folder / "mine.toml").write_text(text)
    return read_multiverse(folder / "mine.toml")


def load(assignments):
    return settings.load(Path("paper"), assignments)


def expanded(asked):
    """Return the choices with the study's own value first, and the universes with their configurations."""
    choices = own_first(asked, load)
    names = [{c.name: [v.name for v in c.values] for c in choices if c.crossed is how} for how in (True, False)]
    every = universes(*names)
    return choices, every, settings_of(asked, choices, every, load)


@pytest.mark.parametrize(
    "text",
    [
        "preprocess.filter = ['zero_phase', 'causal']",
        "'preprocess.filter' = ['zero_phase', 'causal']",
        "preprocess = { filter = { zero_phase = 'zero_phase', causal = 'causal' } }",
        "preprocess.filter = { zero_phase = 'zero_phase', causal = 'causal' }",
    ],
)
def test_an_option_has_a_list_of_values_or_names_for_them(tmp_path, text):
    (choice,) = read(tmp_path, f"[cross]\n{text}").choices
    assert (choice.name, choice.crossed) == ("preprocess.filter", True)
    assert [(v.name, v.assignments) for v in choice.values] == [
        ("zero_phase", ('preprocess.filter="zero_phase"',)),
        ("causal", ('preprocess.filter="causal"',)),
    ]


def test_a_named_choice_sets_what_it_likes_and_the_study_s_own_value_comes_first(tmp_path):
    asked = read(
        tmp_path,
        """
        [one_at_a_time."edges"]
        narrow = { preprocess = { l_freq = 2, h_freq = 30.0 } }
        paper = {}
        [cross]
        acquire.eeg.effect = ["none", "anticipation"]
        conditions.RH_before = { none = "condition_before == 'RH' and not error", all = "condition_before == 'RH'" }
        """,
    )
    choices, every, found = expanded(asked)
    assert [(c.name, [v.name for v in c.values], c.crossed) for c in choices] == [
        ("acquire.eeg.effect", ["anticipation", "none"], True),
        ("conditions.RH_before", ["all", "none"], True),
        ("edges", ["paper", "narrow"], False),
    ]
    assert len(every) == 2 * 2 + 1
    assert found[0] == load(())
    assert (found[4].sections["preprocess"].l_freq, found[4].sections["preprocess"].h_freq) == (2.0, 30.0)
    assert found[3].sections["acquire"].eeg.effect == "none"
    assert found[3].shared.conditions["RH_before"].endswith("not error")
    assert found[3].shared.conditions["RR_before"] == "condition_before == 'RR'"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("crss = 1", "unknown key crss (did you mean 'cross'?)"),
        ("cross = 1", "cross = 1 is no table"),
        ("stages = ['decod']\n[cross]\ndecode.shrinkage = [0.9, 0.1]", "stages names 'decod' (did you mean 'decode'?)"),
        ("[cross]\ndecode.shrinkage = [0.9]", "decode.shrinkage has 1 value; allowed: at least two"),
        ("[cross]\ndecode.shrinkage = 0.9", "decode.shrinkage = 0.9; allowed: a list of values"),
        ("[cross]\ndecode.shrinkage = [0.9, 0.9]", "names '0.9' twice"),
        (
            "[cross]\npreprocess.filtr = ['zero_phase', 'causal']\ndecode.shrinkage = [0.9]",
            "2 mistakes:\n  - unknown option preprocess.filtr (did you mean 'filter'?)\n  - decode.shrinkage has 1 ",
        ),
        ("[cross]\nfilter = 3", "filter is neither an option"),
        ("[cross.filter]\nzero = 1\ncausal = {}", "filter.zero = 1 is no table of options"),
        ("", "names no choice under [cross] or [one_at_a_time]"),
        (
            "[cross]\ndecode.shrinkage = [0.9, 0.5]\n[one_at_a_time.b]\nx = {}\ny = { decode.shrinkage = 0.1 }",
            "decode.shrinkage is set by decode.shrinkage and by b; allowed: by one choice",
        ),
        (
            "[cross]\n" + "\n".join(f"acquire.eeg.{n} = {list(range(9))}" for n in ("a", "b", "c", "d")),
            "makes 6561 universes; allowed: 4096",
        ),
    ],
)
def test_mistakes_of_a_file_are_named(tmp_path, text, words):
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, text)
    assert words in caught.value.problem
    assert caught.value.cure


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("preprocess.filter = ['zero_phase', 'casual']", "'casual' (did you mean 'causal'?)"),
        ("decode.shrinkage = [0.8, 0.5]", "decode.shrinkage: one value must be the study's own, and none is"),
        ("choice.a = {}\nchoice.b = { decode.shrinkage = 0.9 }", "2 of its values are (a, b)"),
    ],
)
def test_choices_that_do_not_fit_the_study_are_refused(tmp_path, text, words):
    asked = read(tmp_path, f"[cross]\n{text}")
    with pytest.raises(ConfigError) as caught:
        own_first(asked, load)
    assert words in caught.value.problem


def test_a_universe_whose_values_contradict_each_other_is_named(tmp_path):
    asked = read(tmp_path, "[cross]\nepoch.tmin = [-0.2, -0.1]\nerp.baseline_s = [[-0.2, 0.0], [-0.1, 0.0]]")
    choices = own_first_of_valid(asked)
    with pytest.raises(ConfigError, match=r"(?s)universe with epoch.tmin: -0.1: .*lies outside the epoch"):
        settings_of(asked, choices, [{"epoch.tmin": "-0.1", "erp.baseline_s": "-0.2, 0"}], load)


def own_first_of_valid(asked):
    """Return the choices as they stand in the file, the study's own first there."""
    return asked.choices


def test_what_comes_with_the_program_fits_its_study():
    assert shipped.names(shipped.MULTIVERSES) == ["paper", "smoke"]
    asked = read_multiverse(Path("paper"))
    choices, every, found = expanded(asked)
    assert len(every) >= 64
    assert len({(s.sections["acquire"], s.sections["preprocess"]) for s in map(_hashable, found)}) >= 6
    assert f"{len(every)} universes" in (asked.config.parent / "../multiverses/paper.toml").read_text()
    options = {option for choice in choices for value in choice.values for option in value.options}
    for wanted in (
        *("preprocess.filter", "preprocess.l_freq", "preprocess.interpolation", "preprocess.reference"),
        "preprocess.eog",
        *("preprocess.bad_channels", "epoch.reject_uv", "erp.baseline_s", "decode.mean_window_s", "decode.shrinkage"),
        *("decode.balance", "conditions.RH_before", "erp.correction"),
    ):
        assert wanted in options


class _hashable:
    def __init__(self, settings):
        self.sections = {name: repr(section) for name, section in settings.sections.items()}
