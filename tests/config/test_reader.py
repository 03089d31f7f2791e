from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.config.reader import Reader
from hrcneuro.contract import option


@dataclass(frozen=True)
class Inner:
    kind: str = option("eeglab", "which", choices=("eeglab", "perrin"))
    order: int = option(4, "m", low=1, high=9)


@dataclass(frozen=True)
class Config:
    l_freq: float = option(1.0, "edge", unit="Hz", low=0, open_low=True, high=100)
    names: tuple[str, ...] = option((), "names")
    window: tuple[float, ...] = option((0.0, 1.0), "span", low=-1, high=2)
    labels: dict[str, str] = option({}, "map")
    limit: float | None = option(None, "optional")
    on: bool = option(False, "switch")
    path: str = option("", "where", path=True, keyed=False)
    inner: Inner = option(Inner(), "nested")
    many: dict[str, Inner] = option({}, "several")
    table: dict[str, str] = option({}, "shared", shared="conditions")
    rate: float = option(57.0, "how often right", unit="%", low=0, high=100)
    rates: tuple[float, ...] = option((), "several", unit="%", low=0, high=100)
    error: float | None = option(0.1, "how often wrong", low=0, high=1, share=True)
    axes: dict[str, tuple[float, ...]] = option(
        {}, "lists", keys={"accuracy": {"low": 0, "high": 100, "unit": "%"}, "n": {"low": 2, "high": 9, "whole": True}}
    )
    minutes: float = option(0.0, "time of a job", unit="min", low=0)


def read(values, **how):
    reader = Reader(how.pop("source", "study.toml"), Path("/home"), **how)
    config, origins = reader.record(Config(), values, "preprocess")
    return config, origins, reader.mistakes


