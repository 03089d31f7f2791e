"""Where other people's data lie, which are no part of the project: beside it, or beside the folder of its copies."""

from tiny_study import ROOT

SHARED = next(
    (place for up in (ROOT.parent, ROOT.parent.parent) if (place := up / "shared" / "data").is_dir()),
    ROOT.parent / "shared" / "data",
)
RECORDINGS = SHARED / "recordings"
