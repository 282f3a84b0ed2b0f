"""The page's process."""

from __future__ import annotations

from typing import Any

from mpc.live.page.access import page_tokens
from mpc.live.page.app import make_app
from mpc.live.site import Site
from mpc.live.state import write_state
from thermal.plan.guard import extra

#: Connections at a time; more are told to come back. One that has not asked for anything by then is closed [s].
_MOST, _PATIENCE = 100, 5.0


def run_page(site: Site) -> int:
    """Serve a site's page until the process is ended; return the exit code.

    Parameters
    ----------
    site : Site
        As read.
    """
    uvicorn, entry = extra("uvicorn", "live", "the page"), site.file.page
    tokens = page_tokens(site.folder)
    address = f"http://{entry.host}:{entry.port}/#"
    write_state(site.folder / "page.json", {role: address + token for role, token in tokens.items()})
    (site.folder / "page.json").chmod(0o600)
    uvicorn.run(
        make_app(site), host=entry.host, port=entry.port, log_level="warning", limit_concurrency=_MOST,
        timeout_graceful_shutdown=1, http=protocol(),
    )  # fmt: skip
    return 0


def protocol() -> Any:
    """Give the server's protocol, which closes connections that ask for nothing: they would keep others out."""
    base: Any = extra("uvicorn.protocols.http.h11_impl", "live", "the page").H11Protocol

    class Patient(base):  # type: ignore[misc]
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.loop.call_later(_PATIENCE, lambda: self.cycle is None and transport.close())

    return Patient
