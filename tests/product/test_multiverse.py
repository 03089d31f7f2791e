"""multiverse from outside, on a tiny study: said before it starts, computed once, resumed, dropped, refused."""

import json

import pandas as pd
import pytest
from tiny_study import write_tiny

FILE = """
config = "tiny.toml"
stages = ["epoch"]
curves = ["replaced"]

[cross]
preprocess.filter = ["zero_phase", "causal"]
epoch.reject_uv = { "1000 µV" = 1000.0, "60 µV" = 60.0 }

[one_at_a_time]
preprocess.reference = ["average", "none"]
"""
FILTERS = 'preprocess.filter = ["zero_phase", "causal"]'
SIGNALS = "*/*/*/*.fif"


def write(folder, text=FILE):
    write_tiny(folder)
    (folder / "mine.toml").write_text(text)
    return folder


def signals(work):
    return {path.parts[-4:-1] for path in work.glob(f"cache/{SIGNALS}")}


def bytes_of(work):
    folder = work / "multiverse" / "mine"
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.suffix != ".html"}


@pytest.fixture(scope="module")
def lab(hrcneuro, tmp_path_factory):
    """A study that has run as far as epoch, and its multiverse."""
    folder = write(tmp_path_factory.mktemp("lab"))
    given = ("--workdir", folder / "work", "-j", "1")
    own = hrcneuro("epoch", "--config", folder / "tiny.toml", "--no-figures", "--json", *given)
    assert own.code == 0, own.err
    held = signals(folder / "work")
    done = hrcneuro("multiverse", folder / "mine.toml", "--json", *given)
    assert done.code == 0, done.err
    return folder, own, held, done


def test_it_is_said_what_it_costs_and_a_dry_run_does_nothing(hrcneuro, tmp_path):
    write(tmp_path)
    done = hrcneuro("multiverse", tmp_path / "mine.toml", "--dry-run", "--workdir", tmp_path / "work")
    assert done.code == 0, done.err
    assert "5 universes on 3 preprocessing chains" in done.out
    # Two recordings; two subjects cleaned in three ways; cut in five.
    assert "to compute: 18 results, each once" in done.out
    assert "nothing has run yet" in done.out
    assert "are free" in done.out
    assert not (tmp_path / "work").exists()


def test_each_universe_is_judged_and_each_shared_step_computed_once(lab):
    folder, _, _, done = lab
    assert (done.json["judged"], done.json["failed"]) == (5, {})
    assert (done.json["cost"]["units"], done.json["cost"]["there"], done.json["cost"]["untimed"]) == (12, 6, [])
    records = [json.loads(path.read_text()) for path in (folder / "work").glob("cache/*/*/*/record.json")]
    assert len(records) == 18
    verdicts = pd.read_parquet(done.json["files"]["verdicts"])
    assert verdicts["universe"].nunique() == 5
    assert verdicts.groupby("universe")["finding"].agg(set).map(lambda s: "trials HH" in s and "replaced" in s).all()
    rejected = verdicts[verdicts["finding"] == "rejected"].set_index("choices")["value"]
    assert rejected["as in the study"] == 0
    assert rejected["epoch.reject_uv: 60 µV"] > 0
    one = next(row for row in done.json["summary"] if row["finding"] == "rejected")
    assert (one["choice"], one["study"], one["fits"] + one["differs"]) == ("epoch.reject_uv", "fits", 5)
    # What the cleaning decides alone is one analysis in universes that reject otherwise; the moves are the same in all.
    analyses = {row["finding"]: row["analyses"] for row in done.json["summary"]}
    assert (analyses["rejected"], analyses["replaced"], analyses["steps"]) == (5, 3, 1)
    for _, same in verdicts.groupby(["finding", "analysis"]):
        assert same["ours"].nunique() == 1
    page = (folder / "work" / "multiverse" / "mine" / "multiverse.html").read_text()
    assert "SYNTHETIC" in page
    assert "curve_replaced.png" in page


def test_what_the_study_holds_stays_and_what_was_made_for_it_goes(lab, hrcneuro):
    folder, own, held, _ = lab
    assert signals(folder / "work") == held
    given = ("--config", folder / "tiny.toml", "--workdir", folder / "work")
    again = hrcneuro("epoch", "--no-figures", "--json", *given)
    assert set(again.states.values()) == {"hit"}
    keys = [{(i["stage"], i["unit"], i["key"]) for i in one.json["items"]} for one in (own, again)]
    assert keys[0] == keys[1]


def test_a_second_run_computes_nothing_and_writes_the_same(lab, hrcneuro):
    folder, _, _, _ = lab
    before = bytes_of(folder / "work")
    again = hrcneuro("multiverse", folder / "mine.toml", "--workdir", folder / "work", "-j", "1")
    assert again.code == 0, again.err
    assert "5 are judged already" in again.err
    assert "to compute: 0 results" in again.err
    assert bytes_of(folder / "work") == before
    assert "rejected for their amplitude" not in again.out
    assert "page: " in again.out


