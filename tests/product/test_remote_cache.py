"""A study that travels: pushed to a bucket, pulled or read through on an empty root, where only hits are left."""

import json
import os

import pytest
from tiny_study import artifacts, half_written, wait_for

pytest.importorskip("fsspec", reason="needs the extra remote")


@pytest.fixture(scope="module")
def made(finished):
    """The folder of a tiny study that has run in ``one``; do not change it."""
    return finished


@pytest.fixture(scope="module")
def s3():
    """The environment in which ``s3://lab`` is a bucket of a server on this machine."""
    pytest.importorskip("s3fs", reason="needs the extra remote")
    pytest.importorskip("moto", reason="needs moto, which acts as S3")
    pytest.importorskip("flask", reason="needs flask, which serves moto")
    import boto3
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    given = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "of-nobody",
        "AWS_SECRET_ACCESS_KEY": "known-to-nobody",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
    }
    client = boto3.client(
        "s3",
        endpoint_url=given["AWS_ENDPOINT_URL"],
        aws_access_key_id="of-nobody",
        aws_secret_access_key="known-to-nobody",
        region_name="us-east-1",
    )
    client.create_bucket(Bucket="lab")
    yield client, given
    client.close()
    server.stop()


def run(hrcneuro, base, folder, *more, **options):
    """Run the study in a folder; return states by stage and unit."""
    done = hrcneuro("run", base / "pipeline.toml", "--workdir", folder, "-j", "1", "--json", *more, **options)
    assert done.code == 0, done.err
    return done


def test_pushed_and_pulled_on_an_empty_root_a_study_has_only_hits(hrcneuro, made, tmp_path):
    bucket, two = tmp_path / "bucket", tmp_path / "two"
    pushed = hrcneuro("cache", "push", bucket, "--workdir", made / "one", "--json").json
    assert pushed["pushed"] == len(list((made / "one/cache").glob("*/*/*/record.json"))) > 10
    two.mkdir()
    pulled = hrcneuro("cache", "pull", bucket, "--workdir", two, "--json").json
    assert (pulled["pulled"], pulled["refused"]) == (pushed["pushed"], {})
    assert set(run(hrcneuro, made, two).states.values()) == {"hit"}
    assert artifacts(two) == artifacts(made / "one")
    # What was pulled is no other study's: once nothing points at it, it may go.
    changed = hrcneuro("epoch", "--config", made / "tiny.toml", "--workdir", two, "--set", "preprocess.l_freq=0.5")
    assert changed.code == 0
    dropped = hrcneuro("cache", "gc", "--workdir", two, "--json")
    assert dropped.code == 0, dropped.err
    assert {name.partition("/")[0] for name in dropped.json["dropped"]} >= {"preprocess", "epoch"}


