"""The markers as the closed loop hears them, where a connection takes its time."""

import pytest
from virtual_streams import SlowNetwork

from hrcneuro.live.hearing import Hearing
from hrcneuro.live.transport import MOVES, UNMEASURED_S
from hrcneuro.live.virtual import VirtualOutlet
from hrcneuro.paradigm import markers


def stream():
    return VirtualOutlet(MOVES, "Markers", ["marker"], sfreq=0, source_id="hrcneuro experiment s01")


def marker(trial):
    return markers.of_move("s01", scenario="iC", block=1, episode=1, trial=trial, practice=False, actor="human")


@pytest.fixture
def network():
    return SlowNetwork(stream())


@pytest.fixture
def hearing(network):
    return Hearing(network, MOVES, "s01", network.now, strange=pytest.fail, tell=lambda text: None)


def heard(hearing, network):
    return [text for _, text, _, _ in hearing.hear(network.now)]


def test_what_comes_while_it_is_connected_to_is_heard(network, hearing):
    assert not hearing.look(network.now)
    network.outlets[0].send(marker(0), network.now)
    assert heard(hearing, network) == []
    network.connect()
    assert hearing.look(network.now)
    assert heard(hearing, network) == [marker(0)]


def test_a_marker_that_two_connections_bring_is_heard_once(network, hearing):
    """Of a session that is begun anew: liblsl finds its new run by itself, while it is connected to as another one."""
    hearing.look(network.now)
    network.connect()
    assert hearing.look(network.now)
    network.recovers = True
    network.outlets[0].close()
    network.outlets.append(stream())
    assert not hearing.look(network.now)
    # The old connection goes over to the new run.
    assert heard(hearing, network) == []
    network.outlets[1].send(marker(1), network.now)
    assert heard(hearing, network) == [marker(1)]
    network.connect()
    assert hearing.look(network.now)
    network.outlets[1].send(marker(2), network.now)
    assert heard(hearing, network) == [marker(2)]


def test_until_the_clocks_are_compared_what_has_come_waits_but_not_for_ever(network, hearing):
    hearing.look(network.now)
    _, inlet = network.connecting[0]
    measured, inlet.offsets = inlet.offsets, list
    network.connect()
    assert hearing.look(network.now)
    network.outlets[0].send(marker(0), network.now)
    assert heard(hearing, network) == []
    network.now += 1.0
    inlet.offsets = measured
    assert heard(hearing, network) == [marker(0)]
    # Of the next run they are never compared.
    network.outlets.append(stream())
    network.outlets[0].close()
    assert not hearing.look(network.now)
    network.connecting[0][1].offsets = list
    network.connect()
    assert hearing.look(network.now)
    network.outlets[1].send(marker(1), network.now)
    assert heard(hearing, network) == []
    network.now += UNMEASURED_S
    assert heard(hearing, network) == [marker(1)]
