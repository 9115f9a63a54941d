"""The planner beside a grid search."""
