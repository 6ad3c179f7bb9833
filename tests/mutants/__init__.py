"""What the tests miss: one thing of the product is changed at a time, and a test should fail.

pytest collects the tests once. Each changed program, a mutant, is a forked child of that process:
the child exchanges the code of the live functions, runs the tests that reach the changed line, the
cheapest first, and ends with the first one that fails. So a mutant costs no import.
"""
