"""The pictures of the person's screen in docs/experiment.md.

python docs/screens.py            # needs pygame-ce; draws them anew
"""

import os
from pathlib import Path

os.environ["SDL_VIDEODRIVER"] = "dummy"

import numpy as np
import pygame

from hrcneuro.experiment import scenes
from hrcneuro.experiment.window import drawing, layout, library
from hrcneuro.paradigm.owners import Areas, Directions
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import draw_session

INCHES_42 = 2065.0  # pixels per metre of a 42-inch screen with 1920 pixels
SIZE = (1920, 1080)
HERE = Path(__file__).parent / "images"


def main() -> None:
    """Draw eight scenes on one sheet, as the person sees them."""
    library.prepare()
    pygame.display.init()
    pygame.display.set_mode((64, 64))
    pygame.font.init()
    _, blocks = draw_session(SessionParams(), rng=np.random.default_rng(2))
    areas = next(block for block in blocks if isinstance(block.owners, Areas))
    ways = next(block for block in blocks if isinstance(block.owners, Directions) and not block.block.practice)
    path = {id(block): next(block.episodes()).path for block in (areas, ways)}
    shown = [
        scenes.before(areas), scenes.grid(areas, path=path[id(areas)]), scenes.before(ways),
        scenes.grid(ways, path=path[id(ways)]), scenes.rest(), scenes.pause("the recorder has lost eeg"),
        scenes.trouble("The robot was stopped."), scenes.end(),
    ]  # fmt: skip
    place = layout.laid_out(SIZE, INCHES_42)
    sheet = pygame.Surface((2 * SIZE[0] + 30, 4 * SIZE[1] + 90))
    sheet.fill((255, 255, 255))
    for number, scene in enumerate(shown):
        at = (number % 2 * (SIZE[0] + 30), number // 2 * (SIZE[1] + 30))
        sheet.blit(drawing.picture(scene, 0.0, place), at)
    small = pygame.transform.smoothscale(sheet, (1200, round(1200 * sheet.get_height() / sheet.get_width())))
    pygame.image.save(small, str(HERE / "experiment.png"))


if __name__ == "__main__":
    main()
