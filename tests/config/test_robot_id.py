"""Which robot this is, by the paper's rule (section 4.3)."""

import pytest

from sdrlinkd.config import Config, make_setup
from sdrlinkd.errors import ConfigError


@pytest.fixture
def setup(tmp_path):
    """A setup from topic names and keys of the configuration."""

    def make(names=("odom", "scan"), **keys):
        csv = "Topic, Type\n" + "".join(f"{name}, nav_msgs/Odometry\n" for name in names)
        (tmp_path / "registry.csv").write_text(csv)
        return make_setup(Config(**keys), tmp_path, "f.toml")

    return make


@pytest.mark.parametrize(
    ("namespace", "node_id"),
    [
        ("robot_1", 1), ("/robot_34", 34), ("fleet2/robot7", 7), ("r254", 254), ("r2d2", 2),
        ("robot_7/base", 7), ("r2d2_unit", 2), ("robot_007", 7), ("robot_0", 0),
        ("/robot_34/sensors/front", 34), ("r000000000000254", 254),
    ],
)  # fmt: skip
def test_the_rightmost_digits_of_the_namespace(setup, namespace, node_id):
    assert setup(namespace=namespace).node_id == node_id


@pytest.mark.parametrize(
    ("namespace", "problem"),
    [
        ("robot", 'in "robot" it is missing'),
        ("r255", 'in "r255" it is 255, above 254'),
        ("robot_7/cam_640", 'in "robot_7/cam_640" it is 640, above 254'),
        ("r" + "1" * 5000, "above 254"),
    ],
)
def test_a_namespace_without_a_usable_number_needs_a_robot_id(setup, namespace, problem):
    with pytest.raises(ConfigError) as error:
        setup(namespace=namespace)
    assert f"{error.value}".startswith("f.toml: robot_id: got -1 (the last number in the namespace")
    assert problem in str(error.value)
    assert "allowed: robot_id from 0 to 254" in str(error.value)
    assert len(str(error.value)) < 400
    assert setup(namespace=namespace, robot_id=9).node_id == 9


@pytest.mark.parametrize(
    ("names", "node_id"),
    [
        (["/robot_3/scan", "/robot_3/odom"], 3),
        (["robot_3/scan", "tf", "clock"], 3),
        (["r2d2/scan", "r2d02/odom"], 2),
        (["scan_5"], 5),
    ],
)
def test_without_a_namespace_the_names_in_the_registry_tell(setup, names, node_id):
    assert setup(names, namespace="").node_id == node_id


def test_names_that_are_not_taken_do_not_tell(setup):
    names = ["robot_3/odom", "robot_4/odom"]
    assert setup(names, namespace="", topics=["/robot_4/odom"]).node_id == 4


def test_names_that_disagree_are_listed(setup):
    with pytest.raises(ConfigError) as error:
        setup(["robot_3/odom", "robot_3/scan", "robot_4/odom", "r640"], namespace="")
    told = "they disagree: 3 in /robot_3/odom, 4 in /robot_4/odom, 640 in /r640; allowed: robot_id"
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("names", "problem"),
    [(["odom", "scan"], "no name has digits"), (["robot_255/odom"], "255 in /robot_255/odom")],
)
def test_names_without_a_usable_number_need_a_robot_id(setup, names, problem):
    with pytest.raises(ConfigError, match="robot_id: got -1") as error:
        setup(names, namespace="")
    assert problem in str(error.value)
    assert setup(names, namespace="", robot_id=9).node_id == 9


def test_of_many_that_disagree_some_are_listed(setup):
    with pytest.raises(ConfigError, match="and 6 more"):
        setup([f"robot_{i}/odom" for i in range(10)], namespace="")
