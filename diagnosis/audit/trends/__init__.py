"""The course of a part's loss over missions."""
