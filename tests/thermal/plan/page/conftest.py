"""A small building on the page, and its server as a browser sees it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fastapi", reason="needs the extra [pages]")
pytest.importorskip("httpx", reason="needs httpx, which the test extra has")

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # newer versions of starlette prefer another client to httpx
    from starlette.testclient import TestClient

from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.draft import Draft, DraftDevice, Site, encode_floor
from thermal.plan.page.serve import create_app

TOKEN = "t0ken"
HOST = "http://127.0.0.1:8000"
ROWS = (".......", ".#####.", ".#A+B#.", ".#A+B#.", ".#####.", ".......")


def tokens_of(*rows: str) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Tokens of a plan, one letter a cell."""
    return np.array([list(row) for row in rows], dtype=np.str_)


def make_draft(*rows: str, **changes: Any) -> Draft:
    """A finished draft of one floor with rooms A and B."""
    floor = encode_floor("F1", 3.0, tokens_of(*(rows or ROWS)))
    site = Site(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
    devices = (DraftDevice(name="VAV_A", type="vav", zone="A"), DraftDevice(name="VAV_B", type="vav", zone="B"))
    draft = Draft(name="two rooms", site=site, cell_size=1.0, floors=(floor,), devices=devices)
    return draft.model_copy(update=changes)


@pytest.fixture
def spell() -> Callable[..., Any]:
    """Give tests the tokens of a plan."""
    return tokens_of


@pytest.fixture
def draft_with() -> Callable[..., Draft]:
    """Give tests a draft, changed as they like."""
    return make_draft


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[LabelDesk]:
    """A desk of a new case."""
    made = LabelDesk(tmp_path / "case")
    yield made
    made.end()


class Browser(TestClient):
    """A browser on this machine that knows the token."""

    window = "w1"

    def at(self, path: str, **query: Any) -> str:
        """Address of a path behind the token."""
        text = "&".join(f"{key}={value}" for key, value in {"window": self.window, **query}.items())
        return f"/{TOKEN}/{path}?{text}"

    def open(self, **words: Any) -> dict[str, Any]:
        """Ask for the case."""
        return self.post(self.at("api/session"), json={"window": self.window, **words}).json()  # type: ignore[no-any-return]


@pytest.fixture
def browser(desk: LabelDesk) -> Iterator[Browser]:
    """A browser that has the case."""
    client = Browser(create_app(desk, TOKEN), base_url=HOST, raise_server_exceptions=False)
    assert client.open() == {"mine": True}
    yield client
    client.close()
