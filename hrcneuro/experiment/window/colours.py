"""The window's colours, red, green and blue from 0 to 255.

Green and blue differ in lightness by more than 3 : 1 as well, so that the areas can be told apart without seeing
colours. The path is lighter than both, and has a dark edge. The background is dark: a screen that lies face up and
fills much of the view would dazzle, and the person's pupils should change little from scene to scene.
"""

from __future__ import annotations

Colour = tuple[int, int, int]

BACKGROUND: Colour = (24, 27, 32)
BARE: Colour = (78, 84, 94)
"""A tile that is nobody's."""
AREAS: dict[str, Colour] = {"green": (66, 160, 82), "blue": (24, 57, 142)}
SEAM: Colour = (245, 245, 240)
"""The line between the two areas."""
FRAME: Colour = (128, 134, 144)
"""The line around the grid."""
PATH: Colour = (255, 246, 220)
EDGE: Colour = (12, 14, 17)
START: Colour = (12, 14, 17)
GOAL: Colour = (255, 205, 50)
TOOL: Colour = (220, 60, 40)
TEXT: Colour = (240, 240, 236)
ARROW: Colour = (255, 246, 220)
ALARM: Colour = (176, 22, 34)
ALARM_TEXT: Colour = (255, 255, 255)
