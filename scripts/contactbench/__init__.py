"""What the entry points in scripts/ run: start (the interpreter), program (the one place that starts processes), plan,
sweep and references (runs), runs (their one table), precision, claims and sections (the report), figures, stress and
campaign."""
