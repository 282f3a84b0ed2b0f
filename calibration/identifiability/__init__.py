"""What data determine: Fisher information, profiles, power before a fit."""
