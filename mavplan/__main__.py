"""Entry point of ``python -m mavplan``."""

from mavplan.cli import main

main()
