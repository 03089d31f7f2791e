"""What a screen says of its size, and when it is not believed."""

import pytest

from hrcneuro.experiment.window import edid

SCREEN = edid.Screen((1920, 1080), (930, 523))


def said(pixels=(1920, 1080), size_mm=(930, 523), size_cm=None, timing_first=True):
    """Return the 128 bytes of a screen, by the layout that VESA gives."""
    data = bytearray(128)
    data[:8] = bytes((0, 255, 255, 255, 255, 255, 255, 0))
    data[21:23] = size_cm or (size_mm[0] // 10, size_mm[1] // 10)
    at = 54 if timing_first else 72
    timing = bytearray(18)
    timing[0:2] = (14850).to_bytes(2, "little")
    timing[2], timing[4] = pixels[0] & 255, (pixels[0] >> 8) << 4 | 1
    timing[5], timing[7] = pixels[1] & 255, (pixels[1] >> 8) << 4
    timing[12], timing[13] = size_mm[0] & 255, size_mm[1] & 255
    timing[14] = (size_mm[0] >> 8) << 4 | size_mm[1] >> 8
    data[at : at + 18] = timing
    data[127] = -sum(data) % 256
    return bytes(data)


@pytest.mark.parametrize("first", [True, False])
def test_size_and_pixels_are_read(first):
    screen = edid.parse(said(timing_first=first))
    assert screen == SCREEN
    assert screen.pixels_per_metre == pytest.approx(1920 / 0.930)


@pytest.mark.parametrize(
    ("case", "data"),
    [
        ("too short", said()[:100]),
        ("another header", b"\1" + said()[1:]),
        ("one bit flipped", said()[:60] + bytes([said()[60] ^ 1]) + said()[61:]),
        ("a projector", said(size_mm=(0, 0))),
        ("a ratio in place of a size", said(size_mm=(160, 90), size_cm=(93, 52))),
        ("pixels that are not square", said(size_mm=(930, 700))),
        ("millimetres against centimetres", said(size_cm=(60, 34))),
        ("nothing", b""),
    ],
)
def test_what_cannot_be_a_size_is_not_believed(case, data):
    assert edid.parse(data) is None


def test_connected_screens_are_read_from_the_system(tmp_path):
    for name, status, data in (
        ("card0-DP-1", "connected", said()), ("card0-DP-2", "disconnected", b""), ("card1-HDMI-A-1", "connected", b""),
    ):  # fmt: skip
        folder = tmp_path / name
        folder.mkdir()
        (folder / "status").write_text(status + "\n")
        (folder / "edid").write_bytes(data)
    (tmp_path / "card1-broken").mkdir()
    assert edid.connected(tmp_path) == [SCREEN, None]
    assert edid.connected(tmp_path / "absent") == []


def test_a_size_is_taken_only_where_it_is_certain():
    other, twin = edid.Screen((3840, 2160), (600, 340)), edid.Screen((1920, 1080), (530, 300))
    assert edid.pixels_per_metre((1920, 1080), [SCREEN, other]) == pytest.approx(1920 / 0.930)
    assert edid.pixels_per_metre((1280, 720), [SCREEN, other]) is None, "not its own pixels"
    assert edid.pixels_per_metre((1920, 1080), [SCREEN, twin]) is None, "two with the same pixels"
    assert edid.pixels_per_metre((1920, 1080), [SCREEN, None]) is None, "one that says nothing may be this one"
    assert edid.pixels_per_metre((1920, 1080), []) is None
