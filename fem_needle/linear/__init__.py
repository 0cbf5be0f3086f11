"""Linear models of a needle about an operating point."""
