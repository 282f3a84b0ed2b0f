"""Functional mock-up units for co-simulation (FMI 2.0) as plants: extra ``[fmu]``, imported when it is first used."""

from mpc.plants.fmu._plant import FmuPlant
from mpc.plants.fmu._signals import FmuSignals

__all__ = ["FmuPlant", "FmuSignals"]
