"""How well a closed loop did: BOPTEST's indicators, and the rewards of its steps."""