def test_where_it_was_cut_off_it_goes_on(lab, hrcneuro):
    folder, _, _, _ = lab
    before = bytes_of(folder / "work")
    # As if it had been killed after its entries were let go and before the verdict was kept.
    lost = sorted((folder / "work").glob("multiverse/.work/judged/*.json"))[0]
    lost.unlink()
    done = hrcneuro("multiverse", folder / "mine.toml", "--json", "--workdir", folder / "work", "-j", "1")
    assert (done.json["cost"]["judged"], done.json["cost"]["units"], done.json["seconds"]) == (4, 0, 0.0)
    assert bytes_of(folder / "work") == before
    # One more value: its universe alone is new, and what is gone of its chain is made again.
    more = FILE.replace('"60 µV" = 60.0 }', '"60 µV" = 60.0, "50 µV" = 50.0 }')
    (folder / "more.toml").write_text(more)
    plan = hrcneuro("multiverse", folder / "more.toml", "--dry-run", "--json", "--workdir", folder / "work")
    assert (plan.json["cost"]["universes"], plan.json["cost"]["judged"]) == (7, 5)
    assert plan.json["cost"]["units"] == 2 + 2 + 2


def test_results_do_not_depend_on_where_jobs_run_or_on_what_was_there(lab, hrcneuro, tmp_path):
    folder, _, _, _ = lab
    write(tmp_path)
    done = hrcneuro("multiverse", tmp_path / "mine.toml", "--workdir", tmp_path / "work", "-j", "2")
    assert done.code == 0, done.err
    assert bytes_of(tmp_path / "work") == bytes_of(folder / "work")
    # Nobody else held anything.
    assert not signals(tmp_path / "work")
    assert len(list((tmp_path / "work").glob("cache/acquire/*/*/trials.parquet"))) == 2


def test_a_disk_too_small_is_refused_with_the_cure_before_anything_runs(hrcneuro, tmp_path):
    write(tmp_path)
    for more in ((), ("--dry-run",)):
        given = ("--workdir", tmp_path / "work", "--disk", "0.001", *more)
        done = hrcneuro("multiverse", tmp_path / "mine.toml", *given)
        assert done.code == 2
        assert "of disk at a time, and --disk allows 1.0 MB; nothing has run" in done.err
        assert "cure: make room" in done.err
    for nothing in ("nan", "inf", "0"):
        done = hrcneuro("multiverse", tmp_path / "mine.toml", "--workdir", tmp_path / "work", "--disk", nothing)
        assert (done.code, "cure: give a number of GB above 0" in done.err) == (2, True), done.err
    assert not list(tmp_path.rglob("record.json"))


def test_a_real_disk_too_small_is_refused_too(hrcneuro, tmp_path):
    from disks import mounted

    write(tmp_path)
    with mounted(tmp_path / "small", "size=2m") as small:
        done = hrcneuro("multiverse", tmp_path / "mine.toml", "--workdir", small / "work")
        assert done.code == 2
        assert "are free; nothing has run" in done.err
        assert not list(small.rglob("record.json"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["zero_phase", "causal"]', '["zero_phase", "casual"]', "did you mean 'causal'"),
        ("preprocess.filter", "preprocess.fliter", "did you mean 'filter'"),
        ('["average", "none"]', '["none", "none"]', "names 'none' twice"),
        ('curves = ["replaced"]', 'curves = ["replacd"]', "did you mean 'replaced'"),
        ('stages = ["epoch"]', 'stages = ["epochs"]', "did you mean 'epoch'"),
        ("[one_at_a_time]", "[one_at_a_time]\nerp.baseline_s = [[-0.2, 0.0], [-0.1, 0.0]]", "all results are the same"),
    ],
)
def test_a_mistake_is_named_before_anything_runs(hrcneuro, tmp_path, old, new, words):
    write(tmp_path, FILE.replace(old, new))
    done = hrcneuro("multiverse", tmp_path / "mine.toml", "--workdir", tmp_path / "work")
    assert done.code == 2
    assert words in done.err
    assert "cure:" in done.err
    assert not list(tmp_path.rglob("record.json"))


def test_a_study_of_something_else_has_no_verdicts(hrcneuro, tmp_path):
    write(tmp_path)
    done = hrcneuro("multiverse", tmp_path / "mine.toml", "--set", "study.split=", "--workdir", tmp_path / "work")
    assert done.code == 2
    assert "is no study of takeovers" in done.err


def test_a_universe_that_fails_is_named_and_the_others_are_judged(hrcneuro, tmp_path):
    # No epoch is good below a microvolt.
    write(tmp_path, FILE.replace('"60 µV" = 60.0', '"none left" = 0.5').partition("[one_at")[0].replace(FILTERS, ""))
    done = hrcneuro("multiverse", tmp_path / "mine.toml", "--json", "--workdir", tmp_path / "work", "-j", "1")
    assert done.code == 3
    assert done.json["judged"] == 1
    assert done.json["failed"] == {"1": "epoch.reject_uv: none left"}
    assert "error: epoch of s01" in done.err
    page = (tmp_path / "work" / "multiverse" / "mine" / "multiverse.html").read_text()
    assert "failed and not judged: epoch.reject_uv: none left" in page
