"""What a job on another machine may use: what the configuration says, else what was recorded, with room above it."""

import pytest
from one_job import one_job

from hrcneuro.config import settings as config
from hrcneuro.config.cluster import ClusterOptions, StageResources
from hrcneuro.contract import GROUP
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.job import execute
from hrcneuro.pipeline.measured import Measured, measured
from hrcneuro.pipeline.resources import Resources, most, resources

ERP = Task.of("erp", "s01")


def test_what_nobody_has_said_or_measured_is_generous():
    assert resources(ERP, ClusterOptions(), {}) == Resources(2.0, 60, 2)


@pytest.mark.parametrize(
    ("last", "memory_gb", "minutes"),
    [(Measured(2.0, 100.0), 1.0, 5), (Measured(600.0, 1024.0), 1.5, 30), (Measured(601.0, 1500.0), 2.5, 31)],
)
def test_what_was_measured_is_asked_for_with_room_above_it(last, memory_gb, minutes):
    found = resources(
        ERP,
        ClusterOptions(),
        {("erp", False): last, ("erp", True): Measured(9e9, 9e9), ("ersp", False): Measured(9e9, 9e9)},
    )
    assert (found.memory_gb, found.minutes) == (memory_gb, minutes)
    assert found.memory_gb * 1024 >= min(1.0, last.peak_mb) * 1.5


def test_a_stage_s_own_values_go_before_those_for_all_and_these_before_measurements():
    options = ClusterOptions(memory_gb=3.0, minutes=7, retries=1, stages={"erp": StageResources(memory_gb=9.0)})
    known = {("erp", False): Measured(5.0, 500.0)}
    assert resources(ERP, options, known) == Resources(9.0, 7, 1)
    assert resources(Task.of("ersp", "s01"), options, known) == Resources(3.0, 7, 1)
    assert resources(Task.drawing("erp", "s01"), options, known).memory_gb == 9.0
    never = ClusterOptions(stages={"erp": StageResources(retries=0)})
    assert resources(ERP, never, {}).retries == 0


def test_records_are_measured_and_what_never_ran_is_not(tmp_path):
    job, workdir = one_job(tmp_path)
    places = [("acquire", "s01"), ("acquire", "s02")]
    assert measured(workdir, places) == {}
    workdir.point(execute(job).record)
    (found,) = measured(workdir, places).values()
    assert found.peak_mb > 50
    assert 0 < found.seconds < 60
    files = [p for p in workdir.artifact("acquire", "s01").iterdir() if p.name != "record.json"]
    assert found.size == sum(p.stat().st_size for p in files)


@pytest.mark.parametrize("odd", [float("inf"), float("nan"), -1, 1e30, 10**400, True, "600", None, [1]])
def test_what_no_run_can_have_taken_counts_as_unknown(odd):
    assert Measured.read({"seconds": odd, "peak_rss_mb": odd}) == Measured()
    found = resources(ERP, ClusterOptions(), {("erp", False): Measured.read({"seconds": odd, "peak_rss_mb": odd})})
    assert (found.memory_gb, found.minutes) == (1.0, 5)


def test_a_stage_is_known_by_the_most_that_any_of_its_units_took():
    known = {("erp", "s01"): Measured(1.0, 200.0), ("erp", "s02"): Measured(3.0, 100.0), ("ersp", "s01"): Measured(2.0)}
    assert most(known) == {("erp", False): Measured(3.0, 200.0), ("ersp", False): Measured(2.0)}


def test_a_group_asks_by_what_a_group_took_and_no_subject():
    subjects = most({("erp", "s01"): Measured(1.0, 200.0)})
    group = Task.of("erp", GROUP)
    assert resources(group, ClusterOptions(), subjects) == resources(group, ClusterOptions(), {})
    took = most({("erp", "s01"): Measured(1.0, 200.0), ("erp", GROUP): Measured(900.0, 4096.0)})
    assert resources(group, ClusterOptions(), took) == Resources(6.0, 45, 2)


def test_the_configuration_gives_a_stage_values_of_its_own_and_names_what_is_no_stage(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("[cluster.stages.erp]\nminutes = 3\n")
    found = config.load(path, ["cluster.stages.erp.retries=7", "cluster.sbatch.qos=low"]).live["cluster"]
    assert found.stages == {"erp": StageResources(minutes=3, retries=7)}
    assert found.sbatch == {"qos": "low"}
    with pytest.raises(ConfigError, match=r"there is no stage 'epr' \(did you mean 'erp'\?\)"):
        config.load(path, ["cluster.stages.epr.minutes=3"])
