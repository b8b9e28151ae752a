"""Figures of a report: maps, timelines and comparisons, each with a data table and a description."""
