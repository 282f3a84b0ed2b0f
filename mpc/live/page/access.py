"""Who may see the page, and who may ask for something: by token, and by the name that the page was asked for by."""

from __future__ import annotations

import hmac
import json
import os
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from mpc.errors import LiveError

Role = Literal["viewer", "operator"]

#: Names of this machine for itself.
LOOPBACK = ("127.0.0.1", "localhost", "::1", "[::1]")


def page_tokens(folder: Path) -> dict[str, str]:
    """Read the tokens of both roles; made where there are none, for this user alone.

    Parameters
    ----------
    folder : Path
        Of the site's logs.
    """
    path = folder / "page_tokens.json"
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        found = json.loads(path.read_text(encoding="utf-8"))
        fits = isinstance(found, dict) and all(len(str(found.get(r, ""))) >= 20 for r in ("viewer", "operator"))
        LiveError.unless(fits, path.name, "tokens of viewer and operator, 20 letters or more", "others", "delete it")
        return {role: str(found[role]) for role in ("viewer", "operator")}
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump({role: secrets.token_urlsafe(24) for role in ("viewer", "operator")}, file)
    return page_tokens(folder)


class Access:
    """Decides on requests.

    Parameters
    ----------
    host : str
        Where the page listens.
    tokens : mapping of str to str
        By role.
    """

    def __init__(self, host: str, tokens: Mapping[str, str]) -> None:
        self.local = host in LOOPBACK
        self.host, self._tokens = host, dict(tokens)

    def refusal(self, host: str, authorization: str, role: Role) -> tuple[int, str]:
        """Say with which status and words a request is refused; 0 where it is not.

        On this machine alone the page is shown without a token, but to no page of another name that a browser was
        led to (DNS rebinding); what operators ask for needs theirs everywhere.

        Parameters
        ----------
        host : str
            Header ``Host``.
        authorization : str
            Header ``Authorization``.
        role : {"viewer", "operator"}
            Least that is needed.
        """
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        if self.local and name not in LOOPBACK:
            return 403, "this page is for its own machine"
        if self.local and role == "viewer":
            return 0, ""
        kind, _, token = authorization.partition(" ")
        roles = {r for r, t in self._tokens.items() if hmac.compare_digest(t.encode(), token.encode())}
        if kind != "Bearer" or not roles:
            return 401, f"a token is needed: {role}"
        return (0, "") if role in roles or "operator" in roles else (403, f"a token is needed: {role}")
