"""What carries streams over LSL: whoever sends, decides or records beside it never waits."""

import contextlib
import socket
import time

from hrcneuro.live.lsl import LslNetwork, LslOutlet

SOON_S = 0.4  # measuring the clocks' difference for the first time takes liblsl 0.6 s
PATIENCE = 60.0


def took(act):
    """Return what ``act`` returns, and how long it took, seconds."""
    begun = time.monotonic()
    return act(), time.monotonic() - begun


def test_neither_connecting_nor_measuring_nor_closing_is_waited_for(lsl):
    outlet = LslOutlet("words", "Markers", ["word"], sfreq=0, source_id="test words")
    until = time.monotonic() + PATIENCE
    with LslNetwork() as network:
        while not (found := [one for one in network.visible() if one.source_id == "test words"]):
            assert time.monotonic() < until
        opening, waited = took(lambda: network.opening(found[0]))
        assert waited < SOON_S
        inlet = opening.result(timeout=PATIENCE)
        longest, offsets, heard = 0.0, [], []
        outlet.send("one", network.clock())
        while not (offsets and heard):
            assert time.monotonic() < until
            samples, waited = took(inlet.pull)
            heard += [row[0] for row in samples.values]
            offsets += inlet.offsets()
            longest = max(longest, waited)
        assert longest < SOON_S
        assert heard == ["one"]
        assert abs(offsets[0][1]) < 0.05
        outlet.close()
        _, waited = took(inlet.close)
        assert waited < SOON_S


def test_a_stream_is_seen_though_others_hold_the_ports_that_liblsl_asks_by_itself(lsl):
    with contextlib.ExitStack() as others:
        for port in range(16572, 16572 + 32):
            taken = others.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with contextlib.suppress(OSError):
                taken.bind(("", port))
        # Of several, the one that came last is heard by who asks all: it must not be that alone.
        for name in ("first", "second", "third"):
            outlet = LslOutlet(name, "Markers", ["word"], sfreq=0, source_id=f"test ports {name}")
            others.callback(outlet.close)
        names = {"first", "second", "third"}
        until = time.monotonic() + PATIENCE
        network = others.enter_context(LslNetwork())
        while not names <= {one.name for one in network.visible()}:
            assert time.monotonic() < until, {one.name for one in network.visible()}
