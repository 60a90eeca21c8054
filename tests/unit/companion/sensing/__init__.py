"""Range sensors: from packets to scans."""
