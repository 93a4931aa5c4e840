#!/usr/bin/env python3
"""Answers the paper's claims from the result files: scripts/contactbench/claims.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("claims")
