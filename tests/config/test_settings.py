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
                "[acquire] bads is for source = 'dataset' or 'file' or 'bids' or 'recording'; source is 'synthetic'",
                "] montage is for",
            ],
        ),
        ("[acquire]\nsfreq = 60\n", ["Nyquist frequency of acquire.sfreq = 60"]),
        ("[epoch]\ntmax = 0.5\n", ["epoch.tmax = 0.5", "0.6 s"]),
        ("[erp]\nbaseline_s = [-0.5, 0.0]\n", ["erp.baseline_s", "within -0.2 to 1.2 s"]),
        ("[decode]\nmean_window_s = [0.0, 1.5]\n", ["decode.mean_window_s", "outside the epoch"]),
        ("[contrasts]\nx = ['HH_before', 'RH_befor']\n", ["did you mean 'RH_before'"]),
        (
            "[problems]\nx = ['HH_before']\n",
            ["1 mistake", "[problems] x = ['HH_before']: it needs two different conditions"],
        ),
        ("[contrasts]\nx = ['a', 'a']\n", ["two different conditions, [plus, minus]"]),
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


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (["conditions={}"], ["[conditions] is empty, and [contrasts] and [problems] need some: name at least one"]),
        (["conditions={}", "contrasts={}"], ["[conditions] is empty, and [problems] needs some: "]),
        (["conditions={}", "contrasts={}", "problems={}"], ["[conditions] is empty: name at least one"]),
        (
            ["conditions={late='error'}"],
            [
                "[contrasts] HR-HH_before, RH-RR_before, HR-HH_after, RH-RR_after and 2 more: no such condition as "
                "'HR_before', 'HH_before', 'RH_before', 'RR_before' and 8 more; [conditions] has late (these contrasts "
                "are the paper's, as none are given: write [contrasts] of your own, or contrasts = {})",
                "[problems] HHvsHR, RRvsRH: no such condition as",
            ],
        ),
        (
            ["conditions={late='error'}", "contrasts={x=['lat', 'late']}", "problems={}"],
            ["[contrasts] x: no such condition as 'lat' (did you mean 'late'?); [conditions] has late\n"],
        ),
    ],
)
def test_one_cause_is_one_mistake_whatever_it_breaks(empty, typed, told):
    with pytest.raises(ConfigError) as caught:
        config.load(None, typed, folder=empty)
    text = str(caught.value)
    assert text.startswith(f"{len(told)} mistake")
    for words in told:
        assert words in text


def test_a_study_without_moves_leaves_out_what_is_about_them_unless_it_says_otherwise(empty):
    everything = config.load(None, folder=empty)
    assert everything.stages == tuple(name for name in stages.NAMES if not stages.load(name).on_demand)
    assert set(stages.NAMES) - set(everything.stages) == {"calibrate", "rerp", "transfer"}
    asked = config.load(None, ['study.stages=["calibrate", "acquire"]'], folder=empty)
    assert asked.stages == ("acquire", "calibrate")
    assert everything.left_out == ()
    own = config.load(None, ["acquire.source=file", "acquire.path=x.set"], folder=empty)
    assert own.stages == ("acquire", "preprocess", "epoch", "erp", "ersp", "decode")
    assert [w for w in own.warnings if "simulate and robot" in w and "study.stages" in w]
    named = config.load(None, ["acquire.source=file", 'study.stages=["robot", "epoch"]'], folder=empty)
    assert named.stages == ("epoch", "robot")
    assert not [w for w in named.warnings if "left out" in w]
    with pytest.raises(ConfigError, match=r"did you mean 'decode'"):
        config.load(None, ['study.stages=["decod"]'], folder=empty)


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


@pytest.mark.parametrize("kind", ["a folder", "a folder with one", "found", "a link"])
def test_what_is_no_file_is_no_configuration(empty, kind):
    place = empty / "hrcneuro.toml"
    if kind == "a link":
        place.symlink_to("nowhere")
    else:
        place.mkdir()
    if kind == "a folder with one":
        (place / "mine.toml").touch()
    with pytest.raises(ConfigError, match="does not exist" if kind == "a link" else "is a folder") as caught:
        config.load(None if kind in ("found", "a link") else place, folder=empty)
    assert str(place) in str(caught.value)
    assert {"a link": "existing", "a folder with one": "mine.toml"}.get(kind, "NAME.toml") in caught.value.cure


def test_broken_toml_is_named(empty):
    with pytest.raises(ConfigError, match="not valid TOML"):
        config.load(write(empty, "[study\n"))


OWN = """
[study]
subjects = ["s1", "s2"]
exclude = []
[acquire]
source = "file"
path = "{subject}.vhdr"
drop = ["GSR"]
bads = ["Cz"]
[acquire.subjects.s2]
drop = []
path = "other/s2.vhdr"
"""


