"""Recordings and logs in the authors' layout: the fixtures of the tests that read them."""

import importlib.util
from pathlib import Path

_spec = importlib.util.spec_from_file_location("writers_of_sources", Path(__file__).parents[1] / "sources/conftest.py")
assert _spec is not None
assert _spec.loader is not None
_writers = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_writers)
moves, study = _writers.moves, _writers.study
write_set, write_xdf = _writers.write_set, _writers.write_xdf
write_log, noise_uv = _writers.write_log, _writers.noise_uv
