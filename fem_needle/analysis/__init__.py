"""What a needle is to a controller: frequencies, gains, controllability."""
