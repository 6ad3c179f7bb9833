"""Command lines of sdrlinkctl, run in this process."""

import pytest

from sdrlinkd.cli import run


@pytest.fixture
def ctl(capsys):
    """Runs a command line; (exit code, stdout, stderr). No traceback is allowed."""

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return code, out, err

    return call
