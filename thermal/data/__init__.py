"""The bundled case: one floor, five zones, ten days at five minutes, from EnergyPlus."""

from pathlib import Path

from thermal.case.case import Case
from thermal.case.load import load_case

__all__ = ["bundled_case_path", "load_bundled_case"]


def bundled_case_path() -> Path:
    """Folder of the bundled case inside the installed package."""
    return Path(__file__).parent / "bundled_case"


def load_bundled_case() -> Case:
    """Load the bundled case.

    Examples
    --------
    >>> load_bundled_case().building.zone_names
    ('F1_N', 'F1_W', 'F1_C', 'F1_E', 'F1_S')
    """
    return load_case(bundled_case_path())
