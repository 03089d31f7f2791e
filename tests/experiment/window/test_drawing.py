"""What is where in the picture of a scene, and that it can be seen."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.experiment.messages import Motion, Scene
from hrcneuro.experiment.window.layout import as_large_as_fits, laid_out
from hrcneuro.paradigm.grid import STEPS
from hrcneuro.paradigm.owners import DIRECTION_PAIRS, TILES, draw_areas

pytestmark = pytest.mark.usefixtures("pygame")
PATH = ((5, 1), (4, 1), (3, 1), (3, 2), (3, 3), (2, 3), (2, 4), (1, 4), (1, 5))
AREA = draw_areas(np.random.default_rng(4)).human
SC = Scene(scenario="sC", human_tiles=AREA, human_colour="green", path=PATH)
IC = Scene(scenario="iC", human_directions=frozenset("NW"), path=PATH)
SCREENS = [(1920, 1080), (1280, 720), (3840, 2160)]
LAYOUT = laid_out((1920, 1080), 1920 / 0.930)  # 42 inches


@pytest.fixture(scope="module")
def drawing(pygame):
    from hrcneuro.experiment.window import drawing

    return drawing


def pixels(surface):
    """Return the picture, shape (width, height, 3)."""
    import pygame

    return pygame.surfarray.array3d(surface)


def corner(layout, tile):
    """Return a place on a tile that neither path nor seam covers: near its upper left corner."""
    left, top, width, height = layout.box(*tile)
    return round(left + 0.12 * width), round(top + 0.12 * height)


def colour_at(surface, place):
    return tuple(surface.get_at([round(one) for one in place]))[:3]


@pytest.mark.parametrize("screen", SCREENS)
@pytest.mark.parametrize("turn", [0, 90])
@pytest.mark.parametrize("mine", ["green", "blue"])
def test_every_tile_has_the_colour_of_its_owner(drawing, screen, turn, mine):
    layout = laid_out(screen, as_large_as_fits(screen), turn)
    scene = Scene(scenario="sC", human_tiles=AREA, human_colour=mine, path=PATH)
    surface = drawing.picture(scene, 0.0, layout)
    areas = drawing.colours.AREAS
    other = "blue" if mine == "green" else "green"
    for tile in TILES:
        assert colour_at(surface, corner(layout, tile)) == areas[mine if tile in AREA else other], tile


@pytest.mark.parametrize("scene", [SC, IC])
def test_the_path_is_seen_on_every_tile_of_it_and_on_no_other(drawing, scene):
    surface = drawing.picture(scene, 0.0, LAYOUT)
    for tile in TILES:
        on = colour_at(surface, LAYOUT.centre(*tile)) == drawing.colours.PATH
        assert on == (tile in PATH[1:-1]), tile
    for one, two in itertools.pairwise(PATH[1:-1]):
        between = [(a + b) / 2 for a, b in zip(LAYOUT.centre(*one), LAYOUT.centre(*two), strict=True)]
        assert colour_at(surface, between) == drawing.colours.PATH


def test_start_and_goal_differ_in_shape_as_well(drawing):
    forth, back = (drawing.picture(Scene(path=path), 0.0, LAYOUT) for path in (PATH, PATH[::-1]))
    left, top, width, height = LAYOUT.box(*PATH[0])
    start, goal = (pixels(one)[left : left + width, top : top + height].mean(axis=2) for one in (forth, back))
    # In shades of grey, too, a good part of the tile is not alike.
    assert (abs(start - goal) > 60).mean() > 0.15


def test_without_a_path_the_grid_is_bare(drawing):
    surface = drawing.picture(Scene(), 0.0, LAYOUT)
    assert all(colour_at(surface, LAYOUT.centre(*tile)) == drawing.colours.BARE for tile in TILES)


@pytest.mark.parametrize("mine", DIRECTION_PAIRS, ids=sorted)
@pytest.mark.parametrize("turn", [0, 90])
def test_the_persons_arrows_are_there_and_the_robots_are_not(drawing, mine, turn):
    layout = laid_out((1920, 1080), as_large_as_fits((1920, 1080)), turn)
    drawn = {
        key: pixels(drawing.picture(Scene(scenario="iC", human_directions=frozenset(key)), 0.0, layout))
        for key in STEPS
    }
    bare = pixels(drawing.picture(Scene(scenario="iC"), 0.0, layout))
    both = pixels(drawing.picture(Scene(scenario="iC", human_directions=mine, path=()), 0.0, layout))
    for key in STEPS:
        where = (drawn[key] != bare).any(axis=2)
        assert where.sum() > 0.2 * layout.tile**2
        assert np.array_equal(both[where], (drawn if key in mine else {key: bare})[key][where]), key
    left, top, width, height = layout.grid
    assert (both[left : left + width, top : top + height] == bare[left : left + width, top : top + height]).all()


def test_an_arrow_points_where_its_key_leads(drawing):
    from hrcneuro.experiment.window import marks

    for key, (down, right) in STEPS.items():
        alpha = np.array([[marks.arrow(key, 90).get_at((x, y))[3] for y in range(90)] for x in range(90)], float)
        # The head's broadest part lies toward where it points, the shaft behind.
        rows, columns = (alpha > 128).sum(axis=0), (alpha > 128).sum(axis=1)
        assert (np.argmax(rows) < 45) == (down < 0) or not down
        assert (np.argmax(columns) < 45) == (right < 0) or not right
        assert rows.max() != columns.max()


def test_whose_turn_it_is_is_shown_only_where_asked_for(drawing):
    plain, human, robot = (
        pixels(drawing.picture(Scene(scenario="iC", human_directions=frozenset("NW"), turn=t), 0.0, LAYOUT))
        for t in ("", "human", "robot")
    )
    assert (plain != human).any()
    assert (human != robot).any()
    left, _, width, _ = LAYOUT.grid
    assert (plain[left : left + width] == human[left : left + width]).all(), "nothing on the grid"


def test_a_drawn_tool_goes_from_tile_to_tile_by_minimum_jerk(drawing):
    motion = Motion((5, 1), (5, 2), 10.0, 0.8)
    scene = Scene(tool=motion)
    assert [drawing.tool_tile(motion, t)[1] for t in (0.0, 10.0, 10.4, 10.8, 99.0)] == pytest.approx([1, 1, 1.5, 2, 2])
    # Eq 2 at a quarter: 10/64 − 15/256 + 6/1024.
    assert drawing.tool_tile(motion, 10.2)[1] - 1 == pytest.approx(0.103515625)
    bare = pixels(drawing.picture(Scene(), 0.0, LAYOUT)).astype(int)
    for t in (9.0, 10.3, 11.0):
        changed = np.argwhere((pixels(drawing.picture(scene, t, LAYOUT)) != bare).any(axis=2))
        assert changed.mean(axis=0) == pytest.approx(LAYOUT.centre(*drawing.tool_tile(motion, t)), abs=2)


def test_scenes_are_told_apart(drawing):
    words = {"title": "Break", "lines": ("Go on with any arrow key.",)}
    scenes = [
        Scene(), SC, IC, Scene(scenario="sC", human_tiles=AREA, human_colour="blue", path=PATH),
        Scene(scenario="iC", human_directions=frozenset("ES"), path=PATH), Scene(path=PATH), Scene(**words),
        Scene(**words, alarm=True), Scene(**words, scenario="sC", human_colour="green"),
        Scene(**words, scenario="sC", human_colour="blue"),
        Scene(**words, scenario="iC", human_directions=frozenset("ES")), Scene(tool=Motion((1, 1), (1, 1), 0.0, 1.0)),
    ]  # fmt: skip
    drawn = {drawing.picture(scene, 0.0, LAYOUT).get_buffer().raw for scene in scenes}
    assert len(drawn) == len(scenes)


def test_words_stand_in_the_place_of_the_grid_and_of_the_tool(drawing):
    words = Scene(title="Break", lines=("Go on.",))
    full = Scene(title="Break", lines=("Go on.",), path=PATH, tool=Motion((1, 1), (1, 1), 0.0, 1.0), turn="human")
    assert drawing.picture(words, 0.0, LAYOUT).get_buffer().raw == drawing.picture(full, 0.0, LAYOUT).get_buffer().raw


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (Scene(scenario="xC"), "'xC'"),
        (Scene(scenario="sC", human_tiles=AREA), "human_colour ''"),
        (Scene(human_colour="red"), "'red'"),
        (Scene(human_directions=frozenset("NU")), "'U'"),
        (Scene(turn="me"), "'me'"),
        (Scene(path=((7, 0), (6, 0))), "(7, 0)"),
        (Scene(tool=Motion((0, 0), (0, 1), 0.0, 0.0)), "0.0 s"),
    ],
)
def test_a_scene_that_cannot_be_drawn_says_why(drawing, scene, said):
    assert said in "".join(drawing.mistakes(scene))
    assert not drawing.mistakes(SC) + drawing.mistakes(IC)


# --- words ------------------------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(
    title=st.text("abc äß", max_size=60),
    lines=st.lists(st.text("abcdefgh ijkl,.", max_size=200), max_size=5),
    screen=st.sampled_from([*SCREENS, (720, 1280)]),
    unbroken=st.booleans(),
)
def test_words_never_leave_the_screen_and_none_is_lost(drawing, title, lines, screen, unbroken):
    from hrcneuro.experiment.window import words

    if unbroken:
        lines = [line.replace(" ", "x") for line in lines]
    layout = laid_out(screen, as_large_as_fits(screen))
    box = (20, 30, layout.size[0] - 40, layout.size[1] - 60)
    setting = words.set_words(title, tuple(lines), box, words.X_HEIGHT_M * layout.pixels_per_metre, (255, 255, 255))
    bottom = box[1]
    for picture, (left, top) in setting.placed:
        assert left >= box[0]
        assert left + picture.get_width() <= box[0] + box[2]
        assert top >= bottom, "lines do not overlap"
        bottom = top + picture.get_height()
    assert bottom <= box[1] + box[3]
    assert setting.height <= box[3]


@pytest.mark.parametrize("text", ["", "one", "a few words", "x" * 300, "long words " * 30, "two  spaces"])
@pytest.mark.parametrize("width", [40, 300, 1900])
def test_wrapping_keeps_every_letter_in_order(drawing, text, width):
    from hrcneuro.experiment.window import words

    lines = words._wrapped(text, words.font("", 30), width)
    assert "".join("".join(lines).split()) == "".join(text.split())


@pytest.mark.parametrize("screen", SCREENS)
def test_words_are_large_enough_to_be_read_from_the_chair(drawing, screen):
    from hrcneuro.experiment.window import words

    per_metre = screen[0] / 0.930
    setting = words.set_words("", ("x",), (0, 0, *screen), words.X_HEIGHT_M * per_metre, (255, 255, 255))
    ((picture, _),) = setting.placed
    width, height = picture.get_size()
    lit = np.array([any(picture.get_at((x, y))[3] > 60 for x in range(width)) for y in range(height)])
    high_m = lit.sum() / per_metre
    assert np.degrees(np.arctan(high_m / 1.8)) == pytest.approx(0.4, abs=0.04)
    assert setting.share == 1.0


# --- colours ----------------------------------------------------------------------------------------------------------

# Machado, Oliveira & Fernandes 2009, doi:10.1109/TVCG.2009.113, severity 1, for linear RGB.
SEEN_BY = {
    "everybody": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(colour):
    share = np.array(colour) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def contrast(one, two):
    """Return the contrast of WCAG 2: 1 (the same) … 21 (black on white)."""
    dark, light = sorted(float(TO_XYZ[1] @ linear(colour)) for colour in (one, two))
    return (light + 0.05) / (dark + 0.05)


def lab(rgb):
    """Return CIELAB of linear RGB under D65."""
    x, y, z = np.cbrt(TO_XYZ @ np.clip(rgb, 0, 1) / [0.95047, 1.0, 1.08883])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("eyes", SEEN_BY)
def test_the_areas_differ_for_all_eyes(drawing, eyes):
    green, blue = (lab(np.array(SEEN_BY[eyes]) @ linear(drawing.colours.AREAS[c])) for c in ("green", "blue"))
    assert np.linalg.norm(green - blue) > 30
    assert abs(green[0] - blue[0]) > 25, "in lightness alone"


def test_contrasts(drawing):
    c = drawing.colours
    green, blue = c.AREAS["green"], c.AREAS["blue"]
    assert contrast(c.TEXT, c.BACKGROUND) >= 4.5
    assert contrast(c.ALARM_TEXT, c.ALARM) >= 4.5
    for one, two in ((green, blue), (c.PATH, green), (c.PATH, blue), (c.PATH, c.BARE), (c.PATH, c.EDGE)):
        assert contrast(one, two) >= 3, "what no words say, WCAG 1.4.11"
    for one, two in ((c.ARROW, c.BACKGROUND), (c.TOOL, c.PATH), (c.GOAL, c.EDGE), (c.FRAME, c.BACKGROUND)):
        assert contrast(one, two) >= 3
