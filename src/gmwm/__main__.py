"""``python -m gmwm``."""

from gmwm.cli import main

main()
