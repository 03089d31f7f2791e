"""False positives in 60 studies with a confound; benchmarks/null_studies.py counts those of every test in thousands."""

import importlib.util
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "null_studies.py"


@pytest.fixture(scope="module")
def null_studies():
    spec = importlib.util.spec_from_file_location("null_studies", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_response_to_errors_is_a_finding_unless_trials_are_alike_in_them(null_studies):
    shares = null_studies.counted("a response to the previous error", 60).mean()
    for kind in ("ERP", "ERSP"):
        assert shares[f"{kind}, all trials (**fails on purpose**)"] > 0.5
        # Of 60 studies with a chance of 24/512 each, more than 8 have a finding in one of 500 runs.
        assert shares[f"{kind}, trials after an error"] <= 8 / 60
        assert shares[f"{kind}, trials after none"] <= 8 / 60


def test_a_study_of_every_kind_comes_to_a_verdict(null_studies):
    for what in null_studies.STUDIES:
        found = null_studies.counted(what, 1)
        assert len(found.columns) >= 2
        assert found.isin([True, False]).all(axis=None)
