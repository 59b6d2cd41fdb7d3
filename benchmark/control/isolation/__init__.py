"""Controllers that nobody vouches for run in processes of their own, apart from the simulation.

``remote`` is the runner's side, ``child`` the controller's, ``channel`` all that passes between
them; docs/isolation.md says what an isolated controller can and cannot do.
"""
