"""What can go wrong while a trial is made."""


class TrialError(Exception):
    """A trial could not be made; the message says what and where."""


class EnergyPlusMissingError(TrialError):
    """EnergyPlus is not installed."""


class EnergyPlusRunError(TrialError):
    """EnergyPlus stopped, ended with severe errors, or computed what its input does not ask for."""


class TrialGeometryError(TrialError):
    """EnergyPlus's building and the case's are not the same."""
