"""How well a model predicts: N-step errors, their intervals and runs."""
