"""Training of controllers that decide Go or Stop: the environments, rollouts and what a run keeps.

``traffic`` is the learning problem; ``parallel`` and ``single`` show it as PettingZoo and Gymnasium
environments; ``run`` and ``course`` are what all trainers share. This package's observation,
policies' weights and rollouts need no training extras.
"""
