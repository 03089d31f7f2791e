from pathlib import Path

import pytest

from hrcneuro import stages
from hrcneuro.config import settings as config
from hrcneuro.config import text as configtext
from hrcneuro.contract import params
from hrcneuro.errors import ConfigError

ROOT = Path(__file__).parents[2]
CONFIGS = sorted(ROOT.glob("configs/*.toml"))
HEAD = """\
# The study of Ehrlich et al. 2023 (doi:10.1371/journal.pone.0287958): every value, as used where no other is given.
# A configuration of your own needs only the lines that differ: hrcneuro STAGE --config study.toml

"""


@pytest.fixture
def empty(tmp_path):
    return tmp_path


def write(folder, text):
    path = folder / "study.toml"
    path.write_text(text)
    return path


def test_the_packaged_defaults_are_the_paper_s_configuration(empty):
    defaults = config.load(None, folder=empty)
    paper = config.load(ROOT / "configs" / "paper.toml")
    assert paper.sections == defaults.sections
    assert (paper.study, paper.shared) == (defaults.study, defaults.shared)
    text = HEAD + configtext.render(defaults, origins=False) + "\n"
    assert (ROOT / "configs" / "paper.toml").read_text() == text, "write this text into configs/paper.toml"


@pytest.mark.parametrize("path", CONFIGS, ids=lambda p: p.stem)
def test_every_configuration_that_we_ship_is_sound(path):
    config.load(path)


def test_a_local_file_is_found_and_the_command_line_wins_over_it(empty):
    (empty / "hrcneuro.toml").write_text("[preprocess]\nl_freq = 0.5\nh_freq = 30\n")
    found = config.load(None, ["preprocess.l_freq=0.3"], folder=empty)
    assert (found.sections["preprocess"].l_freq, found.sections["preprocess"].h_freq) == (0.3, 30.0)
    assert found.origins["preprocess.l_freq"] == "--set"
    assert found.origins["preprocess.h_freq"].endswith("hrcneuro.toml")


def test_shared_tables_replace_the_paper_s_and_reach_the_stages(empty):
    path = write(
        empty,
        "[study]\nsubjects=['demo']\nexclude=[]\nsplit=''\n[conditions]\nsquare=\"event == 'square'\"\n"
        "rt=\"event == 'rt'\"\n[contrasts]\nd=['square','rt']\n[problems]\n",
    )
    found = config.load(path)
    for name in ("erp", "ersp", "decode"):
        assert set(found.sections[name].conditions) == {"square", "rt"}
        assert found.sections[name].split == ""
    assert found.sections["decode"].problems == {}


def test_paths_of_a_file_are_taken_from_its_folder_and_stay_out_of_the_key(empty):
    (empty / "deep").mkdir()
    path = empty / "deep" / "study.toml"
    path.write_text("[acquire]\nsource = 'file'\npath = '../data'\n")
    section = config.load(path).sections["acquire"]
    assert Path(section.path).resolve() == (empty / "data").resolve()
    assert "path" not in params(section)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[preproces]\n", ["[preproces]", "did you mean 'preprocess'"]),
        ("preprocess = 3\n", ["preprocess = 3 is no table"]),
        ("[preprocess]\nh_freq = 300\n", ["preprocess.h_freq = 300", "Nyquist", "below 256 Hz"]),
        (
            "[acquire]\nbads = ['nonsense']\nmontage = 'nonsense'\n",
            [
                "2 mistakes",
                "[acquire] bads is for source = 'dataset' or 'file'; source is 'synthetic'",
                "] montage is for",
            ],
        ),
        ("[acquire]\nsfreq = 60\n", ["Nyquist frequency of acquire.sfreq = 60"]),
        ("[epoch]\ntmax = 0.5\n", ["epoch.tmax = 0.5", "0.6 s"]),
        ("[erp]\nbaseline_s = [-0.5, 0.0]\n", ["erp.baseline_s", "within -0.2 to 1.2 s"]),
        ("[decode]\nmean_window_s = [0.0, 1.5]\n", ["decode.mean_window_s", "outside the epoch"]),
        ("[contrasts]\nx = ['HH_before', 'RH_befor']\n", ["did you mean 'RH_before'"]),
        ("[problems]\nx = ['HH_before']\n", ["two different conditions"]),
        ("[study]\nsubjects = ['s01', 's01']\n", ["names 's01' twice"]),
        ("[study]\nsubjects = ['../s01']\n", ["../s01"]),
        ("[study]\nsubjects = []\n", ["subjects is empty"]),
        ("[simulate]\nchosen = 4\n", ["chosen = 4"]),
    ],
)
def test_contradictions_are_refused_with_what_is_allowed(empty, text, words):
    with pytest.raises(ConfigError) as caught:
        config.load(write(empty, text))
    for word in words:
        assert word in str(caught.value)


def test_files_and_assignments_are_judged_together(empty):
    with pytest.raises(ConfigError) as caught:
        config.load(write(empty, "[erp]\nbaselin_s = 1\n"), ["erp.alpha=2", "nonsense", "robot.speed=1"])
    assert "4 mistakes" in str(caught.value)


def test_a_window_past_the_shortest_gap_is_worth_a_warning(empty):
    assert any("mean_window_s" in w for w in config.load(None, folder=empty).warnings)
    assert not config.load(None, ["decode.mean_window_s=[0.0, 0.6]"], folder=empty).warnings


@pytest.mark.parametrize("name", stages.NAMES)
def test_every_option_has_a_line_of_help(name):
    import dataclasses

    def walk(config):
        for f in dataclasses.fields(config):
            assert f.metadata.get("help"), f.name
            if dataclasses.is_dataclass(getattr(config, f.name)):
                walk(getattr(config, f.name))

    walk(stages.load(name).config())


def test_broken_toml_is_named(empty):
    with pytest.raises(ConfigError, match="not valid TOML"):
        config.load(write(empty, "[study\n"))
