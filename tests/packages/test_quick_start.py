"""What README has a newcomer type, in a fresh system, from a clone."""

import os
import shutil

from docs.site.stage import ROOT
from tests.docs.pages import commands_of, missing_words
from tests.packages.debian import call
from tests.tiers import FRESH

LIBRARIES = "phy/engine/libraries"
PREPARED = ("git", "make", "python3-venv")
"""README: "You need Linux, Python 3.11 or newer, and make"; and a clone."""


def test_every_command_of_readme_works_and_shows_what_is_printed(base, tmp_path):
    debian = base.copy(tmp_path / "root")
    debian.install("--no-install-recommends", *PREPARED)
    clone = debian.path / "home/robot/sdrlinkd"
    call("git", "clone", "--quiet", "--no-hardlinks", ROOT, clone)
    # The modem is compiled once for all tests; `make fresh` does that in the system, too.
    if FRESH not in os.environ and (ROOT / LIBRARIES).exists():
        shutil.copytree(ROOT / LIBRARIES, clone / LIBRARIES)
    debian.run("chown -R robot: /home/robot")
    typed = commands_of((ROOT / "README.md").read_text())
    assert [each.line.split()[0] for each in typed] == ["make", ".venv/bin/sdrlinkctl"]
    for command in typed:
        screen = debian.run(f"cd sdrlinkd && {command.line}", user="robot")
        assert not missing_words(command.shown, screen), screen
        assert "1.000" in screen
    shutil.rmtree(debian.path)
