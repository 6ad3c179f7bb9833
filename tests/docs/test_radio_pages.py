"""The pages about radios, from first to last command, on test radios that imitate them."""

import contextlib
import uuid

import pytest

from tests.docs.pages import ROOT, commands_of, missing_words
from tests.docs.reader import Reader
from tests.soapy_loopback import Bus, missing, module_folder

PAGES = ROOT / "docs" / "radios"
NOT_HERE = ("sudo ", "make setup", "export PATH", "hackrf_info")
"""Needs root, or a real HackRF; or it has been done."""
MAY_SAY_NO = ("sdrlinkctl doctor", "sdrlinkctl status", "sdrlinkctl plan")
"""Commands with an exit code that depends on this machine and its air."""

pytestmark = [
    pytest.mark.skipif(bool(missing()), reason=missing()),
    pytest.mark.long,
]


class Laptop(Reader):
    """A reader with a radio, whose driver the page calls `driver`."""

    def __init__(self, folder, unit, bus, driver, model):
        self.device = f"driver=loopback,model={model},bus={bus},unit={unit}"
        self._driver = driver
        super().__init__(
            folder,
            replaced={driver: self.device},
            may_say_no=MAY_SAY_NO,
            environment={
                "SOAPY_SDR_PLUGIN_PATH": str(module_folder()),
                "SOAPY_SDR_ROOT": "/nonexistent",
            },
        )

    def type(self, command):
        """Type a command; files that it wrote name this radio then."""
        shown = super().type(command)
        for path in self.folder.glob("team/*.toml"):
            path.write_text(path.read_text().replace(f'"{self._driver}"', f'"{self.device}"'))
        return shown


@contextlib.contextmanager
def laptops(folder, driver, model):
    """`first` and `second`, on one air."""
    name = f"page-{uuid.uuid4().hex[:12]}"
    with Bus(name), contextlib.ExitStack() as stack:
        made = {}
        for unit, who in enumerate(("first", "second")):
            made[who] = Laptop(folder / who, unit, name, driver, model)
            stack.callback(made[who].close)
        yield made


def walk(page, typists, default=""):
    """Type every command of a page, as `default` if it names no typist; returns their number."""
    run = 0
    for command in commands_of((PAGES / page).read_text()):
        named = command.who or default
        if command.line.startswith(NOT_HERE):
            continue
        assert named, f"who types this? {command.line}"
        for who in typists if named == "both" else [named]:
            typists[who].see(command)
            run += 1
        if command.line.startswith("sdrlinkctl init"):
            # "Copy the folder to the second laptop."
            first, second = typists["first"], typists["second"]
            first.copy("team", second)
            copied = second.folder / "team" / "robot_2.toml"
            copied.write_text(copied.read_text().replace(first.device, second.device))
    return run


def test_the_hackrf_page_works_and_shows_what_is_printed(tmp_path):
    with laptops(tmp_path, "driver=hackrf", "hackrf") as both:
        assert walk("hackrf.md", both) >= 14


def test_the_usrp_page_works_and_shows_what_is_printed(tmp_path):
    with laptops(tmp_path, "driver=uhd", "usrp") as both:
        assert walk("usrp.md", both, default="first") >= 3


def test_words_that_are_not_on_the_screen_are_missed():
    assert missing_words(("SNR 33 dB", "…"), "SNR 7 dB") == {}
    assert missing_words(("registry same",), "registry differs") == {"registry same": ["same"]}
