"""What came out, told from records that may be anybody's."""

import pytest

from hrcneuro.cli.results import blocks
from hrcneuro.errors import DataError


@pytest.mark.parametrize("summary", [{"..": "a"}, {"milestones": 7}])
def test_a_record_without_what_its_stage_tells_is_named(summary):
    with pytest.raises(DataError, match="the record of simulate of group does not tell") as caught:
        blocks([("simulate", "group", summary)])
    assert "hrcneuro simulate --force" in caught.value.cure
