"""Fabric laws on their own: along a history, under strain probes, in the critical state; and contact statistics."""
