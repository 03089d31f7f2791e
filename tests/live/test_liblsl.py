"""What a laboratory has configured of liblsl counts; what it leaves open is chosen: warnings are told, no more."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("mne_lsl", reason="mne-lsl is not installed: hrcneuro[lsl]")

CONFIGURED = "[lab]\nKnownPeers = {{127.0.0.1}}\nSessionID = {session}\n[multicast]\nResolveScope = machine\n"
SCRIPT = """
from hrcneuro.live.liblsl import library
lsl = library("this test needs")
outlet = lsl.StreamOutlet(lsl.StreamInfo("a", "Markers", 1, 0, "string", "a"))
(found,) = lsl.resolve_streams(timeout=5.0, minimum=1, name="a")
print(found.session_id)
"""


@pytest.mark.parametrize(
    ("log", "told"),
    [("", False), ("[log]\n; level = 0\n", False), ("[log]\nlevel = -2\n", False), ("[log]\nlevel = 0\n", True)],
)
def test_what_is_in_order_is_told_only_where_a_laboratory_wants_it(tmp_path, log, told):
    session, place = f"hrcneuro-test-{os.getpid()}", tmp_path / "lsl_api.cfg"
    place.write_text(CONFIGURED.format(session=session) + log)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, "LSLAPICFG": str(place)}, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == session
    assert ("INFO" in done.stderr) == told, done.stderr
