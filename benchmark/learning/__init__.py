"""The same world as a learning problem; what a training run keeps.

``traffic`` is the problem; ``parallel`` and ``single`` show it as PettingZoo and Gymnasium
environments; ``rounds`` is the loop that all trainers share. This package's observation, policies'
weights and rollouts need no training extras.
"""
