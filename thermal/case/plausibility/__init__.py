"""What in a case cannot be, or can hardly be, true: sensors, clock, zones and sizes held against physics."""
