"""The search for what the tests miss: it finds what is planted, in a program of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.mutants.changes import changed, changes
from tests.mutants.ledger import Ledger, Row
from tests.mutants.live import Live
from tests.mutants.planted import PLANTED

ROOT = Path(__file__).parents[1]

PRODUCT = '''
"""Adds up."""
LIMIT = 10

def bounded(values, limit=LIMIT):
    """At most `limit`."""
    total = 0
    for value in values:
        total += value
    return min(total, limit)

class Meter:
    def __init__(self):
        self.count = 0
        self.unused = 0

    def read(self, on: int | None = None) -> int:
        """Counts."""
        self.count += 1
        if self.count < 0:
            raise ValueError(f"{self.count + 1} is too few")
        return self.count

def never(n):
    while n > 0:
        n = n - 1
    return n

def unknown():
    return 5
'''
TESTS = """
import pytest
from product.sums import Meter, bounded, never

def test_bounded():
    assert bounded([1, 2]) == 3
    assert bounded([11]) == 10

@pytest.fixture(scope="module")
def meter():
    return Meter()

def test_meter():
    assert Meter().read() == 1

def test_meter_again(meter):
    before = meter.count
    assert meter.read() == before + 1

def test_never():
    assert never(3) == 0

@pytest.mark.long
def test_left_out():
    assert Meter().unused == 0
"""


def named(source):
    return {f"{each.function}: {each.what}" for each in changes("sums.py", source)}


def test_what_is_changed_and_what_is_not():
    assert named(PRODUCT) == {
        "bounded: 0 to 1 in total = 0",
        "bounded: + to - in total += value",
        "bounded: deleted total += value",
        "bounded: None for return min(total, limit)",
        "bounded: min to max in min(total, limit)",
        "Meter.__init__: deleted self.count = 0",
        "Meter.__init__: 0 to 1 in self.count = 0",
        "Meter.__init__: deleted self.unused = 0",
        "Meter.__init__: 0 to 1 in self.unused = 0",
        "Meter.read: + to - in self.count += 1",
        "Meter.read: deleted self.count += 1",
        "Meter.read: 1 to 2 in self.count += 1",
        "Meter.read: negated if self.count < 0",
        "Meter.read: < to <= in self.count < 0",
        "Meter.read: 0 to 1 in self.count < 0",
        "Meter.read: None for return self.count",
        "never: negated while n > 0",
        "never: > to >= in n > 0",
        "never: 0 to 1 in n > 0",
        "never: - to + in n - 1",
        "never: 1 to 2 in n - 1",
        "never: None for return n",
        "unknown: None for return 5",
        "unknown: 5 to 6 in return 5",
    }


def test_names_do_not_depend_on_what_stands_above():
    assert named("import os\n\n" + PRODUCT) == named(PRODUCT)


def loaded(path, source):
    path.write_text(source)
    module = ModuleType("mine")
    exec(compile(source, str(path), "exec"), vars(module))
    return module


LIVE = """
from functools import cache, partial

@cache
def cached(x):
    return x + 1

part = partial(cached, 1)

class C:
    @property
    def p(self):
        return [y < 2 for y in (1, 2)]

def outer():
    def inner():
        return 3
    return inner

f = outer()
"""


@pytest.mark.parametrize(
    ("what", "use", "before", "after"),
    [
        ("+ to - in x + 1", "part()", 2, 0),
        ("< to <= in y < 2", "C().p", [True, False], [True, True]),
        ("3 to 4 in return 3", "f()", 3, 4),
        ("3 to 4 in return 3", "outer()()", 3, 4),
    ],
)
def test_live_functions_are_exchanged_wherever_they_are(tmp_path, what, use, before, after):
    path = tmp_path / "mine.py"
    module = loaded(path, LIVE)
    if use != "part()":
        assert eval(use, vars(module)) == before
    change = next(each for each in changes("mine.py", LIVE) if each.what == what)
    Live({path: module}).maker(path, compile(changed(LIVE, change), str(path), "exec"))()
    assert eval(use, vars(module)) == after


def test_constants_are_exchanged_for_the_functions_of_their_module(tmp_path):
    path = tmp_path / "mine.py"
    source = "KNOWN = {1}\ndef f(x):\n    return x in KNOWN\n"
    module = loaded(path, source)
    live = Live({path: module})
    with pytest.raises(ValueError, match="nothing to change"):
        live.maker(path, compile(source + "# the same", str(path), "exec"))
    live.maker(path, compile(source.replace("{1}", "{2}"), str(path), "exec"))()
    assert [module.f(x) for x in (1, 2)] == [False, True]


@pytest.mark.parametrize("planted", PLANTED, ids=lambda each: each.name)
def test_what_is_planted_can_be(planted):
    source = (ROOT / planted.file).read_text()
    compile(planted.changed(source), planted.file, "exec")


def test_enough_is_enough():
    assert Row(lines=1, drawn=100, killed=85, survived=15).is_enough
    assert not Row(lines=1, drawn=100, killed=84, survived=16).is_enough
    assert Row(lines=1, drawn=100, killed=81, survived=19, equivalent=5).is_enough
    assert not Row(lines=1, drawn=100, killed=94, survived=6, equivalent=6).is_enough


def test_a_reason_is_kept_for_as_long_as_the_change_survives():
    before = changes("sums.py", PRODUCT)
    ledger = Ledger()
    ledger.take(1, {"sums": Row(20)}, before, dict.fromkeys(before[:3], ""), {})
    assert [each["drawn"] for each in ledger.survivors] == [True] * 3
    ledger.survivors[0] |= {"reason": "nobody asks", "equivalent": True}
    moved = changes("sums.py", "\n" + PRODUCT)
    assert ledger.known(moved[0]) == ("nobody asks", True)
    ledger.take(2, {"sums": Row(20)}, moved, {moved[5]: ""}, {})
    kept, new = ledger.survivors
    assert (kept["line"], kept["reason"], kept["drawn"]) == (
        before[0].line + 1,
        "nobody asks",
        False,
    )
    assert (new["what"], new["reason"], new["drawn"]) == (moved[5].what, "", True)
    ledger.take(3, {"sums": Row(20)}, moved, {moved[0]: "test_bounded"}, {})
    assert ledger.survivors == []


@pytest.mark.slow
def test_a_run_tells_which_changes_no_test_noticed(tmp_path):
    (tmp_path / "product").mkdir()
    (tmp_path / "product" / "sums.py").write_text(PRODUCT)
    (tmp_path / "tests" / "product").mkdir(parents=True)
    (tmp_path / "tests" / "product" / "test_sums.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    long: not here\n")
    (tmp_path / "docs" / "measured").mkdir(parents=True)
    done = subprocess.run(
        [sys.executable, "-m", "tests.mutants", "product", "--keep", "--seed", "3"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stdout + done.stderr
    told = json.loads((tmp_path / "docs" / "measured" / "mutants.json").read_text())
    assert told["seed"] == 3
    survivors = {f"{each['function']}: {each['what']}" for each in told["survivors"]}
    assert survivors == {
        "Meter.__init__: deleted self.unused = 0",
        "Meter.__init__: 0 to 1 in self.unused = 0",
        "Meter.read: < to <= in self.count < 0",
        "Meter.read: 0 to 1 in self.count < 0",
        "unknown: None for return 5",
        "unknown: 5 to 6 in return 5",
    }
    row = told["packages"]["product"]
    assert (row["drawn"], row["killed"], row["survived"]) == (24, 18, 6)
    assert "product/sums.py:15 Meter.__init__: deleted self.unused = 0" in done.stdout
