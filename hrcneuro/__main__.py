"""The entry point."""

from __future__ import annotations

import sys


def main() -> None:
    """Run ``hrcneuro`` with the arguments of this process, and exit."""
    try:
        from hrcneuro.cli.app import app

        if "--json" in sys.argv[1:]:
            sys.exit(_for_a_program(app))
        app(prog_name="hrcneuro")
    except KeyboardInterrupt:
        # So early that no command has begun.
        sys.exit(130)


def _for_a_program(app: object) -> int:
    """Return the exit code; a mistake in the command line itself is told in JSON too."""
    try:
        return int(app(prog_name="hrcneuro", standalone_mode=False) or 0)  # type: ignore[operator]
    except Exception as error:
        # Typer's own errors; their class lives in a module that moves from version to version.
        if not hasattr(error, "format_message") or not hasattr(error, "show"):
            raise
        from hrcneuro.cli.console import Console
        from hrcneuro.errors import ConfigError

        mistake = ConfigError(error.format_message(), cure="hrcneuro COMMAND --help lists what is allowed")
        Console(as_json=True).fail(" ".join(a for a in sys.argv[1:2] if not a.startswith("-")), mistake)
        return mistake.exit_code


if __name__ == "__main__":
    main()
