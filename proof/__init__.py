"""The concealed-effect proof: worlds are sealed, the tool is asked, and only then are the labels opened and scored."""
