"""The label-setting search, its workspace, and its slow twin."""