def test_on_s3_only_hits_are_left_and_a_flipped_byte_is_caught(hrcneuro, made, tmp_path, s3):
    client, env = s3
    env = {**os.environ, **env}
    pushed = hrcneuro("cache", "push", "s3://lab/study", "--workdir", made / "one", "--json", env=env)
    assert pushed.code == 0, pushed.err
    two = tmp_path / "two"
    two.mkdir()
    pulled = hrcneuro("cache", "pull", "s3://lab/study", "--workdir", two, "--json", env=env)
    assert pulled.json["pulled"] == pushed.json["pushed"], pulled.err
    assert set(run(hrcneuro, made, two).states.values()) == {"hit"}
    assert artifacts(two) == artifacts(made / "one")

    record = json.loads(next((two / "cache/preprocess/s01").glob("*/record.json")).read_text())
    sha = record["outputs"]["s01_clean_raw.fif"]["sha256"]
    place = {"Bucket": "lab", "Key": f"study/files/{sha[:2]}/{sha}"}
    body = bytearray(client.get_object(**place)["Body"].read())
    body[len(body) // 2] ^= 1
    client.put_object(**place, Body=bytes(body))
    three = tmp_path / "three"
    three.mkdir()
    pulled = hrcneuro("cache", "pull", "s3://lab/study", "--workdir", three, "--json", env=env)
    assert pulled.code == 3
    (entry,) = pulled.json["refused"]
    assert entry.startswith("preprocess/s01/")
    assert "content of s01_clean_raw.fif" in pulled.json["refused"][entry]["problem"]
    # Read through, what is refused is computed here, and the rest comes from there.
    done = run(hrcneuro, made, tmp_path / "four", "--from", "s3://lab/study", env=env)
    ran = [name for name, state in done.states.items() if state == "ran"]
    assert ran == ["preprocess s01"]
    assert "computed here: of s3://lab/study the content of s01_clean_raw.fif" in done.err
    assert artifacts(tmp_path / "four") == artifacts(made / "one")


def test_read_through_hits_are_taken_and_misses_run_here(hrcneuro, made, tmp_path):
    bucket = tmp_path / "bucket"
    assert hrcneuro("cache", "push", bucket, "acquire", "preprocess", "--workdir", made / "one").code == 0
    done = run(hrcneuro, made, tmp_path / "two", env={**os.environ, "HRCNEURO_FROM": str(bucket)})
    by_stage = {
        stage: {s for name, s in done.states.items() if name.split()[0] == stage} for stage in ("acquire", "epoch")
    }
    assert by_stage == {"acquire": {"hit"}, "epoch": {"ran"}}
    assert "results were taken from file://" in done.err
    assert artifacts(tmp_path / "two") == artifacts(made / "one")
    again = run(hrcneuro, made, tmp_path / "two")
    assert set(again.states.values()) == {"hit"}


def test_an_address_with_a_slip_moves_nothing(hrcneuro, made, tmp_path):
    """Neither a push nor a pull nor a run, of whichever form the slip is."""
    where = ["--workdir", made / "one"]
    for slip in ("", "s3:/lab/study", "file://relative/place", "s3://KEY:SECRET@lab/x", made / "one" / "cache"):
        for command in (
            ["cache", "push", slip, *where],
            ["cache", "push", slip, *where, "--dry-run"],
            ["cache", "pull", slip, *where],
            ["run", made / "pipeline.toml", *where, "--from", slip, "--dry-run"],
        ):
            done = hrcneuro(*command, cwd=tmp_path)
            assert done.code == 2, (command, done.out, done.err)
            assert "cure: " in done.err
            assert "SECRET@" not in done.err
    assert list(tmp_path.iterdir()) == []
    assert not (made / "one/cache/files").exists()


def test_a_second_cache_that_is_not_there_is_told_of_once_and_the_study_runs(hrcneuro, made, tmp_path):
    (tmp_path / "file").write_text("no folder")
    done = run(hrcneuro, made, tmp_path / "two", "--from", tmp_path / "file" / "bucket", "--no-figures")
    assert "ran" in done.states.values()
    assert done.err.count("computed here") <= 1


def killed(process, number, files):
    """Kill a process as soon as so many files have come, which ``files`` lists, unless it ended before."""
    wait_for(lambda: process.poll() is not None or len(files()) >= number)
    process.kill()
    process.communicate()
    return process.returncode < 0


def test_a_push_that_is_killed_goes_on(start, hrcneuro, made, tmp_path):
    """Whenever it is killed: each record that is there has its files, and the next push ends what was begun."""
    died = 0
    for number in (1, 20, 40):
        bucket, two = tmp_path / f"bucket{number}", tmp_path / f"two{number}"
        process = start("cache", "push", bucket, "--workdir", made / "one", "-j", "1")
        died += killed(process, number, lambda bucket=bucket: list(bucket.glob("files/*/*")))
        two.mkdir()
        if (bucket / "records").exists():
            assert hrcneuro("cache", "pull", bucket, "--workdir", two).code == 0
        assert hrcneuro("cache", "push", bucket, "--workdir", made / "one").code == 0
        assert hrcneuro("cache", "pull", bucket, "--workdir", two).code == 0
        assert artifacts(two) == artifacts(made / "one")
    assert died


def test_on_s3_a_push_that_is_killed_goes_on(start, hrcneuro, made, tmp_path, s3):
    client, env = s3
    env, url, died = {**os.environ, **env}, "s3://lab/killed", 0

    def names(kind):
        pages = client.get_paginator("list_objects_v2").paginate(Bucket="lab", Prefix=f"killed/{kind}/")
        return [one["Key"] for page in pages for one in page.get("Contents", [])]

    for number in (1, 20):
        died += killed(
            start("cache", "push", url, "--workdir", made / "one", "-j", "1", env=env), number, lambda: names("files")
        )
        two = tmp_path / f"two{number}"
        two.mkdir()
        whole = len(names("records"))
        if whole:
            # Each record that is there has its files.
            pulled = hrcneuro("cache", "pull", url, "--workdir", two, "--json", env=env)
            assert (pulled.code, pulled.json["pulled"]) == (0, whole), pulled.err
    assert died
    assert hrcneuro("cache", "push", url, "--workdir", made / "one", env=env).code == 0
    last = tmp_path / "last"
    last.mkdir()
    assert hrcneuro("cache", "pull", url, "--workdir", last, env=env).code == 0
    assert artifacts(last) == artifacts(made / "one")


def test_a_pull_that_is_killed_goes_on(start, hrcneuro, made, tmp_path):
    bucket, died = tmp_path / "bucket", 0
    assert hrcneuro("cache", "push", bucket, "--workdir", made / "one").code == 0
    for number in (1, 5):
        two = tmp_path / f"two{number}"
        two.mkdir()
        process = start("cache", "pull", bucket, "--workdir", two, "-j", "1")
        died += killed(process, number, lambda two=two: list(two.glob("cache/[!.]*/*/*")))
        # What is visible is whole, and what was under way leaves nothing behind.
        assert hrcneuro("cache", "verify", "--workdir", two).code == 0
        assert hrcneuro("cache", "pull", bucket, "--workdir", two).code == 0
        assert artifacts(two) == artifacts(made / "one")
        assert half_written(two) == []
    assert died


def test_a_slim_study_stands_as_before_and_makes_again_what_is_read(hrcneuro, made, tmp_path):
    bucket, two = tmp_path / "bucket", tmp_path / "two"
    hrcneuro("cache", "push", bucket, "--workdir", made / "one")
    run(hrcneuro, made, two, "--from", bucket)
    before = artifacts(two)
    given = ["--config", made / "tiny.toml", "--workdir", two]
    signals = {name for name in before if name.endswith(".fif")}
    size = sum((two / "cache" / name).stat().st_size for name in signals)

    told = hrcneuro("cache", "slim", "acquire", "preprocess", "epoch", *given, "--dry-run", "--json").json
    assert told["bytes"] == size > 0
    assert artifacts(two) == before
    done = hrcneuro("cache", "slim", "acquire", "preprocess", "epoch", *given, "--json")
    assert done.json["bytes"] == size, done.err
    assert not any((two / "cache" / name).exists() for name in signals)

    assert set(run(hrcneuro, made, two).states.values()) == {"hit"}
    assert hrcneuro("cache", "verify", *given).code == 0
    assert hrcneuro("report", *given).code == 0
    for last in ([], ["--last"]):
        asked = hrcneuro("path", "epoch", "s02", "s02_epo.fif", *given, *last)
        assert asked.code == 3
        assert "s02_epo.fif of epoch of s02 was dropped to save disk" in asked.err
        assert "hrcneuro epoch s02 makes it again" in asked.err
    # A stage that reads them makes them again, of those that it reads; what it stands on stays as it was.
    again = hrcneuro("erp", "s01", "--no-figures", *given, "--json")
    assert again.states == {"acquire s01": "ran", "preprocess s01": "ran", "epoch s01": "ran", "erp s01": "ran"}
    mine = {name: digest for name, digest in before.items() if "/s01/" in name}
    whole = {p.relative_to(two / "cache").as_posix() for p in (two / "cache").glob("*/s01/*/*.fif")}
    assert {name for name in mine if name.endswith(".fif")} <= whole


def test_slim_keeps_what_another_study_points_at(hrcneuro, made, tmp_path):
    bucket, env = tmp_path / "bucket", {**os.environ, "HRCNEURO_CACHE": str(tmp_path / "cache")}
    hrcneuro("cache", "push", bucket, "--workdir", made / "one")
    for name in ("two", "three"):
        run(hrcneuro, made, tmp_path / name, "--from", bucket, env=env)
    given = ["--config", made / "tiny.toml", "--workdir", tmp_path / "two", "--json"]
    done = hrcneuro("cache", "slim", "acquire", *given, env=env).json
    assert done["bytes"] == 0
    assert {one["kept"] for one in done["entries"]} == {"another study or a run points at it"}
    assert list((tmp_path / "cache").glob("acquire/*/*/*.fif"))


def test_a_dry_run_says_how_much_will_be_written(hrcneuro, made):
    given = ["--workdir", made / "one", "--config", made / "tiny.toml", "--set", "preprocess.l_freq=0.5", "--dry-run"]
    told = hrcneuro("epoch", *given, "--json").json["disk"]
    files = [p for stage in ("preprocess", "epoch") for p in (made / "one/cache").glob(f"{stage}*/*/*/*")]
    assert told["bytes"] == sum(p.stat().st_size for p in files if p.name != "record.json")
    assert told["free"] > 0
    assert "MB will be written, by what earlier runs wrote" in hrcneuro("epoch", *given).out
