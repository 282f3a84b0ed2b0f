"""The server over HTTP: who is let in, what is saved, what is refused by name."""

from __future__ import annotations

import io
import json
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from thermal.plan.page import drawings as uploads
from thermal.plan.page import routes
from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.draft import Draft

Make = Callable[..., Draft]


def content(draft: Draft) -> dict[str, Any]:
    """A draft as the page sends it."""
    return json.loads(draft.model_dump_json(by_alias=True))  # type: ignore[no-any-return]


def png(width: int, height: int, pixels: bytes = bytes(100)) -> bytes:
    """A PNG that says of itself what it likes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


def zipped(name: str, size: int) -> bytes:
    """A zip of zeros."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive, archive.open(name, "w") as entry:
        for _ in range(size // 1_000_000):
            entry.write(bytes(1_000_000))
    return stream.getvalue()


# Who is let in


def test_the_page_is_there_with_its_token_only(browser: Any) -> None:
    page = browser.get(browser.at(""))
    assert page.status_code == 200 and '<svg id="plan"' in page.text
    assert (
        "script-src 'self'" in page.headers["content-security-policy"]
        and "unsafe" not in page.headers["content-security-policy"]
    )
    assert page.headers["referrer-policy"] == "no-referrer"
    for path in ("/", "/api/state", "/T0KEN/", "/t0ken2/api/state", "//api/state", "/%74oken/"):
        assert browser.get(path).status_code == 404, path
    assert browser.get("/spam/").json()["error"] == "LabelError"


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.com@127.0.0.1", "evil.com@127.0.0.1:8000", "evil.example:8000", "127.0.0.1.evil.example", "192.168.1.2:8000", ""]
)
def test_another_host_is_refused(browser: Any, host: str) -> None:
    answer = browser.get(browser.at("api/state"), headers={"host": host})
    assert (answer.status_code, answer.json()["error"]) == (403, "LabelError")


@pytest.mark.parametrize(
    "headers", [
        {"origin": "http://evil.example"}, {"origin": "null"}, {"origin": "http://127.0.0.1:9999"},
        {"origin": "http://evil.com@127.0.0.1"}, {"origin": "http://evil.com@127.0.0.1:8000"}, {"sec-fetch-site": "cross-site"},
    ]
)  # fmt: skip
def test_another_page_is_refused(browser: Any, headers: dict[str, str]) -> None:
    answer = browser.post(browser.at("api/session"), json={"window": "evil"}, headers=headers)
    assert (answer.status_code, answer.json()["error"]) == (403, "LabelError")
    assert browser.get(browser.at("api/state"), headers={"origin": "http://127.0.0.1:8000"}).status_code == 200


def test_every_file_of_the_page_is_its_own(browser: Any) -> None:
    import re

    page = browser.get(browser.at("")).text
    named = re.findall(r'(?:src|href)="([^"#]+)"', page)
    assert named and all(name.startswith("static/") for name in named)
    for name in named:
        answer = browser.get(browser.at(name))
        assert answer.status_code == 200, name
        for further in re.findall(r'from "\./([^"]+)"', answer.text):
            assert browser.get(browser.at(f"static/{further}")).status_code == 200, further
        assert "https://" not in answer.text and "eval(" not in answer.text
    for name in ("static/..%2f_app.py", "static/%2e%2e/_app.py", "static/spam.js"):
        assert browser.get(browser.at(name)).status_code == 404


# What is saved


def test_a_draft_is_saved_and_its_case_written(browser: Any, desk: LabelDesk, draft_with: Make) -> None:
    assert browser.get(browser.at("api/state")).json()["draft"]["name"] == "case"
    glazed = draft_with(glazing={"A": {"west": 2.0}})
    answer = browser.put(browser.at("api/draft"), json=content(glazed)).json()
    assert (answer["revision"], answer["written"], answer["findings"]) == (1, True, [])
    assert answer["zones"]["A"]["area"] == pytest.approx(3.0)
    assert (desk.store.folder / "building.yaml").is_file()
    state = browser.get(browser.at("api/state")).json()
    assert state["draft"]["revision"] == 1 and state["draft"]["devices"][0]["zone"] == "A"


