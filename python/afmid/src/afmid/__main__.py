"""`python -m afmid`: the program."""

from ._program import main

main()
