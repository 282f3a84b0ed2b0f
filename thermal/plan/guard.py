"""Guards of the import: files, numbers and packages that it is given."""

import importlib
import math
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from thermal.case.load import file_inside
from thermal.errors import MissingExtraError, OversizedFileError, PlanError


def extra(module: str, of: str = "plan", needed_by: str = "plan import") -> Any:
    """Import a module of an extra of the installation.

    Parameters
    ----------
    module : str
        Its full name.
    of : str
        The extra.
    needed_by : str
        What needs it, for the message.

    Returns
    -------
    module
        The module.

    Raises
    ------
    MissingExtraError
        It is not installed; the message has the line that adds it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        advice = f'run: pip install "buildingmpc[{of}]"'
        raise MissingExtraError(needed_by, f"the package {module!r}", str(error), advice) from error


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


@cache
def vocabulary(section: str) -> dict[str, Any]:
    """Words of other lists and what they mean in the case format, from ``vocabulary.yaml`` of the package's data.

    Parameters
    ----------
    section : str
        Part of the file, such as ``brick_points``.

    Returns
    -------
    dict
        Meaning, or weight [-], by word, in the order of the file.
    """
    content = yaml.safe_load((Path(__file__).parents[1] / "data" / "vocabulary.yaml").read_text(encoding="utf-8"))
    return dict(content[section])


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
    advice, expected = "unpack it first" if suffix == ".zip" else "", f"a file that ends in {', '.join(kinds)}"
    PlanError.unless(suffix in kinds, path.name, expected, repr(suffix or path.name), advice)
    with reading(path, "a file that can be read"):
        if not path.is_file():
            raise PlanError(str(path), "a file", "a folder" if path.is_dir() else "nothing")
        size = path.stat().st_size
        found, expected = f"{size / 1e6:.0f} MB", f"at most {MOST_BYTES / 1e6:.0f} MB"
        OversizedFileError.unless(size <= MOST_BYTES, path.name, expected, found, "export it anew")
        with path.open("rb") as stream:
            start = stream.read(1024)
    known = _SIGNATURES.get(suffix)
    # A PDF may have some bytes before its signature (ISO 32000-1, annex H, note 13).
    fits = known is None or (known[0] in start if suffix == ".pdf" else start.startswith(known))
    found = f"a file that begins with {start[:8]!r}" if start else "an empty file"
    PlanError.unless(fits and start, path.name, f"a {suffix[1:].upper()} file", found, "export it anew")
    return path.absolute()


_PATIENCE = 60.0  # s, for a page of a drawing; an honest one takes a second or two, its words ten


def run_program(command: list[str], file: Path, expected: str, package: str) -> str:
    """Run a program on a drawing, for a limited time.

    Parameters
    ----------
    command : list of str
        Program and arguments.
    file : Path
        The drawing, for messages.
    expected : str
        What it should be, for messages.
    package : str
        Of Debian, that has the program.

    Returns
    -------
    str
        What it wrote.

    Raises
    ------
    MissingExtraError
        The program is not installed.
    OversizedFileError
        It takes longer than a minute.
    PlanError
        It fails.
    """
    try:
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE, check=False)
    except FileNotFoundError as error:
        advice = f"run: apt install {package}"
        raise MissingExtraError("plan import", f"the program {command[0]!r}", "none", advice) from error
    except subprocess.TimeoutExpired as error:
        wanted = f"a page that is drawn within {_PATIENCE:.0f} s"
        raise OversizedFileError(file.name, wanted, "one that takes longer", "export it anew") from error
    if done.returncode != 0:
        found = " ".join(done.stderr.decode(errors="replace").replace(str(file), file.name).split())[:200]
        raise PlanError(file.name, expected, found or "an error")
    return done.stdout.decode(errors="replace")


@contextmanager
def reading(file: Path, expected: str, *kinds: type[Exception]) -> Iterator[None]:
    """Raise what goes wrong while a file is read as an error that names the file.

    Parameters
    ----------
    file : Path
        File.
    expected : str
        What it should be, for the message.
    *kinds : type of Exception
        What its reader raises beside `OSError` and `ValueError`.

    Raises
    ------
    PlanError
        The file cannot be read as that.
    """
    caught: tuple[type[Exception], ...] = (OSError, ValueError, *kinds)
    try:
        yield
    except caught as error:
        found = " ".join(str(error).replace(str(file), file.name).split())[:200]
        raise PlanError(file.name, expected, found or type(error).__name__) from error


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
        raise OversizedFileError(where, expected, found, "export it at fewer dots per inch")


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

    Raises
    ------
    PlanError
        It lies elsewhere, or is no name of a file.
    """
    expected, advice = "a file in the folder of the list", "copy the file beside the list"
    return file_inside(folder, name, where, expected, advice, PlanError)


def first_fault(error: ValidationError, where: str) -> tuple[str, str, str]:
    """Place, expectation and finding of the first fault of a file or a request, as errors take them.

    Parameters
    ----------
    error : ValidationError
        What the model of it says.
    where : str
        File or request.
    """
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"]) or "content"
    return f"{where}: {place}", first["msg"].removeprefix("Input should be "), repr(first["input"])[:80]


def checked_number(value: object, name: str, lowest: float, highest: float, unit: str) -> float:
    """Refuse a setting that is no number, or out of its range.

    Parameters
    ----------
    value : object
        What was given.
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
        raise PlanError(name, f"a number from {lowest:g} to {highest:g} {unit}", repr(value))
    return float(value)  # type: ignore[arg-type]
