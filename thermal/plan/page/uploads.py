"""Drawings that a page sends: taken in when they are what their name says, refused by name, and shown."""

from __future__ import annotations

import io
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from thermal.errors import OversizedFileError, PlanError, describe
from thermal.plan.codes import CODE_KINDS, read_codes
from thermal.plan.drawing import RASTER_KINDS, read_drawing
from thermal.plan.extra import extra
from thermal.plan.guard import MOST_BYTES, checked_file, inside_folder
from thermal.plan.vector import VECTOR_KINDS

DRAWING_KINDS = (*RASTER_KINDS, *VECTOR_KINDS, *CODE_KINDS)
DEVICE_KINDS = (".csv", ".ttl", ".json", ".zinc")

_WIDEST_PICTURE = 3000  # px of what lies under the plan
_TRIAL_CELL = 0.5  # m: codes are read once at any size to see that they are codes


@dataclass(frozen=True)
class _Sheet:
    """A drawing that was taken in.

    Parameters
    ----------
    file : str
        Its name in the folder of drawings.
    kind : str
        ``raster``, ``vector`` or ``codes``.
    width, height : float
        Of a raster drawing [px]; else 0.
    dots_per_inch : float or None
        Of a page of a PDF [1/inch].
    """

    file: str
    kind: str
    width: float = 0.0
    height: float = 0.0
    dots_per_inch: float | None = None


def checked_name(name: str, kinds: tuple[str, ...]) -> str:
    """Refuse the name of an upload that is more than a name, or of another kind.

    Parameters
    ----------
    name : str
        As the browser sent it.
    kinds : tuple of str
        Suffixes that will do.

    Returns
    -------
    str
        The same.

    Raises
    ------
    PlanError
        It leads elsewhere.
    PlanError
        It has another suffix, or is none.
    """
    if any(sign in name for sign in "/\\\0") or name.startswith(".") or not name.isprintable() or len(name) > 150:
        raise PlanError(describe("upload", "the plain name of a file", repr(name[:200]), "rename the file"))
    suffix = Path(name).suffix.lower()
    if suffix not in kinds:
        advice = "unpack it first" if suffix == ".zip" else "export it as one of these"
        raise PlanError(describe(name, f"a file that ends in {', '.join(kinds)}", repr(suffix or name), advice))
    return name


class Upload:
    """A file on its way in, to be kept only when it is what its name says.

    Parameters
    ----------
    folder : Path
        Folder of the page's own, in which it is looked at.
    name : str
        As the browser sent it.
    kinds : tuple of str
        Suffixes that will do.

    Raises
    ------
    PlanError
        The name leads elsewhere.
    PlanError
        It has another suffix, or is none.
    """

    def __init__(self, folder: Path, name: str, kinds: tuple[str, ...]) -> None:
        self._target = inside_folder(folder, checked_name(name, kinds), "upload")
        self._place = tempfile.TemporaryDirectory(prefix=".upload-", dir=folder)
        self.path = Path(self._place.name) / name
        self._size = 0
        self._stream = self.path.open("wb")

    def __enter__(self) -> Self:
        return self

    def write(self, chunk: bytes) -> None:
        """Take a part of it, and stop when it is more than any real plan.

        Parameters
        ----------
        chunk : bytes
            What came.

        Raises
        ------
        OversizedFileError
            It is more than `MOST_BYTES` by now.
        """
        self._size += len(chunk)
        if self._size > MOST_BYTES:
            expected = f"at most {MOST_BYTES / 1e6:.0f} MB"
            raise OversizedFileError(describe(self.path.name, expected, "more", "export it anew, or crop it"))
        self._stream.write(chunk)

    def close(self) -> Path:
        """Finish writing.

        Returns
        -------
        Path
            The file, until the end of the block.
        """
        self._stream.close()
        return self.path

    def keep_drawing(self) -> _Sheet:
        """Look at it, and keep it; it replaces one of the same name.

        Returns
        -------
        _Sheet
            The drawing.

        Raises
        ------
        PlanError
            One of its family, by what is wrong; nothing is kept then.
        """
        sheet = look_at(self.close())
        self.path.replace(self._target)
        return sheet

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()
        self._place.cleanup()


def look_at(path: Path, page: int = 1, dots_per_inch: float = 150.0) -> _Sheet:
    """Look at a drawing: all of an image, the first bytes of others.

    Parameters
    ----------
    path : Path
        Drawing.
    page : int
        Of a PDF, from 1 [-].
    dots_per_inch : float
        Of a PDF's page [1/inch].

    Returns
    -------
    _Sheet
        What it is.

    Raises
    ------
    PlanError
        One of its family, by what is wrong.
    """
    file = checked_file(path, DRAWING_KINDS)
    kind = file.suffix.lower()
    if kind in RASTER_KINDS:
        drawing = read_drawing(file, page=page, dots_per_inch=dots_per_inch)
        return _Sheet(file.name, "raster", drawing.grey.shape[1], drawing.grey.shape[0], drawing.dots_per_inch)
    if kind in CODE_KINDS:
        read_codes(file, _TRIAL_CELL)
        return _Sheet(file.name, "codes")
    return _Sheet(file.name, "vector")


def picture_of(grey: NDArray[np.uint8]) -> bytes:
    """Make a PNG of a drawing, at a size that browsers show at once.

    Parameters
    ----------
    grey : ndarray of uint8, shape (n_row, n_col)
        0 black, 255 white.

    Returns
    -------
    bytes
        PNG.
    """
    step = max(1, -(-max(grey.shape) // _WIDEST_PICTURE))
    image = extra("PIL.Image").fromarray(np.ascontiguousarray(grey))
    if step > 1:
        image = image.reduce(step)
    stream = io.BytesIO()
    image.save(stream, format="PNG")
    return stream.getvalue()
