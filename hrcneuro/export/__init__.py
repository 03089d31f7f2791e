"""Artifacts in the form of other tools: a leaf, nothing of the study reads what is written here."""
