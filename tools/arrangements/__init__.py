"""Makes the fixed arrangements of `models/arrangements/data`."""
