"""A package that is missing is named with the line that installs it."""

import shlex
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.extras import EXTRAS, hint, lacking, needs

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LISTED = PROJECT["optional-dependencies"]
MAKERS = {"sdrlinkd/extras.py", "phy/engine/builder.py"}
"""Where the program makes lines for pip."""
BRIDGE = "ros/sdrlink_ros/sdrlink_ros/__main__.py"
"""It runs in ROS 2's Python, where there is nothing else of ours."""


def requirements(name):
    """As hatchling writes them into the metadata of a wheel."""
    for each in LISTED[name]:
        package, _, marker = each.partition(";")
        yield (
            f"{package}; ({marker.strip()}) and extra == '{name}'"
            if marker
            else (f"{package}; extra == '{name}'")
        )


@pytest.mark.parametrize("name", EXTRAS)
def test_the_line_has_what_the_extra_lists(monkeypatch, name):
    wheels = [*PROJECT["dependencies"], *(line for each in LISTED for line in requirements(each))]
    monkeypatch.setattr(metadata, "requires", lambda _: wheels)
    line = hint(name).removeprefix(f"{EXTRAS[name].needed}: ")
    assert shlex.split(line) == [sys.executable, "-m", "pip", "install", *LISTED[name]]


def test_a_source_tree_that_is_not_installed_is_installed_with_the_extra(monkeypatch):
    def requires(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "requires", requires)
    assert shlex.split(hint("plots"))[-1] == f"{ROOT}[plots]"


@pytest.mark.parametrize("module", EXTRAS["plots"].modules)
def test_what_is_missing_is_told_and_nothing_else_is_hidden(monkeypatch, module):
    assert lacking("plots") == ""
    monkeypatch.setitem(sys.modules, module, None)
    assert lacking("plots") == hint("plots")
    with pytest.raises(UserError) as told, needs("plots"):
        __import__(f"{module}.inner")
    assert str(told.value) == hint("plots")
    with pytest.raises(ModuleNotFoundError), needs("plots"):
        __import__("no_such_module_of_ours")


def test_no_other_part_of_the_program_makes_lines_for_pip():
    found = {
        str(path.relative_to(ROOT))
        for package in ("sdrlinkd", "backends", "phy", "ros")
        for path in (ROOT / package).rglob("*.py")
        if "pip install" in (text := path.read_text()) or '"pip", "install"' in text
    }
    assert found == {*MAKERS, BRIDGE, "ros/sdrlink_ros/setup.py"}
