"""What joins companion computer and flight controller in practice, and the serial line it uses."""
