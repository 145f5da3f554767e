"""mavplan: from people who need a radio link to a verified mission on a drone."""

__version__ = "0.1.0"
