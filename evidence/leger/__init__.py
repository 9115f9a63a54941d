"""The figures of Leger (2014) beside those of this package."""
