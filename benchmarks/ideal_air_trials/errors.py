"""What can go wrong while a trial is made."""


class TrialError(Exception):
    """A trial could not be made; the message says what and where."""


class EnergyPlusNotThereError(TrialError):
    """EnergyPlus is not installed."""
