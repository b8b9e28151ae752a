"""Errors, files, interruption, progress, parallel processes and parsers of command lines, for every other room.

Enters: files, arguments, names.
Leaves: errors, text, data, processes.
May import: no other room.
"""
