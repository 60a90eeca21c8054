"""What is known of every vehicle: telemetry folded into state. No socket, no clock."""
