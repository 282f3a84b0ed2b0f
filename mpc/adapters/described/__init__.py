"""Plants described in one file, ``plant.yaml``: points, actuators, comfort bands, prices, weather and forecasts."""
