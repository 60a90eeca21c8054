"""The ground station's link, microservices, fleet state and flight."""
