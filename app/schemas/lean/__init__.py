"""What a request wants to have of its answer: form of lines, parts, digits."""
