"""Offices with ideal air as a world of blind trials."""

from __future__ import annotations

from _worlds import World

from ideal_air_trials.drawing import draw_spec
from ideal_air_trials.specification import DAYS, KINDS, Spec
from ideal_air_trials.trial import run_trial

WORLD = World(KINDS, DAYS, draw_spec, run_trial, Spec.twins)
