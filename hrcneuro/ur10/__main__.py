"""The simulated controller by itself: ``python -m hrcneuro.ur10``, as ``hrcneuro ur10 serve`` but without the study."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from hrcneuro.errors import HrcError
from hrcneuro.ur10 import SOFTWARE
from hrcneuro.ur10.serve import serve


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until told to end; return the exit code."""
    given = _parser().parse_args(arguments)
    try:
        return serve(
            given.address,
            powered=not given.power_off,
            faults=given.fault,
            version=given.software,
            programs=given.programs,
            open_network=given.open_network,
            as_json=given.json,
            quiet=given.quiet,
            verbose=given.verbose,
            until_stdin_closes=given.until_stdin_closes,
        )
    except HrcError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code


def _parser() -> argparse.ArgumentParser:
    # docs/robot.md and 'hrcneuro ur10 serve --help' say what each option does.
    parser = argparse.ArgumentParser(prog="python -m hrcneuro.ur10", description=__doc__, allow_abbrev=False)
    parser.add_argument("--address", default="127.0.0.1", help="where it listens: ports 29998 to 30004")
    parser.add_argument("--fault", action="append", default=[], metavar="KIND[=VALUE][@SECONDS]")
    parser.add_argument("--software", default=SOFTWARE, help="the version it says it is")
    parser.add_argument("--programs", help="a folder of URScript files that the dashboard can load")
    for name in ("power-off", "open-network", "until-stdin-closes", "json", "quiet", "verbose"):
        parser.add_argument(f"--{name}", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
