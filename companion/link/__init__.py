"""The vehicle: an interface, and the one that speaks to real autopilots through MAVSDK."""
