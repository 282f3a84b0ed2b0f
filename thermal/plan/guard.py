"""What no file may be: missing, larger than a real plan, of another kind than its name says, outside of its folder."""

from __future__ import annotations

import math
from pathlib import Path

from thermal.errors import OversizedFileError, PlanError, describe

#: Largest file that is opened [bytes]: a scan of a large sheet has some 20 MB.
MOST_BYTES = 100_000_000

#: Largest drawing that is decoded [pixels]: a sheet of format A0 at 150 dots per inch has 35 million.
MOST_PIXELS = 60_000_000

#: First bytes of the kinds of file, by suffix; kinds of text have none.
_SIGNATURES: dict[str, tuple[bytes, ...]] = {
    ".png": (b"\x89PNG\r\n\x1a\n",),
    ".jpg": (b"\xff\xd8\xff",),
    ".jpeg": (b"\xff\xd8\xff",),
    ".pdf": (b"%PDF-",),
    ".npy": (b"\x93NUMPY",),
    ".npz": (b"PK\x03\x04",),
}


def checked_file(path: Path, kinds: tuple[str, ...]) -> Path:
    """Refuse a file that is not there, too large, or not what its suffix says.

    Parameters
    ----------
    path : Path
        File.
    kinds : tuple of str
        Suffixes that will do, in lower case.

    Returns
    -------
    Path
        The same, absolute, so that no name can be taken for an option of a program.

    Raises
    ------
    PlanError
        It is missing, has another suffix, or its first bytes are those of something else.
    OversizedFileError
        It is larger than `MOST_BYTES`.
    """
    suffix = path.suffix.lower()
    if suffix not in kinds:
        expected = f"a file that ends in {', '.join(kinds)}"
        advice = "unpack it first" if suffix == ".zip" else ""
        raise PlanError(describe(path.name, expected, repr(suffix or path.name), advice))
    try:
        if not path.is_file():
            raise PlanError(describe(str(path), "a file", "a folder" if path.is_dir() else "nothing"))
        size = path.stat().st_size
        if size > MOST_BYTES:
            found = f"{size / 1e6:.0f} MB"
            raise OversizedFileError(describe(path.name, f"at most {MOST_BYTES / 1e6:.0f} MB", found, "export it anew"))
        with path.open("rb") as stream:
            start = stream.read(1024)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise PlanError(describe(path.name, "a file that can be read", str(error))) from error
    known = _SIGNATURES.get(suffix)
    # A PDF may have some bytes before its signature (ISO 32000-1, annex H, note 13).
    fits = known is None or (known[0] in start if suffix == ".pdf" else start.startswith(known))
    if not fits or not start:
        found = f"a file that begins with {start[:8]!r}" if start else "an empty file"
        raise PlanError(describe(path.name, f"a {suffix[1:].upper()} file", found, "export the drawing anew"))
    return path.absolute()


def check_pixels(columns: float, rows: float, where: str) -> None:
    """Refuse a drawing before it is decoded, when it has more pixels than a real plan.

    Parameters
    ----------
    columns, rows : float
        Size of the drawing [px].
    where : str
        File, for the message.

    Raises
    ------
    OversizedFileError
        It has more than `MOST_PIXELS`.
    """
    if not 0 < columns * rows <= MOST_PIXELS:
        expected = f"1 to {MOST_PIXELS / 1e6:.0f} million pixels"
        found = f"{columns:.0f} x {rows:.0f} = {columns * rows / 1e6:.0f} million"
        raise OversizedFileError(describe(where, expected, found, "export it at fewer dots per inch"))


def inside_folder(folder: Path, name: str, where: str) -> Path:
    """Resolve a name in a list of drawings; refuse one that leads out of the list's folder.

    Parameters
    ----------
    folder : Path
        Folder of the list.
    name : str
        What the list says.
    where : str
        Key of the list, for the message.

    Returns
    -------
    Path
        Resolved, so that no link leads elsewhere.

    Raises
    ------
    PlanError
        It lies elsewhere, or is no name of a file.
    """
    try:
        target = (folder / name).resolve()
        inside = target.is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError) as error:  # a NUL, a name too long, links in a circle
        raise PlanError(describe(where, "the name of a file", repr(name))) from error
    if not inside:
        advice = "copy the file beside the list"
        raise PlanError(describe(where, "a file in the folder of the list", repr(name), advice))
    return target


def checked_number(value: object, name: str, lowest: float, highest: float, unit: str) -> float:
    """Refuse a setting that is no number, or out of its range.

    Parameters
    ----------
    value : object
        What came.
    name : str
        Of the setting, for the message.
    lowest, highest : float
        Its range, both included [unit of the setting].
    unit : str
        For the message.

    Returns
    -------
    float
        The value.

    Raises
    ------
    PlanError
        It is no finite number, or out of range.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not is_number or not lowest <= float(value) <= highest:  # type: ignore[arg-type]
        raise PlanError(describe(name, f"a number from {lowest:g} to {highest:g} {unit}", repr(value)))
    return float(value)  # type: ignore[arg-type]
