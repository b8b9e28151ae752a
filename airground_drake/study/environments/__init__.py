"""Step-wise environments over the Drake model, for learning: Gymnasium and PettingZoo (extra `gym`).

`gymnasium_env` and `pettingzoo_env` have the environments; `episode`, `sources` and `encoding` need neither package.
"""
