"""THR-ROOT, THR-OPT, THR-DDM: the threshold and the drift-diffusion model that it comes from.

`constants.py` and `expressions.py` are what THR-ROOT and THR-OPT are about, `first_passages.py` what THR-DDM simulates.
"""
