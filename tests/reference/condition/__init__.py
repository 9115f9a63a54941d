"""High-precision reference for the Frobenius condition number of a serial robot's Jacobian."""
