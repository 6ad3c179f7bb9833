"""`exporter`: the figures of this host's daemons for Prometheus."""

import threading
from typing import Annotated

import typer

from sdrlinkd.cli.app import RuntimeDirs, app
from sdrlinkd.cli.listening import host_and_port
from sdrlinkd.cli.listing import directories
from sdrlinkd.errors import UserError
from sdrlinkd.extras import needs


@app.command("exporter")
def exporter(
    runtime_dir: RuntimeDirs = None,
    listen: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where Prometheus asks.")
    ] = "127.0.0.1:9477",
) -> None:  # fmt: skip
    """Serve the figures of this host's daemons to Prometheus until Ctrl-C."""
    with needs("metrics"):
        from prometheus_client import CollectorRegistry, start_http_server

        from sdrlinkd.exporter import Collector
    host, port = host_and_port(listen, "--listen", "127.0.0.1:9477")
    registry = CollectorRegistry()
    registry.register(Collector((lambda: runtime_dir) if runtime_dir else directories))
    try:
        server, _ = start_http_server(port, host, registry)
    except OSError as error:
        raise UserError(f"--listen {listen}: {error.strerror}") from None
    typer.echo(f"metrics at http://{host}:{server.server_port}/metrics")
    threading.Event().wait()