def test_values_of_every_type_are_read_with_their_origin():
    config, origins, mistakes = read(
        {
            "l_freq": 2,
            "names": ["Cz"],
            "window": [0, 1.5],
            "labels": {"S1": "move"},
            "limit": 3,
            "on": True,
            "path": "data",
            "inner": {"order": 5},
            "many": {"own": {"kind": "perrin"}},
        }
    )
    assert mistakes == []
    assert config == Config(
        2.0, ("Cz",), (0.0, 1.5), {"S1": "move"}, 3.0, True, "/home/data", Inner(order=5), {"own": Inner("perrin")}
    )
    assert origins["preprocess.inner.order"] == "study.toml"
    assert "preprocess.table" not in origins


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"l_frq": 1}, ["study.toml", "preprocess.l_frq", "did you mean 'l_freq'"]),
        ({"l_freq": "one"}, ["preprocess.l_freq = 'one'", "a string", "a number"]),
        ({"l_freq": True}, ["true or false", "a number"]),
        ({"l_freq": 0}, ["0 < l_freq <= 100 Hz"]),
        ({"l_freq": float("nan")}, ["l_freq = nan is no finite number", "0 < l_freq <= 100 Hz"]),
        ({"l_freq": float("inf")}, ["l_freq = inf is no finite number", "0 < l_freq <= 100 Hz"]),
        ({"minutes": float("inf")}, ["minutes = inf is no finite number; allowed: 0 <= minutes min"]),
        ({"minutes": float("-inf")}, ["minutes = -inf is no finite number"]),
        ({"limit": float("inf")}, ["limit = inf is no finite number; allowed: any finite number"]),
        ({"rate": float("inf")}, ["rate = inf is no finite number"]),
        ({"window": [0, 5]}, ["preprocess.window[1] = 5.0", "-1 <= window <= 2"]),
        ({"names": "Cz"}, ["a list of a string"]),
        ({"labels": ["a"]}, ["a table of a string"]),
        ({"inner": {"kind": "perin"}}, ["did you mean 'perrin'", "eeglab, perrin"]),
        ({"inner": {"order": 1.5}}, ["a whole number"]),
        ({"many": {"own": {"kin": "x"}}}, ["preprocess.many.own.kin", "did you mean 'kind'"]),
        ({"table": {"a": "b"}}, ["top-level 'conditions'"]),
        ({"rate": 0.57}, ["preprocess.rate = 0.57", "did you mean 57?", "0 <= rate <= 100 %"]),
        ({"rate": 1}, ["did you mean 100?"]),
        ({"rate": 101}, ["rate = 101.0 is outside its range"]),
        ({"rates": [1]}, ["preprocess.rates[0] = 1.0", "did you mean 100?"]),
        ({"rates": [0, 1]}, ["preprocess.rates[1] = 1.0", "did you mean 100?"]),
        ({"axes": {"accuracy": [1]}}, ["did you mean 100?"]),
        ({"axes": {"accuracy": [0.99, 60]}}, ["preprocess.axes.accuracy[0] = 0.99", "did you mean 99?"]),
        ({"rates": [60, 0.6]}, ["preprocess.rates[1] = 0.6", "did you mean 60?"]),
        ({"error": 57}, ["preprocess.error = 57.0", "did you mean 0.57?", "0 <= error <= 1"]),
        ({"error": 570}, ["error = 570.0 is outside its range"]),
        ({"axes": {"acuracy": [60]}}, ["preprocess.axes.acuracy", "did you mean 'accuracy'", "accuracy, n"]),
        ({"axes": {"accuracy": [60, 101]}}, ["preprocess.axes.accuracy[1] = 101.0", "0 <= accuracy <= 100 %"]),
        ({"axes": {"accuracy": [0.57]}}, ["preprocess.axes.accuracy[0] = 0.57", "did you mean 57?"]),
        ({"axes": {"n": [2, 2.5]}}, ["preprocess.axes.n[1] = 2.5 is no whole number", "2 <= n <= 9"]),
        ({"axes": {"n": [float("nan")]}}, ["preprocess.axes.n[0] = nan"]),
        ({"axes": {"n": []}}, ["preprocess.axes.n = []", "at least one"]),
        ({"axes": {"n": [4, 5, 4]}}, ["names 4 twice"]),
        ({"axes": {"n": 4}}, ["a list of a number"]),
        ({"path": "a\0b"}, ["preprocess.path", "a zero byte"]),
        ({"labels": {"\udce9": "move"}}, ["names in UTF-8"]),
        ({"zzz": 1}, ["unknown key preprocess.zzz", "allowed: axes, error"]),
    ],
)
def test_a_mistake_names_source_key_value_and_what_is_allowed(values, words):
    config, _, mistakes = read(values)
    assert len(mistakes) == 1
    for word in words:
        assert word in mistakes[0]
    assert config.l_freq == 1.0


def test_all_mistakes_are_found_at_once():
    _, _, mistakes = read({"l_frq": 1, "on": 3, "inner": {"kind": "x", "order": 0}})
    assert len(mistakes) == 4


# No argument of a command holds a zero byte.
@given(st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1))
def test_a_string_from_the_command_line_stays_what_was_typed(text):
    config, _, mistakes = read({"names": [text]}, from_text=True)
    assert mistakes == []
    assert config.names == (text,)


def test_a_number_on_the_command_line_may_stand_for_a_string():
    config, _, _ = read({"labels": {"33025": 1}, "path": "/abs"}, from_text=True, source="--set")
    assert config.labels == {"33025": "1"}
    assert config.path == "/abs"


@pytest.mark.parametrize(
    "values",
    [
        *({"rate": 0}, {"rate": 1.5}, {"error": 1}, {"error": 0}, {"axes": {"n": [2, 9]}}),
        *({"rates": [1, 60]}, {"rates": [1.5, 1]}, {"axes": {"accuracy": [60, 1]}}),
    ],
)
def test_a_number_at_the_edge_of_what_is_asked_about_is_taken(values):
    assert read(values)[2] == []


def test_every_axis_of_a_table_is_judged():
    _, _, mistakes = read({"axes": {"accuracy": [0.57, -1], "n": [1], "m": [3]}})
    assert len(mistakes) == 4
