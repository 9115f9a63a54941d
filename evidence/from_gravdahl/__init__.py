"""From and Gravdahl: orientation tolerances, coordinate descent, faster painting."""
