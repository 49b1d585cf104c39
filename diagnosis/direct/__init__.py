"""Direct evidence: a quantity that is measured twice.

Its models of the fault rows, with their filters and path, are those of `diagnosis.estimation`.
"""
