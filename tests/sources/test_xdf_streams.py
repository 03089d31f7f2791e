"""Which streams of an XDF file are markers."""

from hrcneuro.live.transport import DECISIONS
from hrcneuro.sources.formats.xdf_streams import marker_streams


def stream(name, form="string", rate="0"):
    return {"info": {"name": [name], "type": ["Markers"], "channel_format": [form], "nominal_srate": [rate]}}


def test_what_the_closed_loop_decides_marks_no_event():
    moves, decisions, eeg = stream("hrcneuro-moves"), stream(DECISIONS), stream("amp", "float32", "250")
    assert marker_streams([decisions, moves, eeg]) == ([moves], [decisions, eeg])
