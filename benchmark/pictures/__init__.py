"""What an intersection and its traffic look like: drawings, replays as page and film."""
