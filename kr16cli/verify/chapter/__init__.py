"""The audit of chapter 3: every printed equation executed as printed and judged.

`printed_*.py` lie beside the chapter in its order; `recipe.py` and `motion.py` hold what their
lines are executed with, `arm.py` the arm of Table 3.1 alone, `model_side.py` the model judged
beside it. `audit` is the entry.
"""

from kr16cli.verify.chapter.audit import SECTIONS, audit, audit_section, to_json
from kr16cli.verify.chapter.records import Equation

__all__ = ["SECTIONS", "Equation", "audit", "audit_section", "to_json"]
