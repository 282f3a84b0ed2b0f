"""Plants that controllers are tested on: our own building and plant in closed loop, and what all plants share."""
