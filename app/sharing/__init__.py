"""Where graphs come from: files on disk, or memory that several processes read."""
