"""A hub whose air loses a share of the bursts, and can be cut."""

from random import Random

import pytest

from backends import World
from tests.backends.hubs import serving
from tests.daemon.ether import AIR


class RoughWorld(World):
    """An air that loses a share of the bursts, and can be cut."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.rng, self.loss, self.is_cut = Random(1), 0.0, False

    def hop(self, sender, receiver, t):
        if self.is_cut or self.rng.random() < self.loss:
            return None
        return super().hop(sender, receiver, t)


@pytest.fixture(scope="module")
def world():
    return []


@pytest.fixture(scope="module")
def hub(tmp_path_factory, world):
    folder = tmp_path_factory.mktemp("hub")

    def make(*arguments):
        world.append(RoughWorld(*arguments))
        return world[0]

    with serving(folder, **AIR, snr_db=30.0, world=make):
        yield folder


@pytest.fixture
def air(hub, world):
    yield world[0]
    world[0].loss, world[0].is_cut = 0.0, False
