"""The sections of the report: one file each, with TITLE and build(results) -> Section. A new one is a file and a place here."""
from . import (advice, claim_table, convergence, error_time, figures, left_out, performance, reading, stiff_cases, stored_problems,
               table_one, unfinished)

ORDER = (reading, table_one, claim_table, figures, error_time, advice, convergence, performance, left_out, stored_problems,
         stiff_cases, unfinished)
