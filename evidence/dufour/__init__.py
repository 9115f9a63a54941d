"""The scenarios of Dufour and Suleiman (2020)."""
