#!/usr/bin/env python3
"""All methods on one scene: scripts/contactbench/compare.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("compare")
