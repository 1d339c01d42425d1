"""A laboratory at one point: element tests from case files. Nothing of the finite-element side is imported."""
