"""The parts of scripts/report.py: reading results, Table I, the claims, and one file a section of the report."""
