"""From runs to what each model does wrong (scripts/contactbench/today.py), on rows whose answers are known."""
import math
import unittest

from contactbench import program, today


class Cell(dict):
    """What today.py asks of a cell of the table of runs."""
    finished, how_it_ended, seconds = True, "", 1.0


def cell(method, solver="", law="1e-12", status="ok"):
    return Cell(method=method, solver=solver, variant="", step="1e-3", status=status, law_residual_max=law)


def row(name, solver="", **more):
    one = cell(name, solver)
    return {
        "scene": "s", "parameters": "", "step": "1e-3", "cell": one, "column": today.column_of(one), "status": "ok",
        "agree": 0.0, "apart": 0.0, "error": 0.0, "time_per_step": 1.0, **more}


class Today(unittest.TestCase):
    def test_a_model_stands_in_the_column_of_what_it_lacks(self):
        for method, column in (("ap", "polygon"), ("convex", "convexity"), ("soft", "softness"), ("newton", "sequence"),
                               ("mirtich", "sequence")):
            self.assertEqual(today.column_of(cell(method)), column)
        self.assertEqual(today.column_of(cell("coulomb", "newton")), "")

    def test_gauss_and_seidel_that_was_not_done_is_a_sequence_and_the_law_where_it_was(self):
        self.assertEqual(today.column_of(cell("coulomb", "nsgs", law="1e-3", status="inaccurate")), "sequence")
        self.assertEqual(today.column_of(cell("coulomb", "nsgs")), "")

    def test_the_reference_is_newton_s_answer_where_that_is_exact(self):
        cells = [cell("coulomb", "admm"), cell("coulomb", "newton"), cell("coulomb", "cascade", law="1e-3"), cell("ap")]
        self.assertEqual([c["solver"] for c in today.references(cells, "1e-3")], ["newton", "admm"])
        self.assertEqual(today.references(cells, "1e-2"), [])

    def test_the_budget_has_the_runs_of_each_column_the_nearest_to_the_law_first(self):
        near, far = row("soft", apart=1e-4), row("soft", apart=1e-2)
        rows = [row("coulomb", "newton", error=3e-5), far, near, row("ap", apart=math.nan)]
        line = today.budget(rows)["s", "", "1e-3"]
        self.assertEqual(line["softness"], [near, far])
        self.assertEqual(line["polygon"], [])
        self.assertEqual(line["law_error"], 3e-5)

    def test_who_moves_as_the_law_does_is_listed_by_cost(self):
        slow, quick = row("convex", time_per_step=2.0), row("ap", time_per_step=1.0, apart=1e-6)
        wrong = row("soft", time_per_step=0.1, apart=1e-4)
        self.assertEqual(today.advice([slow, wrong, quick])["s", "", "1e-3"], [quick, slow])


class Outside(unittest.TestCase):
    def test_methods_and_solvers_that_a_sweep_names_outside_are_left_out(self):
        def method(name, solvers):
            return {"name": name, "solvers": solvers, "variants": [], "options": []}

        said = {
            "methods": [method("ap", ["lemke", "pgs"]), method("soft", []), method("convex", ["ipm"])], "solvers": [{
                "method": "soft", "name": "none", "unavailable": "not there"}]}
        rows, missing = program.choices(said, ["pgs", "soft"])
        self.assertEqual([(m["name"], s) for m, _, s in rows], [("ap", "lemke"), ("convex", "ipm")])
        self.assertEqual(missing, {})


if __name__ == "__main__":
    unittest.main()
