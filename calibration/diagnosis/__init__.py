"""Diagnosis of the sim-to-real gap: where it lies, which effect causes it, and how far it shrinks with it."""
