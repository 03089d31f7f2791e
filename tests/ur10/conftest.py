"""Fixtures: see ``ur10_robot``."""

import pytest
from ur10_robot import Robot, Served, Stream


@pytest.fixture
def robot():
    return Robot()


@pytest.fixture
def new_robot():
    return Robot


@pytest.fixture
def served():
    """Start controllers; they end with the test."""
    running = []

    def start(*options):
        running.append(Served(*options))
        return running[-1]

    yield start
    for one in running:
        if one.process.poll() is None:
            one.end()


@pytest.fixture(scope="module")
def shared():
    """One controller for all tests of a module."""
    one = Served()
    yield one
    if one.process.poll() is None:
        one.end()


@pytest.fixture
def stream():
    links = []

    def connect(served):
        links.append(Stream(served))
        return links[-1]

    yield connect
    for one in links:
        one.link.close()
