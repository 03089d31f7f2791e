import pytest

from hrcneuro.robot.cell import Cell
from hrcneuro.robot.workspace import Workspace


@pytest.fixture(scope="session")
def workspace() -> Workspace:
    return Workspace(Cell())
