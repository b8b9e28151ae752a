"""What every room uses: errors, files, interruption, progress, processes side by side, parsers of command lines.

Imports nothing of the other rooms.
"""
