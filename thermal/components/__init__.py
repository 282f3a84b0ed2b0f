"""HVAC components: one a file, each declares its ports, parameters, states, actuators and sensors."""
