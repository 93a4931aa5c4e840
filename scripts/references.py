#!/usr/bin/env python3
"""Makes certified references of scenes: scripts/contactbench/references.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("references")
