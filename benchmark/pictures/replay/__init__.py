"""An episode as it was seen: recorded, packed, and shown as a page or a film."""
