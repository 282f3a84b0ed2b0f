"""Connections to a building: BACnet/IP and MQTT."""
