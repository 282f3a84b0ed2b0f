"""Serving the labelling page on this machine, until Ctrl-C."""

from __future__ import annotations

import secrets
import socket
import threading
import time
from collections.abc import Callable

from thermal.errors import LabelError, MissingExtraError, describe
from thermal.plan.page.app import LabelDesk, create_app

HOST = "127.0.0.1"


def serve_page(desk: LabelDesk, *, port: int = 0, ready: Callable[[str], None] | None = None) -> None:
    """Serve the labelling page of a case until Ctrl-C.

    Parameters
    ----------
    desk : LabelDesk
        What it works on; ended when the server ends.
    port : int
        On this machine's own address, 127.0.0.1; 0 takes any that is free.
    ready : callable, optional
        Told the address, with its token, as soon as the page can be opened.

    Raises
    ------
    LabelError
        The port is taken.
    MissingExtraError
        The extra ``[pages]`` is not installed.
    """
    try:
        import uvicorn
    except ImportError as error:
        advice = 'run: pip install "buildingmpc[pages]"'
        raise MissingExtraError(describe("labelling page", "uvicorn", str(error), advice)) from error
    token = secrets.token_urlsafe(24)
    try:
        app = create_app(desk, token)
        listener = _listen(port)
        address = f"http://{HOST}:{listener.getsockname()[1]}/{token}/"
        config = uvicorn.Config(
            app, log_level="critical", access_log=False, lifespan="off", timeout_graceful_shutdown=2
        )
        server = uvicorn.Server(config)
        if ready is not None:
            threading.Thread(target=_when_ready, args=(server, ready, address), daemon=True).start()
        server.run(sockets=[listener])
    except KeyboardInterrupt:  # raised again by the server after it has ended in order
        pass
    finally:
        desk.end()


def _listen(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except (OSError, OverflowError) as error:
        listener.close()
        raise LabelError(
            describe("port", "a free one on this machine", f"{port}: {error}", "choose another")
        ) from error
    return listener


def _when_ready(server: object, ready: Callable[[str], None], address: str) -> None:
    for _ in range(600):
        if getattr(server, "started", False):
            ready(address)
            return
        time.sleep(0.05)
