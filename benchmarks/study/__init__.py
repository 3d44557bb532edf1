"""What the learning studies share: runs, training with records, files and tables."""
