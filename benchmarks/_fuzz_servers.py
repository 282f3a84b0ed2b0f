"""Both servers, asked without a network: the labelling page, its telemetry, files and jobs, and BOPTEST's API."""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from _fuzz_inputs import odd, spoil_bytes, spoil_tree

from thermal import errors
from thermal.errors import Described

#: Heads that decide whether a request is let through, and what may stand in them.
_HEADS = ("origin", "host", "sec-fetch-site", "sec-fetch-mode", "content-type", "content-length")
_SAID = ("http://evil.com@127.0.0.1", "null", "cross-site", "http://[::1", "127.0.0.1:99999", "text/plain", "-1", "é")

#: A request: method, path, and what its body is made of. "{}" in a path stands for something odd.
Asked = tuple[str, str, Any]


class RefusedError(Described, Exception):
    """A server's answer with a status of 400 to 499, or that it is full."""


def _client(app: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # newer versions of starlette prefer another client to httpx
        from starlette.testclient import TestClient
    return TestClient(app, base_url="http://127.0.0.1:1")


def _text(content: Any) -> bytes:
    return json.dumps(content).encode("utf-8", "replace")


def _filled(path: str, rng: np.random.Generator) -> str:
    """Put something odd into each place of a path."""
    while "{}" in path:
        word = "".join(f"%{byte:02x}" for byte in str(odd(rng)).encode("utf-8", "replace"))
        path = path.replace("{}", word, 1)
    return path


def _heads(rng: np.random.Generator) -> dict[str, str]:
    """Heads of a request, of which one is spoilt at times."""
    heads = {"content-type": "application/json"}
    if rng.random() < 0.1:
        heads[str(rng.choice(_HEADS))] = str(rng.choice(_SAID))
    return heads


def _ask(client: Any, method: str, path: str, content: bytes, rng: np.random.Generator) -> Any:
    """Ask; a refusal is raised as a named error, a failure as it is."""
    raw = {key: value.encode("utf-8") for key, value in _heads(rng).items()}
    answer = client.request(method, path, content=content, headers=raw)
    if answer.status_code >= 500 and answer.status_code != 503:
        raise RuntimeError(f"{method} {path[:80]}: status {answer.status_code}: {answer.text[:300]}")
    if answer.status_code >= 400:
        raise RefusedError(answer.text[:200])
    return answer


class Page:
    """The labelling page of a case.

    Parameters
    ----------
    folder : Path
        Case that is on the page.
    codes : bytes
        Drawing of codes that floors are made of.
    """

    def __init__(self, folder: Path, codes: bytes) -> None:
        from thermal.case.load import load_building
        from thermal.plan.page import serve
        from thermal.plan.page.desk import LabelDesk
        from thermal.plan.page.draft import draft_of

        self.desk = LabelDesk(folder, makers={"check": lambda case, out, progress, units: progress("checking", 0, 1)})
        self.client = _client(serve.create_app(self.desk, "t"))
        draft = json.loads(draft_of(load_building(folder)).model_dump_json(by_alias=True))
        (self.desk.store.own / "drawings" / "codes.csv").write_bytes(codes)
        entry = {"name": "F2", "file": "codes.csv", "height": 3.0, "cell_size": 1.0}
        self.asked: list[Asked] = [
            ("PUT", "/t/api/draft?window=w", draft), ("POST", "/t/api/session", {"window": "w", "previous": "v"}),
            ("POST", "/t/api/floors?window=w", {"floors": [entry], "cell_size": 1.0}),
            ("DELETE", "/t/api/drawings/{}?window=w", None), ("GET", "/t/api/drawings/{}", None),
            ("GET", "/t/api/drawings/codes.csv?page={}&dots_per_inch={}", None), ("GET", "/t/api/pictures/{}", None),
            ("GET", "/t/reports/{}/{}", None), ("GET", "/t/static/{}", None), ("GET", "/t/api/drawings", None),
            ("GET", "/t/api/state", None), ("GET", "/{}/api/state", None), ("GET", "/t/api/reports", None),
            ("POST", "/t/api/session/beat?window={}", None), ("POST", "/t/api/drawings?window=w&name={}", codes),
            ("POST", "/t/api/drawings?window=w&name=more.csv", codes),
            ("POST", "/t/api/devices?window=w&name=devices.csv", b"name,type,zone\nVAV,vav,A\nRAD,radiator,B\n"),
        ]  # fmt: skip

    def ask(self, rng: np.random.Generator) -> None:
        """Ask something spoilt."""
        self.desk.sessions.open("w", previous="w", take_over=True)
        number = 0 if rng.random() < 0.2 else int(rng.integers(len(self.asked)))  # a draft is the largest of all
        method, path, body = self.asked[number]
        if path.startswith("/t/api/draft?"):
            body = body | {"revision": self.desk.store.draft.revision}
        answer = _ask(self.client, method, _filled(path, rng), _spoilt(body, rng), rng)
        if "/api/floors" in path:
            finish(self.client, answer.json()["number"])

    def close(self) -> None:
        """End what was begun."""
        self.desk.end()


def _spoilt(body: Any, rng: np.random.Generator) -> bytes:
    """Body of a request, spoilt: none, a file, or JSON."""
    if isinstance(body, bytes):
        return spoil_bytes(body, rng)
    content = b"" if body is None else _text(spoil_tree(body, rng))
    return spoil_bytes(content, rng) if rng.random() < 0.2 else content


def finish(client: Any, number: int, also: tuple[str, ...] = ()) -> None:
    """Wait for a job; its failure is a refusal where it is one of the library's.

    Parameters
    ----------
    client : TestClient
        Of the page.
    number : int
        Of the job.
    also : tuple of str
        Names of further errors that are a refusal.
    """
    while (job := client.get(f"/t/api/jobs/{number}").json())["state"] in ("waiting", "runs"):
        time.sleep(0.002)
    if job["state"] == "failed":
        named = hasattr(errors, job["error"]["error"]) or job["error"]["error"] in also
        kind = RefusedError if named else RuntimeError
        raise kind(f"{job['error']['error']}: {job['error']['message'][:200]}")


class TelemetryPage:
    """Telemetry, places and jobs of the labelling page, whose drawing stays as it is.

    Parameters
    ----------
    folder : Path
        Case that is on the page.
    table : callable
        Makes a table as bytes, by its ending, spoilt by a generator of random numbers.
    """

    def __init__(self, folder: Path, table: Callable[[str, np.random.Generator], bytes]) -> None:
        from thermal.plan.page import serve
        from thermal.plan.page.desk import LabelDesk

        self.desk, self._table = LabelDesk(folder, makers={"check": _report}), table
        self.client = _client(serve.create_app(self.desk, "t"))
        sensor = "zone_air_temperature_sensor"
        points = [{"column": f"VAV/{sensor}", "entity": "VAV", "point": sensor}]
        source = {"file": "export.csv", "timezone": "Europe/Berlin", "step": 600.0}
        self.asked: list[Asked] = [
            ("POST", "/t/api/telemetry/look?window=w", source), ("POST", "/t/api/telemetry/look?window=w", source),
            ("POST", "/t/api/telemetry/look?window=w", {"address": "postgresql://x@127.0.0.1:1/a", "table": "t"}),
            ("PUT", "/t/api/telemetry/points?window=w", {"points": points}),
            ("POST", "/t/api/telemetry/take?window=w", None), ("POST", "/t/api/telemetry/check", None),
            ("GET", "/t/api/telemetry/plot?column=VAV%2fzone_air_temperature_sensor&of={}", None),
            ("GET", "/t/api/telemetry/plot?column={}&of=table", None), ("GET", "/t/api/telemetry", None),
            ("GET", "/t/api/places?name={}", None), ("GET", "/t/api/jobs/{}", None),
            ("POST", "/t/api/jobs/{}/stop", None), ("POST", "/t/api/reports/{}", None),
            ("POST", "/t/api/reports/check?units=ip", None), ("POST", "/t/api/reports/check?units={}", None),
            ("POST", "/t/api/telemetry/files?window=w&name={}", b"a,b\n1,2\n"),
        ]  # fmt: skip

    def ask(self, rng: np.random.Generator) -> None:
        """Ask something spoilt, or give a spoilt table, read it and take it."""
        self.desk.sessions.open("w", previous="w", take_over=True)
        if rng.random() < 0.4:
            name = str(rng.choice(["export.csv", "export.parquet"]))
            given = f"/t/api/telemetry/files?window=w&name={name}"
            _ask(self.client, "POST", given, self._table(name, rng), rng)
            source = _text({"file": name, "timezone": "Europe/Berlin"})
            self._follow(_ask(self.client, "POST", "/t/api/telemetry/look?window=w", source, rng))
            self._follow(_ask(self.client, "POST", "/t/api/telemetry/take?window=w", b"", rng))
            return
        method, path, body = self.asked[int(rng.integers(len(self.asked)))]
        answer = _ask(self.client, method, _filled(path, rng), _spoilt(body, rng), rng)
        if "number" in (content := answer.json()) and "state" in content:
            self._follow(answer)

    def _follow(self, answer: Any) -> None:
        finish(self.client, answer.json()["number"])

    def close(self) -> None:
        """End what was begun."""
        self.desk.end()


def _report(case: Path, out: Path, progress: Callable[[str, int, int], None], units: str) -> None:
    """Make a report in no time."""
    progress("checking", 1, 0)
    out.mkdir(parents=True, exist_ok=True)
    (out / "report.html").write_text("<p class='verdict'>Fine.</p>", encoding="utf-8")


class Plant:
    """BOPTEST's API with a test of a small pilot."""

    def __init__(self) -> None:
        from mpc.adapters.boptest.app import Guard, HeldTests, create_app
        from mpc.adapters.boptest.make import pilot_to_serve

        case = pilot_to_serve(1, floor_area=300.0, zones=6, floors=1, dx=1.0, days=4.0, name="small")
        self.client = _client(Guard(create_app(HeldTests([case]))))
        listed = list(case.signals.input_metadata())[:4]
        inputs = {name: 1 if name.endswith("_activate") else 290.0 for name in listed}
        self.asked: list[Asked] = [
            ("PUT", "/initialize", {"start_time": 86400.0, "warmup_period": 0.0}), ("PUT", "/step", {"step": 300.0}),
            ("PUT", "/scenario", {"electricity_price": "constant", "time_period": "mix_day"}),
            ("PUT", "/forecast", {"point_names": ["TDryBul"], "horizon": 3600, "interval": 900}),
            ("PUT", "/results", {"point_names": list(inputs), "start_time": 0.0, "final_time": 90000.0}),
            ("POST", "/advance", inputs), ("POST", "/testcases/{}/select", {}), ("GET", "/name/{}", None),
            ("POST", "/testcases/{}/select-async", {}), ("GET", "/testcases", None), ("GET", "/version", None),
            ("GET", "/kpi", None), ("GET", "/inputs/{}", None), ("GET", "/measurements", None), ("GET", "/step", None),
            ("GET", "/forecast_points", None), ("GET", "/scenario/{}", None), ("GET", "/status/{}", None),
            ("PUT", "/stop/{}", None), ("POST", "/submit", {"api_key": "x", "tags": ["a"]}),
            ("POST", "/advance/{}", inputs), ("PUT", "/results/{}", {"point_names": []}),
        ]  # fmt: skip

    def ask(self, rng: np.random.Generator) -> None:
        """Ask something spoilt."""
        method, path, body = self.asked[int(rng.integers(len(self.asked)))]
        _ask(self.client, method, _filled(path, rng), _spoilt(body, rng), rng)