def test_a_change_of_an_older_draft_is_refused(browser: Any, draft_with: Make) -> None:
    browser.put(browser.at("api/draft"), json=content(draft_with()))
    answer = browser.put(browser.at("api/draft"), json=content(draft_with(name="other")))
    assert (answer.status_code, answer.json()["error"]) == (409, "SessionHeldError")
    assert browser.get(browser.at("api/state")).json()["draft"]["name"] == "two rooms"


def test_a_second_window_is_told_and_changes_nothing(browser: Any, draft_with: Make) -> None:
    browser.window = "w2"
    assert browser.open()["mine"] is False
    for answer in (
        browser.put(browser.at("api/draft"), json=content(draft_with())),
        browser.post(browser.at("api/session/beat")),
        browser.post(browser.at("api/drawings", name="a.png"), content=png(1, 1)),
        browser.post(browser.at("api/floors"), json={"floors": []}),
        browser.post(browser.at("api/devices", name="a.csv"), content=b"name\nV"),
        browser.delete(browser.at("api/drawings/a.png")),
    ):
        assert (answer.status_code, answer.json()["error"]) == (409, "SessionHeldError")
    assert browser.open(take_over=True) == {"mine": True}
    assert browser.put(browser.at("api/draft"), json=content(draft_with())).status_code == 200


@pytest.mark.parametrize(
    "body", [b"", b"{", b"\xff\xfe", b"[" * 90_000, b"[]", b"null", b'{"name": 1}', b'{"name": "x", "revision": 1e400}', b"1" * 6000]
)  # fmt: skip
def test_a_malformed_body_is_refused_by_name(browser: Any, body: bytes) -> None:
    for method, path in (("PUT", "api/draft"), ("POST", "api/session"), ("POST", "api/floors")):
        answer = browser.request(method, browser.at(path), content=body, headers={"content-type": "application/json"})
        assert (answer.status_code, answer.json()["error"]) == (400, "LabelError"), (path, answer.text)


def test_a_body_of_another_kind_or_size_is_refused(browser: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = browser.put(browser.at("api/draft"), content=b"{}", headers={"content-type": "text/plain"})
    assert (answer.status_code, answer.json()["error"]) == (400, "LabelError")
    monkeypatch.setattr(routes, "_MOST_BODY", 1000)
    answer = browser.put(browser.at("api/draft"), json={"name": "x" * 2000})
    assert (answer.status_code, answer.json()["error"]) == (413, "OversizedFileError")
    assert browser.put("/t0ken/api/draft", json={}).json()["error"] == "LabelError"  # no window


# Hostile files


@cache
def hostile() -> dict[str, tuple[str, bytes, str]]:
    """Name, content and refusal of files that are no plans."""
    svg = b'<svg xmlns="http://www.w3.org/2000/svg"><script>fetch("/")</script></svg>'
    objects = io.BytesIO()
    np.save(objects, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    return {
        "pixel bomb": ("a.png", png(90_000, 90_000), "OversizedFileError"),
        "pixel bomb below Pillow's limit": ("a.png", png(9_000, 9_000), "OversizedFileError"),
        "cut off": ("a.png", png(500, 500)[:60], "PlanError"),
        "text": ("a.png", b"hello", "PlanError"),
        "empty": ("a.png", b"", "PlanError"),
        "svg with a script": ("a.svg", svg, "PlanError"),
        "svg that says it is a png": ("a.png", svg, "PlanError"),
        "page of html": ("a.html", b"<script>1</script>", "PlanError"),
        "zip": ("a.zip", zipped("a", 1_000_000), "PlanError"),
        "docx": ("a.docx", zipped("word/document.xml", 1_000_000), "PlanError"),
        "docx that says it is a pdf": ("a.pdf", zipped("word/document.xml", 1_000_000), "PlanError"),
        "zip bomb": ("a.npz", zipped("arr_0.npy", 150_000_000), "OversizedFileError"),
        "pickle": ("a.npy", pickle.dumps({"a": 1}), "PlanError"),
        "array of objects": ("a.npy", objects.getvalue(), "PlanError"),
        "codes of something else": ("a.csv", b"0,1\n1,7\n", "PlanError"),
        "path up": ("../a.png", png(9, 9), "PlanError"),
        "path up as Windows has it": ("..\\a.png", png(9, 9), "PlanError"),
        "whole path": ("/etc/a.png", png(9, 9), "PlanError"),
        "hidden": (".a.png", png(9, 9), "PlanError"),
        "NUL": ("a%00.png", png(9, 9), "PlanError"),
        "line feed": ("a%0A.png", png(9, 9), "PlanError"),
        "long name": ("a" * 300 + ".png", png(9, 9), "PlanError"),
    }


@pytest.mark.parametrize("case", hostile())
def test_a_hostile_drawing_is_refused_by_name(browser: Any, desk: LabelDesk, tmp_path: Path, case: str) -> None:
    name, body, refusal = hostile()[case]
    before = {p for p in tmp_path.rglob("*")}
    answer = browser.post(browser.at("api/drawings", name=name), content=body)
    assert answer.json()["error"] == refusal, answer.text
    assert answer.status_code == (413 if refusal == "OversizedFileError" else 400)
    assert str(tmp_path) not in answer.text  # nothing of this machine
    assert {p for p in tmp_path.rglob("*")} == before


def test_an_oversized_upload_is_stopped_on_its_way(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "MOST_BYTES", 1000)
    for path, name in (("api/drawings", "a.png"), ("api/devices", "a.csv")):
        answer = browser.post(browser.at(path, name=name), content=bytes(5000))
        assert (answer.status_code, answer.json()["error"]) == (413, "OversizedFileError")
    assert not list((tmp_path / "case" / "labelling" / "drawings").iterdir())


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("a.csv", b""),
        ("a.csv", b"\xff\xfe"),
        ("a.csv", b"name\nV\nV"),
        ("a.json", b"[" * 100_000),
        ("a.ttl", b"spam"),
        ("a.zinc", b"{"),
    ],
)
def test_a_list_that_is_none_is_refused_by_name(browser: Any, name: str, body: bytes) -> None:
    answer = browser.post(browser.at("api/devices", name=name), content=body)
    assert answer.status_code == 400 and answer.json()["error"] in ("PlanError", "PlanError")


