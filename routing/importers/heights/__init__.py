"""Heights of a map: elevation files read, and profiles along roads."""
