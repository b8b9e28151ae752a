"""Replay of a saved run: its `scene`, shown as a `page` or a `video`."""
