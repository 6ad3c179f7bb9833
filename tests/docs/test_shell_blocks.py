"""What pages tell their reader to type is valid shell, and names files that exist."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(?:sh|console.*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAGES = ["systemd/README.md", "docs/radios/hackrf.md", "docs/radios/usrp.md"]


def commands(page):
    """The page's shell blocks, without screens."""
    for block in BLOCK.findall((ROOT / page).read_text()):
        lines = block.splitlines()
        typed = [line[2:] for line in lines if line.startswith("$ ")]
        yield "\n".join(typed or lines)


@pytest.mark.parametrize("page", PAGES)
def test_a_shell_can_read_it(page):
    found = list(commands(page))
    assert found
    for text in found:
        done = subprocess.run(
            ["/bin/sh", "-n"], input=text, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, ""), text


def test_what_the_systemd_page_installs_is_in_the_source():
    text = "\n".join(commands("systemd/README.md"))
    named = set(re.findall(r"(?<![\w/])((?:etc|systemd)/[\w.*@-]+)", text))
    assert {"etc/sdrlinkd.toml", "etc/registry.csv", "systemd/*.service"} <= named
    for each in named:
        assert list(ROOT.glob(each)), each
    # Folders put into PATH exist there.
    scripts = (ROOT / "pyproject.toml").read_text()
    for program in re.findall(r"/opt/sdrlinkd/bin/([\w-]+)", text):
        assert program == "pip" or f"\n{program} = " in scripts, program
