"""What an experiment wrote, as the other commands meet it: read by those that read logs, left alone by all others."""

import hashlib
from importlib.util import find_spec

import pytest
from experiment_log import begun, play, simulated

RULES = ("acquire", "s01", "s02", "--rules", "--json")
LOGS = ("--set", "acquire.source=dataset", "--set", "acquire.path=recordings")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A working folder with the logs of two sessions, the second of which was broken off and gone on with."""
    folder = tmp_path_factory.mktemp("experiment")
    with begun(folder / "recordings", "s01") as log:
        play(log, simulated(1))
        log.close(complete=True)
    with begun(folder / "recordings", "s02") as log:
        play(log, simulated(2), most=70)
    with begun(folder / "recordings", "s02", resume=True) as log:
        play(log, simulated(2))
        log.close(complete=True)
    return folder


def digests(folder):
    files = sorted(path for path in (folder / "recordings").rglob("*") if path.is_file())
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_the_rules_hold_on_its_logs_also_where_an_episode_was_broken_off(hrcneuro, study):
    done = hrcneuro(*RULES, *LOGS, "--workdir", study, cwd=study)
    assert done.code == 0, done.err
    never = [rule for rule in done.json["rules"] if rule["target"] == "0"]
    assert len(never) > 12
    assert [rule["rule"] for rule in never if not rule["ok"]] == []


def test_moves_of_a_simulated_human_stay_known_as_such(hrcneuro, study):
    words = ("acquire", "s01", "s02", "--set", "acquire.source=semisynthetic", "--set", "acquire.path=recordings")
    done = hrcneuro(*words, "--set", "acquire.sfreq=128", "--workdir", study, "--json", cwd=study)
    assert done.code == 0, done.err
    first, second = (item["summary"] for item in done.json["items"])
    assert first["origin"]["behaviour"] == second["origin"]["behaviour"] == "synthetic"
    assert not any("broken off" in note for note in first["notes"])
    assert any("broken off" in note for note in second["notes"])


@pytest.mark.parametrize("words", ["status", "cache gc", "timing s01", "record s01 --resume"])
def test_other_commands_do_and_say_what_they_do_without_it(hrcneuro, study, tmp_path, words):
    if words.startswith("record") and not (find_spec("pyxdf") and find_spec("mne_lsl")):
        pytest.skip("recording needs pyxdf and mne-lsl: pip install 'hrcneuro[lsl,xdf]'")
    (tmp_path / "recordings" / "s01").mkdir(parents=True)
    before = digests(study)
    done, without = (hrcneuro(*words.split(), "--workdir", folder, cwd=folder) for folder in (study, tmp_path))
    assert done.code == without.code
    assert done.err.replace(str(study), "") == without.err.replace(str(tmp_path), "")
    assert digests(study) == before
