"""Evidence: registered cases with tolerance, worst case and grade; the audit of the chapter."""
