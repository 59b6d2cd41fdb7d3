"""What a controller is given and may answer, how one is found, and how its faults stay its own."""
