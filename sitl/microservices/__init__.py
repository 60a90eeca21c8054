"""The vehicle's side of MAVLink's services, sans-IO: messages and time in, messages out, one file per service."""
