"""Figures and pages. The only part that imports matplotlib."""
