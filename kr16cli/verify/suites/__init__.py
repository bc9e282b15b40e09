"""The registered cases, one module or package per suite."""
