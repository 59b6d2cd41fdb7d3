"""What a regression check says: for the terminal, Markdown, JUnit XML and JSON, a file each."""
