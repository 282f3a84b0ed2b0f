"""Places that files can be written to."""

import tempfile
from pathlib import Path

from thermal.errors import Described


def check_writable(folder: Path, kind: type[Described]) -> None:
    """Refuse a folder that no file can be written to, or that cannot be made; nothing is left there.

    Parameters
    ----------
    folder : Path
        That is to be written to; it may not be there yet.
    kind : type
        Error to raise, one of a family of errors.

    Notes
    -----
    It is tried with a folder of another name: permissions do not tell of file systems that are read-only, full, or not
    for files at all, as ``/proc``.
    """
    trouble: object = None
    place = folder.absolute()
    try:
        place = next(known for known in (place, *place.parents) if known.exists())
        with tempfile.TemporaryDirectory(prefix=".try-", dir=place):
            pass
    except OSError as error:
        trouble = error.strerror or error
    advice = "choose another folder"
    kind.unless(trouble is None, str(folder), "a place that can be written to", f"{place}: {trouble}", advice)
