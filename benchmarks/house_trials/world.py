"""The package as a world of blind trials."""

from __future__ import annotations

from _worlds import World
from energyplus_trials.specification import KINDS

from house_trials.drawing import DAYS, draw_spec, without
from house_trials.trial import run_trial

WORLD = World(KINDS, DAYS, draw_spec, run_trial, without)
