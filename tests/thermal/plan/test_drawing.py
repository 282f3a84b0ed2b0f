"""Hostile and damaged files are refused by name, before they cost anything."""

from __future__ import annotations

import shutil
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from thermal.errors import MissingExtraError, OversizedFileError, PlanError
from thermal.plan.drawing import read_drawing
from thermal.plan.survey import read_codes


def png_of(path: Path, width: int, height: int) -> Path:
    """Write a PNG that claims a size and holds hardly anything."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)
    return path


def test_a_decompression_bomb_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OversizedFileError, match=r"bomb\.png.*10000000000 pixels"):
        read_drawing(png_of(tmp_path / "bomb.png", 100_000, 100_000))
    with pytest.raises(OversizedFileError, match="fewer dots per inch"):
        read_drawing(png_of(tmp_path / "large.png", 9000, 9000))


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "huge.png").open("wb") as stream:
        stream.truncate(200_000_000)
    with pytest.raises(OversizedFileError, match="200 MB"):
        read_drawing(tmp_path / "huge.png")


NEEDS_POPPLER = pytest.mark.skipif(shutil.which("pdfinfo") is None, reason="needs pdfinfo (Debian's poppler-utils)")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("script.png", b"#!/bin/sh\n", "PNG file"),
        ("empty.png", b"", "an empty file"),
        ("other.jpg", b"\x89PNG\r\n\x1a\n", "JPG file"),
        ("plan.zip", b"PK\x03\x04", "unpack it first"),
        ("plan.svg", b"<svg/>", "ends in"),
        ("broken.png", b"\x89PNG\r\n\x1a\n" + b"x" * 50, "whole PNG image"),
        pytest.param("broken.pdf", b"%PDF-1.7\n" + b"x" * 50, "PDF", marks=NEEDS_POPPLER),
        ("text.pdf", b"hello", "PDF file"),
    ],
)
def test_what_is_no_drawing_is_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(PlanError, match=message):
        read_drawing(tmp_path / name)


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="found nothing"):
        read_drawing(tmp_path / "none.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(PlanError, match="found a folder"):
        read_drawing(tmp_path / "folder.png")


def test_a_truncated_image_is_refused(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (200, 200), dtype=np.uint8)
    for name in ("half.png", "half.jpg"):
        Image.fromarray(pixels).save(tmp_path / name)
        whole = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(whole[: len(whole) // 2])
        with pytest.raises(PlanError, match="whole"):
            read_drawing(tmp_path / name)


def test_pages_and_crops_are_checked(office_pdf: Path, tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="page"):
        read_drawing(office_pdf, page=7)
    with pytest.raises(PlanError, match="page"):
        read_drawing(office_pdf, page=0)
    with pytest.raises(PlanError, match="dots_per_inch"):
        read_drawing(office_pdf, dots_per_inch=5000.0)
    Image.new("L", (40, 30), 255).save(tmp_path / "a.png")
    with pytest.raises(PlanError, match="40 x 30"):
        read_drawing(tmp_path / "a.png", crop=(0, 0, 50, 10))
    assert read_drawing(tmp_path / "a.png", crop=(5, 10, 40, 30)).grey.shape == (20, 35)


def test_transparent_is_white_and_16_bits_are_scaled(tmp_path: Path) -> None:
    Image.new("RGBA", (4, 4), (0, 0, 0, 0)).save(tmp_path / "clear.png")
    assert (read_drawing(tmp_path / "clear.png").grey == 255).all()
    Image.fromarray(np.full((4, 4), 40_000, dtype=np.uint16)).save(tmp_path / "deep.png")
    assert read_drawing(tmp_path / "deep.png").grey[0, 0] == pytest.approx(156, abs=1)


def test_an_array_that_unpacks_to_more_than_a_plan_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("plan.npy", "w") as stream:
            for _ in range(120):
                stream.write(bytes(1_000_000))
    assert (tmp_path / "bomb.npz").stat().st_size < 1_000_000
    with pytest.raises(OversizedFileError, match="120 MB"):
        read_codes(tmp_path / "bomb.npz", 0.5)


def test_an_array_of_objects_runs_nothing(tmp_path: Path) -> None:
    np.save(tmp_path / "object.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(PlanError, match="Python objects"):
        read_codes(tmp_path / "object.npy", 0.5)


def test_a_missing_package_says_which_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    Image.new("L", (4, 4)).save(tmp_path / "a.png")
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(MissingExtraError, match=r"buildingmpc\[plan\]"):
        read_drawing(tmp_path / "a.png")


def test_a_missing_program_is_named(office_pdf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingExtraError, match="poppler-utils"):
        read_drawing(office_pdf)
