"""Edges to running laboratories: streams in and out, around the numeric packages."""
