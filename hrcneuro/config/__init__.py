"""The configuration of a study: TOML and --set into the stages' frozen Config dataclasses, and back into text."""