def test_a_subject_has_options_of_its_own(empty):
    found = config.load(write(empty, OWN), ["acquire.subjects.s2.unit=uV"])
    own = found.section("acquire", "s2")
    assert (own.drop, own.bads, own.unit) == ((), ("Cz",), "uV")
    assert own.path.endswith("other/s2.vhdr")
    assert found.section("acquire", "s1") is found.sections["acquire"]
    assert found.section("preprocess", "s2") is found.sections["preprocess"]
    again = config.load(write(empty, configtext.render(found, origins=False).replace("# path", "path")))
    assert again.section("acquire", "s2") == own
    assert again.section("acquire", "s1") == found.section("acquire", "s1")


def test_a_value_that_is_typed_is_for_all_and_says_whose_own_it_replaces(empty):
    text = OWN + 'event_map = { a = "A" }\n'
    typed = ["acquire.drop=['X']", "acquire.path=there/{subject}.vhdr", "acquire.event_map.b=B", "acquire.bads=['Pz']"]
    found = config.load(write(empty, text), typed)
    own, all_ = found.section("acquire", "s2"), found.sections["acquire"]
    assert own.drop == all_.drop == ("X",)
    assert own.path == all_.path
    assert own.path.endswith("there/{subject}.vhdr")
    assert own.event_map == {"a": "A", "b": "B"}
    assert own.bads == all_.bads == ("Pz",)
    said = found.remarks["acquire"]
    assert [words.split()[1] for words in said] == ["acquire.drop", "acquire.path", "acquire.event_map"]
    assert "the value that s2 had in [acquire.subjects.s2]" in said[0]
    assert set(said) <= set(found.warnings)
    assert found.origins["acquire.subjects.s2.drop"] == "--set"
    again = config.load(write(empty, text), [*typed, "acquire.subjects.s2.drop=['Y']"])
    assert (again.section("acquire", "s2").drop, again.sections["acquire"].drop) == (("Y",), ("X",))
    with pytest.raises(ConfigError, match=r"1 mistake in the configuration:\n.*acquire\.drop = 3"):
        config.load(write(empty, text), ["acquire.drop=3"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[acquire.subjects.s22]\nunit = 'V'\n", r"s22\] .did you mean 's2'.*no such subject"),
        ("[acquire.subjects.s2]\ndropp = []\n", r"acquire\.subjects\.s2\.dropp .did you mean 'drop'"),
        ("[acquire.subjects.s2]\nsource = 'synthetic'\n", r"unknown key acquire\.subjects\.s2\.source"),
        ("[acquire.subjects.s2]\nonset_event = '1'\n", r"\[acquire\.subjects\.s2\] onset_event is for"),
        ("[acquire]\nsource='file'\nsubjects = 3\n", r"write \[acquire\.subjects\.NAME\]"),
        ("[preprocess.subjects.s2]\nl_freq = 1\n", r"unknown key preprocess\.subjects"),
    ],
)
def test_mistakes_in_a_subject_s_options_are_named(empty, text, words):
    head = "[study]\nsubjects = ['s1', 's2']\nexclude = []\n"
    with pytest.raises(ConfigError, match=words):
        config.load(write(empty, head + ("" if "source='file'" in text else "[acquire]\nsource='file'\n") + text))


def test_a_file_from_any_editor(empty):
    text = "[study]\nname = 'Größe'\n"
    path = empty / "study.toml"
    path.write_bytes(text.replace("\n", "\r\n").encode("utf-8-sig"))
    assert config.load(path).study.name == "Größe"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ConfigError, match=r"not in UTF-8: line 2, \"name = 'Größe'\"") as caught:
        config.load(path)
    assert "save the file as UTF-8" in caught.value.cure
    path.write_bytes(text.encode("utf-16"))
    with pytest.raises(ConfigError, match="is in UTF-16"):
        config.load(path)


def test_set_adds_to_a_table_and_a_table_as_a_whole_replaces_it(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('[acquire]\nsource = "file"\npath = "x"\nevent_map = { a = "A" }\n[conditions]\nlate = "error"\n')
    quiet = ["contrasts={}", "problems={}"]

    def read(*assignments):
        return config.load(own, [*quiet, *assignments])

    added = read('acquire.event_map."S  1"=standard', "acquire.event_map.b=B", "conditions.early=not error")
    assert added.sections["acquire"].event_map == {"a": "A", "S  1": "standard", "b": "B"}
    assert added.shared.conditions == {"late": "error", "early": "not error"}
    assert read("acquire.event_map.a=C").sections["acquire"].event_map == {"a": "C"}
    assert read("acquire.event_map={}").sections["acquire"].event_map == {}
    assert read("acquire.event_map={}", "acquire.event_map.b=B").sections["acquire"].event_map == {"b": "B"}
    assert read("conditions={x='error'}").shared.conditions == {"x": "error"}


def test_set_changes_one_value_of_a_recipe(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('[decode.recipes.mine]\nestimator = "rlda"\ncitation = "here"\nparams = { shrinkage = 0.2 }\n')
    recipe = config.load(own, ["decode.recipes.mine.citation=there"]).sections["decode"].recipes["mine"]
    assert (recipe.citation, recipe.params) == ("there", {"shrinkage": 0.2})


def test_a_name_alone_is_no_assignment_and_says_what_is():
    with pytest.raises(ConfigError, match="'decode=1' is no assignment"):
        config.load(None, ["decode=1"])
