"""Type the commands of docs/start/first_hour.md and write what they print into the page, after results have changed:

    python tests/product/first_hour.py

What differs from run to run and from machine to machine becomes …; of a long output the first and last lines stay.
"""

import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from first_hour import PAGE, PARTS, entered, provide
from transcripts import steps
from wheel import enter, installed

LONGEST, FIRST, LAST = 60, 10, 3


def shown(text: str, folder: Path) -> list[str]:
    """Return the lines of an output as the page shows them."""
    text = re.sub(r"(?<=ran  )\d+\.\d s", "… s", text.replace(str(folder), "…"))
    text = re.sub(r"(?<=/)[0-9a-f]{16}\b", "…", text)
    lines = [line.rstrip() for line in text.rstrip("\n").split("\n")] if text.strip() else []
    if lines and lines[0].lstrip().startswith("hrcneuro  "):
        # doctor: what a machine has.
        values = re.compile(r"^((?:numerics|libraries|extras|room)?\s+\S+(?: free)?\s+)\S.*$")
        lines = [line if line.endswith(" ok") else values.sub(r"\1…", line) for line in lines]
    return lines if len(lines) <= LONGEST else [*lines[:FIRST], "…", *lines[-LAST:]]


def main() -> None:
    """Write the page anew."""
    with tempfile.TemporaryDirectory() as home:
        programs, made = installed(Path(home)), []
        for section in re.split(r"^(?=## )", PAGE.read_text(), flags=re.M):
            part = next((name for name in PARTS if section.startswith(f"## {name}\n")), None)
            if part is not None:
                base = Path(tempfile.mkdtemp(dir=home))
                provide(part, base)
                section = _anew(section, base, programs)
            made.append(section)
    PAGE.write_text("".join(made))


def _anew(section: str, base: Path, programs: Path) -> str:
    folder = base

    def fill(block: re.Match) -> str:
        nonlocal folder
        lines = []
        for command, _ in steps(block[1]):
            code, text = enter(command, folder, programs)
            print(f"{code}  {command}", flush=True)
            lines += [f"$ {command}", *shown(text, base)]
            folder = entered(command, folder)
        return "\n".join(["```console", *lines, "```\n"])

    return re.sub(r"^```console\n(.*?)^```\n", fill, section, flags=re.M | re.S)


if __name__ == "__main__":
    main()
