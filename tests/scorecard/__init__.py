"""The reliability scorecard: 19 rows of faults and loads, each with its figure.

    make soak SECONDS=60      # each row for so long; then rates and real time, for hours
    python -m tests.scorecard 60 --keep   # the rows alone, and the table of docs/reliability.md

In `make test`, each row takes a second or two.
"""
