"""What every answer says of a charging station."""
