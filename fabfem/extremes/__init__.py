"""Stiff and extreme cases, each swept until it breaks: the same answer or a refusal with a reason."""
