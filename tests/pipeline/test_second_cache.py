"""A second cache that does not answer is not asked at every task; one that does again is."""

import pytest

from hrcneuro.cache import bucket as buckets
from hrcneuro.cache import fingerprint, transfer
from hrcneuro.cache.record import Record
from hrcneuro.cache.store import Store
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import second_cache

pytest.importorskip("fsspec", reason="needs the extra remote")


@pytest.fixture
def pushed(tmp_path, monkeypatch):
    """A bucket's URL, and entries in it."""
    monkeypatch.setattr(second_cache, "_buckets", {})
    monkeypatch.setattr(second_cache, "_silent_until", {})
    store, entries = Store(tmp_path / "one"), []
    for number in range(2):
        parts = {"params": {"number": number}}
        entries.append(("scale", "s01", fingerprint.key(parts)))
        with store.workspace(*entries[-1]) as work:
            (work / "about.json").write_text(str(number))
            store.publish(Record(*entries[-1], parts, {}), work)
    url = f"file://{tmp_path}/bucket"
    assert all(m.error is None for m in transfer.push(store, buckets.Bucket(url), entries))
    return url, entries


def test_a_bucket_without_an_answer_is_asked_again_after_a_minute(pushed, tmp_path, monkeypatch):
    url, entries = pushed
    store, told, asked = Store(tmp_path / "two"), [], []
    store.root.mkdir()
    now = [1000.0]
    monkeypatch.setattr(second_cache.time, "monotonic", lambda: now[0])

    def silent(self):
        asked.append(now[0])
        raise TimeoutError("no answer")

    with monkeypatch.context() as away:
        away.setattr(buckets.Bucket, "_fs", silent)
        assert second_cache.take(url, store, entries[0], told.append) is None
        now[0] += 59
        assert second_cache.take(url, store, entries[1], told.append) is None
    assert (len(asked), len(told)) == (1, 1)
    assert "no answer" in told[0]
    now[0] += 2
    found = second_cache.take(url, store, entries[0], told.append)
    assert found is not None, told
    assert found.key == entries[0][2]


def test_a_bucket_whose_silence_cost_much_is_left_alone_for_ten_times_as_long(pushed, tmp_path, monkeypatch):
    url, entries = pushed
    store, told, now, asked = Store(tmp_path / "two"), [], [1000.0], []
    monkeypatch.setattr(second_cache.time, "monotonic", lambda: now[0])

    def silent(self):
        asked.append(now[0])
        now[0] += 30
        raise TimeoutError("no answer")

    monkeypatch.setattr(buckets.Bucket, "_fs", silent)
    for seconds in (0, 299, 2):
        now[0] += seconds
        assert second_cache.take(url, store, entries[0], told.append) is None
    assert asked == [1000.0, 1331.0]
    assert "within 300 s" in told[0]


def test_whatever_goes_wrong_with_what_a_bucket_has_it_is_computed_here(pushed, tmp_path, monkeypatch):
    url, entries = pushed
    told = []

    def fail(*_):
        raise UnicodeEncodeError("utf-8", "\ud800", 0, 1, "surrogates not allowed")

    monkeypatch.setattr(transfer, "parse_record", fail)
    monkeypatch.setattr(transfer, "_read", fail)
    assert second_cache.take(url, Store(tmp_path / "two"), entries[0], told.append) is None
    assert "computed here" in told[0]
    assert "UnicodeEncodeError" in told[0]


def test_an_entry_that_is_not_there_is_no_word_worth(pushed, tmp_path):
    told = []
    assert second_cache.take(pushed[0], Store(tmp_path / "two"), ("scale", "s01", "0" * 16), told.append) is None
    assert told == []


def test_the_url_comes_from_the_option_or_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("HRCNEURO_FROM", raising=False)
    assert second_cache.named(None) == ""
    monkeypatch.setenv("HRCNEURO_FROM", str(tmp_path))
    assert second_cache.named(None) == f"file://{tmp_path}"
    assert second_cache.named("memory://x") == "memory://x"
    monkeypatch.setenv("HRCNEURO_FROM", "http://x")
    with pytest.raises(ConfigError, match="http"):
        second_cache.named(None)


def test_an_empty_option_is_a_slip_and_an_empty_variable_names_none(monkeypatch):
    monkeypatch.setenv("HRCNEURO_FROM", "")
    assert second_cache.named(None) == ""
    with pytest.raises(ConfigError, match="the bucket's address is empty"):
        second_cache.named("")


def test_a_second_cache_in_the_first_is_refused_before_anything_runs(tmp_path):
    with pytest.raises(ConfigError, match="is the cache itself"):
        second_cache.named(str(tmp_path / "cache"), cache=tmp_path / "cache")


@pytest.mark.parametrize("url", ["sftp://me:hunter2@host/x", "ssh://me:hunt@er2@host/x"])
def test_a_password_does_not_travel_to_workers(monkeypatch, url):
    monkeypatch.delenv("HRCNEURO_FROM", raising=False)
    with pytest.raises(ConfigError, match="is given with a password") as refused:
        second_cache.for_workers(url)
    assert "er2" not in str(refused.value)
    monkeypatch.setenv("HRCNEURO_FROM", url)
    assert second_cache.for_workers(second_cache.named(None)) == ""


@pytest.mark.parametrize("url", ["", "ssh://me@host/x", "s3://bucket/a@b/c", "file:///mnt/a:b"])
def test_an_address_without_one_does(url):
    assert second_cache.for_workers(url) == url
