"""What drives a closed loop: clock, weather, people, prices and carbon, and forecasts of them."""
