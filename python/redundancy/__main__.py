"""``python -m redundancy``: the command line."""

from .cli import main

main(prog_name="redundancy")
