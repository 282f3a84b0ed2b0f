"""What a case lacks that spoils whatever is found with it, for the top of its pages."""

from __future__ import annotations

from mpc.reports.means import Means
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


def windows_first(means: Means, case: Case) -> Means:
    """Say that a building without windows is to be given its windows before anything else is done.

    Parameters
    ----------
    means : Means
        Of what was found with it.
    case : Case
        The case that a page is about.
    """
    if has_windows(case.building):
        return means
    trust = "Not before the building has its windows: what the sun does, this model puts down to something else. "
    first = "Give the building its windows, as the warning says, and run this again."
    return Means(means.answer, trust + means.trust, first)
