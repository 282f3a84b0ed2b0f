"""What can go wrong while a trial is made."""

from _sealed import TrialError


class EnergyPlusRunError(TrialError):
    """EnergyPlus stopped, ended with severe errors, or computed what its input does not ask for."""


class TrialGeometryError(TrialError):
    """EnergyPlus's building and the case's are not the same."""
