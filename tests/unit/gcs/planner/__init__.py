"""The cloud planner: costs, gradients, feasibility, allocation."""
