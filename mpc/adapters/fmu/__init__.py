"""Functional mock-up units for co-simulation (FMI 2.0) as plants: extra ``[fmu]``, imported when it is first used."""