@pytest.mark.parametrize("name", [".", "%2e", "%2E%2e", "", "spam.png", "%00", "a" * 5000])
def test_what_is_no_drawing_is_not_dropped(browser: Any, desk: LabelDesk, name: str) -> None:
    kept = desk.store.own / "drawings" / "kept.png"
    Image.new("L", (30, 30), 255).save(kept)
    answer = browser.delete(browser.at(f"api/drawings/{name}"))
    assert 400 <= answer.status_code < 500 and kept.is_file()
    if answer.status_code == 400:
        assert answer.json()["error"] == "PlanError" and "drawing: expected" in answer.json()["message"]
    assert browser.delete(browser.at("api/drawings/kept.png")).status_code == 200 and not kept.exists()


@pytest.mark.parametrize("name", ["..%2f..%2fbuilding.yaml", "%2e%2e", "spam.png", "..%5ca.png"])
def test_files_elsewhere_are_not_shown(browser: Any, name: str) -> None:
    for path in (f"api/drawings/{name}", f"api/pictures/{name}", f"reports/{name}"):
        answer = browser.get(browser.at(path))
        assert answer.status_code in (400, 404), path


def test_a_drawing_that_leads_elsewhere_is_not_read(browser: Any, desk: LabelDesk, tmp_path: Path) -> None:
    Image.new("L", (30, 30), 255).save(tmp_path / "secret.png")
    (desk.store.own / "drawings" / "a.png").symlink_to(tmp_path / "secret.png")
    assert browser.get(browser.at("api/drawings/a.png")).json()["error"] == "PlanError"
    answer = browser.post(
        browser.at("api/floors"),
        json={"floors": [{"name": "F1", "file": "../../../secret.png", "scale": {"metres_per_pixel": 0.1}}]},
    )
    job = wait(browser, answer.json())
    assert job["state"] == "failed" and job["error"]["error"] == "PlanError"


# Drawings and devices become a case


