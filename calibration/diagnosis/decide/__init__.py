"""From gains to probabilities, groups and a verdict."""
