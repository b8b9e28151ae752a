"""Errors, files, interruption, progress, parallel processes and parsers of command lines, for every other room.

Imports no other room.
"""