def wait(browser: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Wait for a job."""
    import time

    for _ in range(600):
        job = browser.get(browser.at(f"api/jobs/{job['number']}")).json()
        if job["state"] not in ("waiting", "runs"):
            return job
        time.sleep(0.05)
    raise AssertionError(job)


def drawing(split: int = 248) -> bytes:
    """Two rooms of 8 m x 6 m together, at 4 cm a pixel."""
    pixels = np.full((200, 250), 255, dtype=np.uint8)
    pixels[20:180, 20:230] = 0
    pixels[25:175, 25:225] = 255
    pixels[25:175, split // 2 - 1 : split // 2 + 2] = 0
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="PNG")
    return stream.getvalue()


def test_drawings_and_a_list_become_a_case(browser: Any, desk: LabelDesk) -> None:
    sheet = browser.post(browser.at("api/drawings", name="first floor.png"), content=drawing()).json()
    assert (sheet["kind"], sheet["width"], sheet["height"]) == ("raster", 250, 200)
    picture = browser.get(browser.at("api/drawings/first floor.png"))
    assert picture.headers["content-type"] == "image/png" and picture.headers["x-width"] == "250"
    codes = "\n".join(",".join("1" if r in (0, 15) or c in (0, 20) else "0" for c in range(21)) for r in range(16))
    assert browser.post(browser.at("api/drawings", name="roof.csv"), content=codes.encode()).json()["kind"] == "codes"
    assert {d["file"] for d in browser.get(browser.at("api/drawings")).json()["drawings"]} == {
        "first floor.png",
        "roof.csv",
    }

    scale = {"points": [[25, 100], [225, 100]], "distance": 8.0}
    job = wait(
        browser,
        browser.post(
            browser.at("api/floors"),
            json={"floors": [{"name": "F1", "file": "first floor.png", "scale": scale}], "cell_size": 0.2},
        ).json(),
    )
    assert job["state"] == "done", job
    draft = desk.store.draft.model_dump() | {"floors": job["result"]["floors"], "cell_size": job["result"]["cell_size"]}
    draft |= {"site": {"latitude": 1.0, "longitude": 2.0, "elevation": 3.0, "timezone": "UTC"}}
    assert browser.put(browser.at("api/draft"), json=draft).json()["written"]
    picture = draft["floors"][0]["picture"]
    assert browser.get(browser.at(f"api/pictures/{picture['file']}")).status_code == 200
    a, b, c, d, e, f = picture["matrix"]  # the inner corner of the drawing lies at the inner corner of the plan
    rows = desk.store.draft.floors[0].tokens
    zone = np.argwhere(rows == "F1_R01").min(axis=0)
    assert (a * 25 + c * 25 + e, b * 25 + d * 25 + f) == pytest.approx((zone[1], zone[0]), abs=0.5)

    job = wait(
        browser,
        browser.post(
            browser.at("api/floors"), json={"floors": [{"name": "roof", "file": "roof.csv", "cell_size": 0.4}]}
        ).json(),
    )
    assert job["state"] == "done", job
    assert [floor["name"] for floor in job["result"]["floors"]] == ["F1", "roof"]
    assert len({(floor["rows"], floor["columns"]) for floor in job["result"]["floors"]}) == 1
    shift, first = job["result"]["shift"], job["result"]["floors"][0]["picture"]["matrix"]
    assert first[4:] == pytest.approx([e + shift[0], f + shift[1]])

    found = browser.post(
        browser.at("api/devices", name="list.csv"),
        content=b"Name,Type,Room\nV1,VAV w/ reheat,f1-r1\nV2,vav,lobby\nB,boiler,\n",
    ).json()
    assert [(d["name"], d["type"], d["zone"], d["room"]) for d in found["devices"]] == [
        ("V1", "vav", "F1_R01", ""), ("V2", "vav", None, "lobby"), ("B", "boiler", None, ""),
    ]  # fmt: skip
    assert not [p for p in (desk.store.own / "drawings").iterdir() if p.name[0] == "."]


@pytest.mark.parametrize(
    ("floors", "refusal"),
    [
        ([{"name": "F1", "file": "a.png"}], "PlanError"),
        ([{"name": "F1", "file": "spam.png", "scale": {"metres_per_pixel": 0.04}}], "PlanError"),
        ([{"name": "F1", "file": "a.png", "scale": {"metres_per_pixel": 40.0}}], "PlanError"),
        ([{"name": n, "file": "a.png", "scale": {"metres_per_pixel": 0.04}} for n in ("F1", "F1")], "PlanError"),
    ],
)
def test_a_floor_that_cannot_be_made_says_why(browser: Any, floors: list[dict[str, Any]], refusal: str) -> None:
    browser.post(browser.at("api/drawings", name="a.png"), content=drawing())
    job = wait(browser, browser.post(browser.at("api/floors"), json={"floors": floors}).json())
    assert job["state"] == "failed" and job["error"]["error"] == refusal
    answer = browser.post(browser.at("api/floors"), json={"floors": [{"name": "F1", "spam": 1}]})
    assert answer.json()["error"] == "LabelError"
