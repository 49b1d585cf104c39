"""Scores of a diagnosis against known truth."""
