#!/usr/bin/env python3
"""Writes the report from the result files: scripts/contactbench/report.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("report")
