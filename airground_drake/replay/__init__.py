"""Replay of saved runs: what is where at each moment (`scene`), as a page (`page`) or a video (`video`)."""
