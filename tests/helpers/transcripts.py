"""Pages that show what is typed and what is printed: their blocks, and whether a line was printed."""

import re
from pathlib import Path


def blocks(page: Path, part: str = ""):
    """Return (language, content) of the fenced blocks of a page, or of the part under the heading ``part``."""
    text = page.read_text()
    if part:
        text = next(section for section in re.split(r"^## ", text, flags=re.M) if section.startswith(part))
    return re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.M | re.S)


def steps(content: str):
    """Return (command, lines that it prints) of a console block."""
    for step in f"\n{content}".split("\n$ ")[1:]:
        command, *lines = step.rstrip("\n").split("\n")
        yield command, lines


def printed(line: str, text: str) -> bool:
    """Return whether a line of a page was printed; … stands for anything."""
    pattern = ".*".join(re.escape(piece) for piece in line.rstrip().split("…"))
    return re.search(f"^{pattern}", text, flags=re.M) is not None
