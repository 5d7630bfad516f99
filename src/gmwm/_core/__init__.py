"""What several rooms share."""

__version__ = "0.1.0"
