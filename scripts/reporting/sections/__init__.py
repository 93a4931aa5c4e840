"""The sections of the report: one file each, with TITLE and build(results) -> Section. A new one is a file and a place here."""
from . import claim_table, error_time, figures, reading, table_one, unfinished

ORDER = (reading, table_one, claim_table, figures, error_time, unfinished)
