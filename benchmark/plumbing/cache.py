"""Where networks and demand are kept that took time to build."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """The folder of built networks and routes; ``RIGHTOFWAY_CACHE`` overrides."""
    import platformdirs

    chosen = os.environ.get("RIGHTOFWAY_CACHE")
    return Path(chosen) if chosen else platformdirs.user_cache_path("rightofway")
