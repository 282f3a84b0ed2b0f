"""Functional mock-up units for co-simulation (FMI 2.0) as plants: extra ``[fmu]``, imported when it is first used."""

from mpc.adapters.fmu.plant import FmuPlant
from mpc.adapters.fmu.signals import FmuSignals

__all__ = ["FmuPlant", "FmuSignals"]
