"""LIVE-WAIT: no UAV keeps a UGV from its own task for longer than a bound. Begin with `live_wait.py`."""
