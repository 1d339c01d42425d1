"""Boundary-value problems in granular soil with the fabric-enhanced Chang-Hicher model."""

__version__ = "0.1.0"
