"""Wang et al.'s Go/Stop controller: its network, its training and its weights."""
