"""Measured records: one reader a file format, one table that says what the columns are."""
