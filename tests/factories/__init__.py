"""What tests are made of: a file for each concept."""
