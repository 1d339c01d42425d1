"""The finite-element side, from mesh to Newton and stages; it knows no case and no file of results."""
