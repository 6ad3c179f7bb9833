"""Blocks of code in all pages: what is not run is at least read by what would read it."""

import ast
import importlib
import json
import re
import shlex
import shutil
import subprocess
import tomllib

import msgspec
import pytest
import typer

from docs.site.stage import documents
from sdrlinkd.cli.app import app
from sdrlinkd.cli.commands import COMMANDS
from sdrlinkd.config import parse_config
from sdrlinkd.lab import Scenario
from tests.docs.pages import ROOT, blocks, commands_of
from tests.machine import lacks

SHELL = [
    pytest.param(page, text, id=f"{page}-{number}")
    for page in documents()
    for number, (_, text) in enumerate(blocks(page, "sh"))
]
OF_OTHERS = ("backends/README.md",)
"""Pages whose TOML is another package's."""
TOML = [
    pytest.param(text, id=f"{page}-{number}")
    for page in documents()
    if page not in OF_OTHERS
    for number, (_, text) in enumerate(blocks(page, "toml"))
]
PYTHON = [
    pytest.param(text, id=f"{page}-{number}")
    for page in documents()
    for number, (_, text) in enumerate(blocks(page, "python"))
]


@pytest.fixture(scope="module")
def commands():
    """The whole command tree."""
    for each in COMMANDS.values():
        for module in each.modules:
            importlib.import_module(f"sdrlinkd.cli.{module}")
    return typer.main.get_group(app)


def read_by_click(tree, line):
    """Parse a line as sdrlinkctl does; raises where an option or command is unknown."""
    words = shlex.split(line, comments=True)
    words = words[: next((i for i, word in enumerate(words) if word in "&&||>&"), len(words))]
    command, arguments = tree, words[1:]
    while getattr(command, "commands", None):
        name = next((word for word in arguments if word in command.commands), None)
        if name is None:
            break
        command, arguments = command.commands[name], arguments[arguments.index(name) + 1 :]
    command.make_context(words[0], list(arguments), resilient_parsing=False)


@pytest.mark.parametrize(("page", "text"), SHELL)
def test_shellcheck_has_no_complaint(page, text):
    if shutil.which("shellcheck") is None:
        pytest.skip(lacks("shellcheck"))
    done = subprocess.run(
        ["shellcheck", "--shell=sh", "--severity=warning", "-"], input=text, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{page}\n{done.stdout}"


@pytest.mark.parametrize(("page", "text"), SHELL)
def test_sdrlinkctl_knows_what_is_typed(commands, page, text):
    for line in re.findall(r"^(?:\.venv/bin/)?sdrlinkctl .*$", text, re.MULTILINE):
        read_by_click(commands, line)


def test_an_unknown_option_would_be_found(commands):
    with pytest.raises(Exception, match="No such option"):
        read_by_click(commands, "sdrlinkctl status --tidy")


@pytest.mark.parametrize("text", TOML)
def test_toml_is_a_configuration_or_a_scenario(text):
    tables = tomllib.loads(text)
    if "robot" in tables:
        assert len(msgspec.convert(tables, Scenario).robot) >= 1
    else:
        parse_config(text)


@pytest.mark.parametrize("text", PYTHON)
def test_python_is_python_and_imports_what_is_there(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module.startswith(("sdrlinkd", "rosbags")):
            module = importlib.import_module(node.module)
            for each in node.names:
                assert hasattr(module, each.name), f"{node.module}.{each.name}"


def test_every_block_says_its_language():
    for page in documents():
        text = (ROOT / page).read_text()
        fences = re.findall(r"^```(\w*)", text, re.MULTILINE)
        assert all(fences[::2]), page
        assert not any(fences[1::2]), page


def test_console_blocks_hold_commands():
    for page in documents():
        for _, text in blocks(page, "console"):
            assert text.startswith("$ "), page
        for _, text in blocks(page, "sh"):
            assert "$ " not in re.sub(r"\$\{?\w", "", text), page
    assert len(commands_of((ROOT / "README.md").read_text())) >= 2


def test_what_the_systemd_page_installs_is_in_the_source():
    text = "\n".join(body for _, body in blocks("systemd/README.md", "sh"))
    named = set(re.findall(r"(?<![\w/])((?:etc|systemd)/[\w.*@-]+)", text))
    assert {"etc/sdrlinkd.toml", "etc/registry.csv", "systemd/*.service"} <= named
    for each in named:
        assert list(ROOT.glob(each)), each
    # What is put into PATH is there to be put.
    scripts = (ROOT / "pyproject.toml").read_text()
    for program in re.findall(r"/opt/sdrlinkd/bin/([\w-]+)", text):
        assert program == "pip" or f"\n{program} = " in scripts, program


def test_json_is_json():
    for page in documents():
        for _, text in blocks(page, "json"):
            json.loads(text)
