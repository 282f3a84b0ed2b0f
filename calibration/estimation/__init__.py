"""Filters and smoothers: states, unmeasured heat, and the likelihood of innovations."""
