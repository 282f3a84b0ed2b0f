"""A plant's description, read without making its plant."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError

from mpc.adapters.described.schema import PlantFile
from mpc.errors import PlantError
from thermal.case.schema_file import read_mapping, schema_error

#: Descriptions that the library brings: test cases of BOPTEST by name.
READY = Path(__file__).parent / "cases"


def ready_plants() -> tuple[str, ...]:
    """Name the descriptions that the library brings.

    Examples
    --------
    >>> "bestest_hydronic_heat_pump" in ready_plants()
    True
    """
    return tuple(sorted(path.stem for path in READY.glob("*.yaml")))


def place_of(path: str | Path) -> Path:
    """Find the file of a description.

    Parameters
    ----------
    path : str or Path
        The file itself, or a name of `ready_plants`.
    """
    return READY / f"{path}.yaml" if str(path) in ready_plants() else Path(path)


def read_description(
    path: str | Path, *, at: str | Path | None = None, changes: Mapping[str, Any] | None = None
) -> PlantFile:
    """Read a description without making its plant.

    Parameters
    ----------
    path, at, changes
        As of `mpc.adapters.described.load.load_plant`.

    Raises
    ------
    PlantError
        When it does not fit its schema.
    """
    given = dict(changes or {})
    if at is not None:
        server = str(at).startswith(("http://", "https://"))
        file = None if server else str(Path(at).resolve())
        given["plant"] = {"kind": "boptest", "url": str(at)} if server else {"kind": "fmu", "file": file}
    return _read(place_of(path), given)


def _read(place: Path, changes: Mapping[str, Any] | None) -> PlantFile:
    known = f"a description of a plant, or one of {', '.join(ready_plants())}"
    content = read_mapping(place, PlantError, place.name, known) | dict(changes or {})
    try:
        parsed = PlantFile.model_validate(content)
    except ValidationError as error:
        raise schema_error(error, PlantError, place.name, PlantFile) from error
    try:
        pd.Timestamp(2023, 1, 1, tz=parsed.location.timezone)
    except (KeyError, ValueError, OSError) as error:
        found = repr(parsed.location.timezone)
        raise PlantError(f"{place.name}: location.timezone", "an IANA name", found) from error
    return parsed
