"""A folder of a test's own, gone at its end."""
import tempfile
import unittest
from pathlib import Path


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)
