"""THR-ROOT, THR-OPT, THR-CHOICE, THR-DDM: the threshold and the drift-diffusion model that it comes from.

`first_passages.py` is what THR-DDM simulates.
"""
