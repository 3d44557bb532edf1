"""The algorithms of this package in rl_zoo3: `python -m sb3_bayes_dsac.zoo train --algo ...`."""
