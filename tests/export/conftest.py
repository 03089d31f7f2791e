"""Recordings and logs in foreign layouts: the fixtures of the tests that read or write them."""

from foreign import moves, noise_uv, study, write_log, write_set, write_xdf

__all__ = ["moves", "noise_uv", "study", "write_log", "write_set", "write_xdf"]
