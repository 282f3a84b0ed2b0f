"""Examples of hypothesis for components."""

from __future__ import annotations

from hypothesis import settings

# the same examples at each run, and as long as a busy machine takes for them
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
