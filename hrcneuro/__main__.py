"""The entry point."""

from __future__ import annotations


def main() -> None:
    """Run ``hrcneuro`` with the arguments of this process, and exit."""
    from hrcneuro.cli import app

    app(prog_name="hrcneuro")


if __name__ == "__main__":
    main()
