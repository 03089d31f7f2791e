"""What the tests of this room share."""

from own_lsl import lsl

__all__ = ["lsl"]
