"""The documents are true: their commands work, and their screens are real."""
