"""The paper's method: Go or Stop on top, lanes and speeds under Stop, zones beneath."""
