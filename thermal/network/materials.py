"""Fixed values of the baseline's construction: what the parameters do not carry."""

from __future__ import annotations

#: Molecular conductivity of air at 20 degC [W/m/K] (Incropera, Fundamentals of Heat and Mass Transfer, Table A.4).
AIR_CONDUCTIVITY = 0.026

#: Resistance of the structural layer of an exterior wall [m2K/W], which carries its mass inside the insulation: 0.2 m
#: of concrete or brick at 1.4 W/m/K (ISO 10456:2007 Table 3).
STRUCTURE_RESISTANCE = 0.15

#: Nominal areal mass of an exterior wall's structure and of a partition [kg/m2]; only mass times heat capacity is
#: determined.
EXTERIOR_WALL_MASS = 150.0
INTERIOR_WALL_MASS = 60.0

#: Inside surface resistance towards a space that is not simulated [m2K/W] (ISO 6946:2017 Table 7).
BOUNDARY_FILM_RESISTANCE = 0.13

#: Inside film that the rated u-value of a window contains [W/m2/K] (EN 673:2011, h_i).
WINDOW_RATED_FILM = 7.7

#: Combined outside film that rated u-values contain [W/m2/K] (EN 673:2011, h_e).
RATED_OUTSIDE_FILM = 25.0

#: Resistance of a single pane [m2K/W], 4 mm of glass at 1 W/m/K (EN 673:2011): the least that rated u-values may leave.
LEAST_PANE_RESISTANCE = 0.004

#: Step of the paper's shuffle [s].
SHUFFLE_STEP = 300.0
