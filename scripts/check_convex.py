#!/usr/bin/env python3
"""The convex method against CVXOPT; exit code 77 where no python3 has that: scripts/contactbench/check_convex.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("check_convex", ("cvxopt", "numpy"), otherwise=77)
