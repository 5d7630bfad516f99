"""Consumers of filter numbers, a class each."""
