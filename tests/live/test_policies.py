"""What is taken up of the closed loop's words, and what is seen of the loop itself."""

import json

import pytest
from virtual_streams import SlowNetwork

from hrcneuro.errors import HardwareError
from hrcneuro.live.policies import Policies, source_of
from hrcneuro.live.transport import DECISIONS
from hrcneuro.live.virtual import VirtualNetwork, VirtualOutlet

POLICY = {"N": 0.9, "E": 0.1, "S": 0.5, "W": 0.0}


def loop(subject="s01", number=7):
    return VirtualOutlet(DECISIONS, "Markers", ["decision"], sfreq=0, source_id=source_of(subject, number))


def text(policy=POLICY, mode="closed", **more):
    return json.dumps({"mode": mode, "policy": policy, "sent_s": 1.0, **more})


@pytest.fixture
def network():
    return VirtualNetwork(loop())


@pytest.fixture
def policies(network):
    one = Policies(network, network.clock, "s01")
    one.find(network.wait, patience_s=0.0)
    one.noted = []
    one.note = lambda kind, about: one.noted.append((kind, about))
    return one


def say(network, policies, *texts):
    for one in texts:
        network.outlets[0].send(one, network.now)
    policies.pull()


def test_nothing_was_said_and_either_is_as_likely(policies):
    assert (policies.policy, policies.decided, policies.mode) == (dict.fromkeys("NESW", 0.5), "", "")


def test_the_newest_policy_is_taken_up_and_each_is_noted(network, policies):
    say(network, policies, text(), text({**POLICY, "N": 0.2}, marker="move/1"), text({**POLICY, "N": 0.3}))
    assert (policies.policy["N"], policies.decided) == (0.3, "move/1")
    assert [(kind, about["policy"]["N"], about["marker"]) for kind, about in policies.noted] == [
        ("policy", 0.9, ""), ("policy", 0.2, "move/1"), ("policy", 0.3, "")
    ]  # fmt: skip


def test_in_shadow_there_is_none(network, policies):
    say(network, policies, text(None, "shadow", marker="move/4"))
    assert (policies.policy, policies.mode, policies.decided) == (None, "shadow", "move/4")


@pytest.mark.parametrize(
    "wrong",
    [
        text({**POLICY, "N": 1.1}), text({**POLICY, "N": -1e-9}), text({**POLICY, "N": float("nan")}),
        text({**POLICY, "N": float("inf")}), text({**POLICY, "N": True}), text({**POLICY, "N": "0.5"}),
        text({"N": 0.5}), text({**POLICY, "NE": 0.5}), text([0.5] * 4), text(None), text(POLICY, "shadow"),
        text(mode="open"), "",
        "[" * 100_000, '{"policy": ' + "[" * 100_000, "no JSON", "[]", "7", "null",
        json.dumps({"mode": "closed", "policy": POLICY}), text(marker="\ud800"), text(marker=7), text(marker=None),
        json.dumps({"mode": "closed", "policy": POLICY, "sent_s": "soon"}),
    ],
)  # fmt: skip
def test_what_is_not_sound_is_refused_counted_and_noted_and_the_last_one_holds(network, policies, wrong):
    say(network, policies, text(marker="move/1"), wrong)
    assert (policies.policy, policies.decided) == (POLICY, "move/1")
    assert sum(policies.refused.values()) == 1
    assert policies.noted[-1][0] == "policy refused"
    say(network, policies, text({**POLICY, "N": 0.4}))
    assert policies.policy["N"] == 0.4


def test_a_flood_of_nonsense_is_counted_and_does_not_fill_the_log(network, policies):
    say(network, policies, *(f"nonsense {i}" for i in range(500)))
    say(network, policies, *(text(mode=f"mode {i}") for i in range(500)))
    assert sum(policies.refused.values()) == 1000
    assert len(policies.refused) == 2
    assert len(policies.noted) <= 40


def test_a_loop_that_is_started_anew_is_heard(network, policies):
    say(network, policies, text())
    network.outlets[0].close()
    network.outlets.clear()
    # One look may miss a stream that is there.
    assert policies.look() == ""
    network.wait(3.0)
    assert "gone" in policies.look()
    assert policies.policy == POLICY
    network.outlets.append(loop(number=8))
    assert policies.look() == ""
    say(network, policies, text({**POLICY, "N": 0.7}))
    assert policies.policy["N"] == 0.7


def test_of_several_that_are_started_anew_none_is_heard(network, policies):
    network.outlets[:] = [loop(number=8), loop(number=9)]
    network.wait(3.0)
    assert policies.look() == "2 closed loops are running: end all but one"
    del network.outlets[1]
    assert policies.look() == ""


@pytest.mark.parametrize(
    ("others", "said"),
    [([], "no closed loop of s01"), ([loop("s02")], "no closed loop of s01"), ([loop(), loop(number=8)], "2 closed")],
)  # fmt: skip
def test_it_must_be_there_once(others, said):
    network = VirtualNetwork(*others)
    with pytest.raises(HardwareError, match=said) as told:
        Policies(network, network.clock, "s01").find(network.wait, patience_s=1.0)
    assert "hrcneuro online s01" in told.value.cure


def test_a_subject_whose_name_begins_alike_is_another():
    network = VirtualNetwork(loop("s011"), loop("s01-online", 3))
    with pytest.raises(HardwareError):
        Policies(network, network.clock, "s01").find(network.wait, patience_s=0.0)


def test_a_loop_that_is_being_connected_to_is_not_gone():
    network = SlowNetwork(loop())
    one = Policies(network, network.clock, "s01")

    def wait(seconds):
        network.now += seconds
        if network.now > 1001.0:
            network.connect()

    one.find(wait, patience_s=0.0)
    network.outlets[0].there = False
    network.now += 5.0
    assert one.look() == "the closed loop is gone"
    network.outlets.append(loop(number=8))
    assert one.look() == ""
    network.outlets[1].there = False
    network.outlets.append(loop(number=9))
    assert one.look() == ""
    abandoned = network.connecting[0][1]
    network.connect()
    assert one.look() == ""
    network.outlets[2].send(text(), network.now)
    one.pull()
    assert one.policy == POLICY
    assert abandoned not in network.outlets[1].inlets


def test_a_connection_that_never_stands_is_a_loop_that_is_gone():
    network = SlowNetwork(loop())
    one = Policies(network, network.clock, "s01")
    assert one.look() == ""
    network.now += 3.0
    assert one.look() == "the closed loop is gone"
