"""LSL in the tests' own process: bound to this machine, and hearing nobody else."""

import os

import pytest
from live_lab import lsl_api


@pytest.fixture(scope="module")
def lsl(tmp_path_factory):
    """Return mne-lsl's low-level module, bound to this machine and to this process's streams."""
    if "LSLAPICFG" in os.environ:
        pytest.skip("LSLAPICFG is set: this laboratory's streams are its own")
    place = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    place.write_text(lsl_api(f"hrcneuro-test-{os.getpid()}"))
    os.environ["LSLAPICFG"] = str(place)
    yield pytest.importorskip("mne_lsl.lsl", reason="mne-lsl is not installed: hrcneuro[lsl]")
    del os.environ["LSLAPICFG"]
