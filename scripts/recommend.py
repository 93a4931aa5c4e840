#!/usr/bin/env python3
"""Which method for a scene? scripts/contactbench/recommend.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("recommend")
