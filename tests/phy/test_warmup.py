"""The warm-up compiles everything that a link runs; where compiled code is stored."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import phy

ROOT = Path(phy.__file__).parents[1]
CALLED = """
import inspect, re, sys, phy
from numba.core.dispatcher import Dispatcher
phy.warm_up()
for name, module in sorted(sys.modules.items()):
    if name.startswith("phy.") and not name.startswith(("phy.kernels", "phy.wifi")):
        called = set(re.findall(r"\\b(\\w+)\\(", inspect.getsource(module)))
        known = {**vars(vars(module).get("kernel", object)), **vars(module)}
        for key in called & set(known):
            if isinstance(known[key], Dispatcher):
                print(key, len(known[key].signatures))
"""
# Kernels that measure bursts, which no link uses.
MEASURED = {"encode_blocks"}
# One small kernel, and the place where numba stored it.
SMALL = """
import numpy as np, phy
from phy.kernels.rotation import lean
lean(0.1, np.arange(3), np.empty((2, 3), np.float32))
print(lean._cache.cache_path, sum(lean.stats.cache_hits.values()), phy.temporary_cache())
"""


def test_every_kernel_that_the_modem_calls_is_warm():
    """Includes kernels of rare cases: a second look at a header, slipping windows."""
    done = subprocess.run(
        [sys.executable, "-c", CALLED], capture_output=True, text=True, check=True
    )
    called = dict(line.split() for line in done.stdout.splitlines())
    assert len(called) > 12
    assert {name for name, count in called.items() if count == "0"} == MEASURED


@pytest.fixture
def small(tmp_path):
    """Runs a kernel of another user's code; (folder of its cache, hits, log)."""
    shutil.copytree(ROOT / "phy", tmp_path / "phy", ignore=shutil.ignore_patterns("__pycache__"))
    # Equivalent to a folder without write permission, but also works for root.
    (tmp_path / "phy/kernels/__pycache__").write_text("")
    (tmp_path / "nowhere").write_text("")
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "nowhere"), "PYTHONDONTWRITEBYTECODE": "1"}

    def run(temporary):
        code = f"import tempfile; tempfile.tempdir = {str(temporary)!r}{SMALL}"
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path, capture_output=True, text=True, env=environment, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        path, hits, told = done.stdout.split()
        return Path(path), int(hits), Path(told)

    return run


@pytest.mark.slow
def test_who_can_write_nowhere_else_keeps_it_in_a_folder_of_his_own(small, tmp_path):
    temporary = tmp_path / "tmp"
    temporary.mkdir(mode=0o777)
    found = [small(temporary) for _ in range(2)]
    own = temporary / f"sdrlinkd-{os.geteuid()}"
    assert [hits for _, hits, _ in found] == [0, 1]
    assert {path.parent for path, _, _ in found} == {told for _, _, told in found} == {own}
    assert own.stat().st_mode & 0o777 == 0o700


@pytest.mark.slow
def test_what_others_may_write_is_not_run(small, tmp_path):
    """Compiled code is executed: a writer of the folder could run code of his own."""
    temporary = tmp_path / "tmp"
    (temporary / f"sdrlinkd-{os.geteuid()}").mkdir(parents=True)
    (temporary / f"sdrlinkd-{os.geteuid()}").chmod(0o777)
    path, hits, told = small(temporary)
    assert hits == 0
    assert path.parent == told != temporary / f"sdrlinkd-{os.geteuid()}"
    assert told.stat().st_mode & 0o777 == 0o700
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    link = temporary / f"sdrlinkd-{os.geteuid()}"
    link.rmdir()
    link.symlink_to(elsewhere)
    assert small(temporary)[2] != link


@pytest.mark.slow
def test_where_nothing_can_be_written_it_runs_all_the_same(small, tmp_path):
    assert [small(tmp_path / "nowhere")[1] for _ in range(2)] == [0, 0]
