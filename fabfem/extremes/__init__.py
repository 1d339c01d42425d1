"""Stiff and extreme cases, each swept until it breaks: the same answer within a tolerance, or a refusal with a reason."""
