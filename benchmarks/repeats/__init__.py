"""Messages over an air that loses PDUs: with repeats, without, and as others do it.

    python -m benchmarks.repeats --json
    python -m benchmarks.repeats --data FOLDER    # also with traces of real links

`losses` says when the air loses what is sent, `ours` runs real links on it, and `peers` two other
ways on the same losses: block codes as in wfb-ng, and negative acknowledgments as in RFC 3208.
"""
