"""The catalogue of effects: what a building may have and the baseline does not, each a term of the model."""
