"""What an experiment writes, line by line."""

import json

from hrcneuro.experiment.disk import Growing


def test_a_text_that_is_no_utf8_is_written_as_json_reads_it_again(tmp_path):
    place = tmp_path / "lines.jsonl"
    growing = Growing(place, new=True)
    entry = {"marker": "move \ud800 é"}
    growing.add(json.dumps(entry, ensure_ascii=False) + "\n")
    growing.write()
    assert json.loads(place.read_text(encoding="utf-8")) == entry
