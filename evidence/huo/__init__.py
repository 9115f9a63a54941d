"""The examples of Huo (2009) beside those of this package."""
