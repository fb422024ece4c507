"""`make mutants`: whether the tests notice small mistakes in idlc.

`plugin` records which tests execute which lines, in the programs that tests start as well.
`mutations` makes mistakes in executed lines, by a seed. `__main__` runs, for each mistake, the
tests that execute its line, cheapest first, until one fails.
"""
