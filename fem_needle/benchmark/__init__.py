"""Run time against error: this program, exact solutions, common libraries and rivals on the same cases."""
