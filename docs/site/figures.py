"""Makes the pictures of runs in docs/figures: the demo's, a lab's, and a screenshot of `top`.

`make figures` runs it after the pictures of benchmarks. It takes four minutes.
"""

import asyncio
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.kept import FIGURES, circumstances, keep
from benchmarks.processes import Stolen
from sdrlinkd.cli.following import Follower
from sdrlinkd.cli.top.live import TopApp
from sdrlinkd.process import Process

SDRLINKCTL = [sys.executable, "-m", "sdrlinkd.cli"]
SIZE = (100, 26)
WATCHED_S = 50
FONTS = re.compile(r"@font-face\s*\{[^}]*\}\s*")
"""Fonts that a browser would fetch from elsewhere."""


def main() -> int:
    """Make all of them."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        _demo(out / "demo")
        _lab(out / "lab")
    FIGURES.joinpath("top.svg").write_text(asyncio.run(_top()))
    sys.stdout.write("wrote top.svg\n")
    return 0


def _demo(out: Path) -> None:
    stolen = Stolen()
    _run("demo", "--out", str(out))
    for name in ("latency_cdf.png", "path.png"):
        shutil.copy(out / name, FIGURES)
    report = msgspec.json.decode((out / "report.json").read_bytes())
    keep("demo", {**circumstances(stolen.pct()), **report})


def _lab(out: Path) -> None:
    _run("lab", "out-and-back", "--out", str(out))
    shutil.copy(out / "lab.png", FIGURES / "out_and_back.png")
    _run("lab", "mine", "--out", str(out))
    shutil.copy(out / "lab.png", FIGURES / "mine.png")


def _run(*arguments: str) -> None:
    sys.stdout.write(f"sdrlinkctl {' '.join(arguments)}\n")
    sys.stdout.flush()
    subprocess.run([*SDRLINKCTL, *arguments], check=True, stdout=subprocess.DEVNULL)  # noqa: S603


async def _top() -> str:
    """`top` beside robot 2 of a running lab, as SVG."""
    with tempfile.TemporaryDirectory() as out:
        lab = Process(
            [*SDRLINKCTL, "lab", "two-robots", "--duration", str(WATCHED_S + 30), "--out", out],
            name="lab",
        )
        lab.start()
        try:
            return await _screenshot(_second_robot(lab))
        finally:
            lab.stop()


def _second_robot(lab: Process) -> Path:
    until = time.monotonic() + 60
    while not (found := re.search(r"--runtime-dir (\S+)/robot_1", lab.log())):
        if time.monotonic() > until or not lab.is_running:
            raise RuntimeError(lab.log())
        time.sleep(0.2)
    return Path(found[1]) / "robot_2"


async def _screenshot(runtime_dir: Path) -> str:
    def ask(verb: str, arguments: dict[str, Any]) -> Any:  # noqa: ANN401 (as the app has it)
        with Follower(runtime_dir) as once:
            return once.ask(verb, arguments)

    with Follower(runtime_dir) as follower:
        app = TopApp(follower.look, ask, lambda: follower.waiting)
        async with app.run_test(size=SIZE) as pilot:
            await asyncio.sleep(WATCHED_S)
            await pilot.pause()
            return FONTS.sub("", app.export_screenshot(title="sdrlinkctl top"))


if __name__ == "__main__":
    sys.exit(main())
