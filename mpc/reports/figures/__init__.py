"""Figures of the reports: each a picture that carries its own data, so that a page needs nothing else."""
