"""What a case lacks that spoils whatever is found with it, for the top of its pages."""

from __future__ import annotations

from thermal.case.case import Case
from thermal.case.validation import NO_WINDOWS, has_windows


def case_warnings(case: Case) -> list[str]:
    """Say what of a case spoils whatever is found with it, for the top of a page.

    Parameters
    ----------
    case : Case
        The case that a page is about.
    """
    named = case.path.name if case.path is not None else case.building.name
    told = NO_WINDOWS.replace("CASE", named)
    return [] if has_windows(case.building) else [f"{told[0].upper()}{told[1:]}."]
