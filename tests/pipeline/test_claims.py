"""What a run tells those who share its cache, and when."""

import pytest

from hrcneuro.cache.record import Record
from hrcneuro.pipeline.claims import Claims, claimed
from hrcneuro.pipeline.workdir import Workdir

ENTRY = ("simulate", "group", "0123456789abcdef")


@pytest.fixture
def run(tmp_path):
    """A run of a study that has claimed an entry and points at it when it ends."""
    workdir = Workdir(tmp_path)
    claims = Claims(workdir)
    claims.open()
    claims.claim(ENTRY)
    return claims


def end(run):
    run.workdir.point(Record(*ENTRY, parts={}, outputs={}))
    run.close()


def test_an_entry_is_claimed_from_the_claim_on(run, tmp_path):
    assert claimed(Workdir(tmp_path)) == {ENTRY}
    end(run)
    assert claimed(Workdir(tmp_path)) == {ENTRY}


def test_a_run_that_ends_while_gc_asks_keeps_what_it_points_at(run, tmp_path, monkeypatch):
    """It leaves the list then, and its results have only just come to point there."""
    asking = Workdir(tmp_path)
    assert asking.is_study
    waiting = [run]

    def then_it_ends(ask):
        def asked():
            answer = ask()
            if waiting:
                end(waiting.pop())
            return answer

        return asked

    monkeypatch.setattr(asking, "keys", then_it_ends(asking.keys))
    monkeypatch.setattr(asking.studies, "read", then_it_ends(asking.studies.read))
    assert claimed(asking) == {ENTRY}
    assert waiting == []


def test_a_list_that_cannot_be_written_is_said_with_the_path_and_what_is_wrong_there(tmp_path):
    workdir = Workdir(tmp_path)
    workdir.cache.root.mkdir()
    workdir.studies.folder.symlink_to(tmp_path / "nowhere")
    claims = Claims(workdir)
    claims.open()
    claims.claim(ENTRY)
    assert f"{workdir.studies.folder} is a link to {tmp_path / 'nowhere'}, which is not there" in claims.flaw
