"""EnergyPlus' reference buildings as a world of blind trials."""

from __future__ import annotations

from _worlds import World

from reference_trials.specification import DAYS, KINDS, draw_spec
from reference_trials.trial import run_trial

WORLD = World(KINDS, DAYS, draw_spec, run_trial)
