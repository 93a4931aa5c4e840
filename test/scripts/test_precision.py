"""From runs to errors, choices and orders (precision.py, stepping.py), on folders made by hand."""
import math
import unittest

import made
import matplotlib.pyplot as plt
import numpy as np
from contactbench import precision, sections, stepping
from folder import Folder

ERROR = "error_position_linf_m"
NEWTON = {"method": "newton", "solver": "", "variant": "uncapped"}
COULOMB = {"method": "coulomb", "solver": "newton"}
BODIES = ("a", "b")


class Results(Folder):
    def results(self, *rows, motions=None, ensemble=(), **manifest):
        """`motions`: of each run how far its second body is ahead, m at each of some moments."""
        of = made.results(self.top, rows, ensemble, **manifest)
        for run, ahead in (motions or {}).items():
            rows = [(t, body, (0, 0, way if body == "b" else 0)) for t, way in ahead.items() for body in BODIES]
            made.write_files(of.runs / run, {"trajectory.csv": made.trajectory(rows)})
        return of


def row(run, error="", **more):
    return made.row(run=run, sweeps="error_time", **{ERROR: error} | more)


class Points(Results):
    def test_a_point_has_times_a_simulated_second_and_a_step_and_the_worst_of_its_ensemble(self):
        rows = [
            row(f"a__r{n}", 3e-4, repeat=n, processing_s=s, duration=4, steps=50, busy=busy)
            for n, s, busy in ((1, 8, "false"), (2, 2, "true"), (3, 3, "false"))]
        rows += [row("late", 1.0, k="4", status="time_limit", finished="false", t_reached="0.5"), row("none", "", k="16")]
        members = [row(f"m{n}", e, member=n, status=status) for n, e, status in ((1, 5e-4, "ok"), (2, 1e-4, "inaccurate"))]
        first, late, none = precision.points(self.results(*rows, ensemble=members), "box", "")
        self.assertEqual({key: first[key] for key in first if key != "cell"}, {
            "run": "a__r3", "scene": "box", "parameters": "", "step": "0.01", "measure": "position_linf_m", "status": "ok",
            "error": 3e-4, "errors": [3e-4, 5e-4, math.inf], "worst": math.inf, "uncertainty": 0.0, "time": 0.75, "least": 0.5,
            "most": 2.0, "time_per_step": 0.06, "repeats": 3, "busy": True})
        self.assertEqual([late[key] for key in ("status", "error", "time", "errors", "repeats")],
                         ["time_limit", None, None, [], 0])
        self.assertEqual([none[key] for key in ("status", "error", "worst", "time", "repeats")], ["ok", None, None, None, 1])
        sample = precision.spread(first | {"errors": [3e-4, 5e-4, math.inf]})
        self.assertEqual(f"{sample:.3g}", "0.0004 [0.0003 to 0.0005] in 2 of 3")
        self.assertIs(precision.spread(first | {"errors": [3e-4, 3e-4]}), first["error"])

    def test_the_error_of_a_scene_is_its_closed_form_then_a_certified_one_then_creep(self):
        certified = {"error_certified_linf_m": 2e-4, "error_creep_linf_m": 3e-4}
        results = self.results(
            row("a", 1e-4, scene="one", **certified), made.row(run="b", scene="two", sweeps="error_time", **certified),
            made.row(run="c", scene="three", sweeps="error_time", error_certified_linf_m=1, error_creep_linf_m=3e-4,
                     error_displacement_linf_m=4e-4, reference="other"), made.row(run="d", scene="four", sweeps="error_time"),
            made.row(run="e", scene="five", sweeps="orders", error_creep_linf_m=1), references={
                "two": {"uncertainty_m": 2.6e-5}, "four": {"reason": "methods part"}})
        self.assertEqual(precision.scenes(results), [("one", ""), ("two", ""), ("three", "")])
        measures = {scene: precision.measure(results, scene, "") for scene in ("one", "two", "three", "four", "five")}
        self.assertEqual(
            measures,
            {"one": "position_linf_m", "two": "certified_linf_m", "three": "displacement_linf_m", "four": "", "five": ""})
        self.assertEqual(precision.measure(results, "five", "", "orders"), "creep_linf_m")
        self.assertEqual(
            [precision.reference_of(results, scene, "", measures[scene]) for scene in ("two", "three", "four", "five")],
            ["certified to 3e-05 m", "other", "missing: methods part", "missing"])
        point, = precision.points(results, "two", "")
        self.assertEqual((point["error"], point["uncertainty"]), (2e-4, 2.6e-5))
        point, = precision.points(results, "two", "", "creep_linf_m")
        self.assertEqual((point["error"], point["uncertainty"]), (3e-4, 0.0))

    def test_the_front_counts_the_worst_of_the_ensemble_and_what_is_one_percent_less(self):
        def front(*points):
            return [p["time"] for p in precision.pareto([{"time": t, "error": e, "worst": w} for t, e, w in points])]

        self.assertEqual(front((1, 1e-3, 1e-2), (2, 5e-3, 5e-3), (3, 1e-4, 9e-3)), [1, 2])
        self.assertEqual(front((2, 0.98, 0.98), (1, 1, 1), (3, 0.975, 0.975), (4, 0.9, 0.9)), [1, 2, 4])
        self.assertEqual(front((1, 5e-13, 5e-13), (2, 0, 0)), [1])  # both are rounding
        self.assertEqual(front((1, 2.0, 2.0), (1, 1.0, 1.0)), [1])

    def test_an_answer_is_quick_enough_too_and_times_tell_two_apart_where_they_do_not_overlap(self):
        point = {
            "error": 1e-3, "worst": 1e-3, "uncertainty": 0, "status": "ok", "cell": {"false_claims": "0"},
            "time_per_step": 2e-3}
        self.assertTrue(precision.met(point, 1e-3, 2e-3))
        for error, limit in ((0.9e-3, None), (1e-3, 1.9e-3)):
            self.assertFalse(precision.met(point, error, limit))
        self.assertFalse(precision.met(point | {"worst": 2e-3}, 1e-3))
        for uncertainty, found in ((1e-4, True), (3e-4, False)):  # of the reference
            self.assertEqual(precision.met(point | {"worst": 8e-4, "uncertainty": uncertainty}, 1e-3), found)
        early, late = ({"least": a, "most": b, "repeats": 2} for a, b in ((1, 2), (2.1, 3)))
        self.assertEqual([precision.told_apart(*two) for two in ((early, late), (late, early), (early, late | {"least": 1.9}))],
                         [True, True, False])
        self.assertIsNone(precision.nearest([point | {"status": "ray", "time": 1}]))
        some = [point | {"time": t, "worst": w} for t, w in ((1, 2e-3), (3, 1e-3), (2, 1e-3))]
        self.assertEqual(precision.nearest(some)["time"], 2)


class Motions(Results):
    def test_two_runs_are_apart_by_the_worst_body_at_the_moments_that_both_recorded(self):
        results = self.results(
            row("one"), row("two", k="4"), row("none", k="16"), motions={
                "one": {0: 0, 0.1: 3, 0.2: 1, 0.35: 50, 0.4: 9}, "two": {0: 0, 0.1: 1, 0.2: 4, 0.3: 70, 0.4: 9.5}})
        one, two, none = results.cells(sweep="error_time")
        self.assertEqual(precision.distances(one, two), {0: 0, 0.1: 2, 0.2: 3, 0.4: 0.5})
        self.assertEqual([precision.apart(one, two, t) for t in (math.inf, 0.2, 0.15)], [3, 3, 2])
        self.assertTrue(math.isnan(precision.apart(one, none)))
        self.assertTrue(math.isnan(precision.apart(one, two, 0.05)))  # all begin alike, which says nothing
        # In space, of each body.
        three, four = ([(0.1, "a", a), (0.1, "b", b)] for a, b in (((1, 2, 2), (0, 0, 0)), ((0, 0, 0), (2, 0, 0))))
        cells = self.results(
            row("three") | {"files": {"trajectory.csv": made.trajectory(three)}},
            row("four", k="4") | {"files": {"trajectory.csv": made.trajectory(four)}}).cells(sweep="error_time")
        self.assertEqual(precision.apart(*cells), 3)

    def test_the_same_problem_solved_tightly_is_of_the_same_model_polygon_and_step(self):
        cells = [
            made.cell(run=run, **of)
            for run, of in (("lemke4", {"k": "4"}), ("bad8", {"status": "inaccurate"}), ("path8", {"solver": "path"}),
                            ("fine8", {"step": "1e-3"}), ("lemke8", {}), ("loose", made.EPS | {"epsilon": "1e-2"}),
                            ("bound", made.EPS | {"step": "1e-3", "law_residual_max": "1.1e-8"}),
                            ("tight", made.EPS | {"law_residual_max": "0.9e-8"}), ("law", COULOMB), ("mirtich", NEWTON))]
        by = {c["run"]: c for c in cells}

        def of(run):
            found = precision.twin(cells, by[run])
            return found and found["run"]

        self.assertEqual([of(run) for run in ("path8", "lemke4", "loose", "mirtich")], ["lemke8", "lemke4", "law", None])
        self.assertEqual([(precision.coulomb(some, step) or {"run": None})["run"]
                          for some, step in ((cells, "0.01"), (cells[:-2], "0.01"), (cells, "1e-3"))], ["law", "tight", None])

    def test_a_part_of_the_error_dominates_where_the_whole_ensemble_says_so(self):
        # The law is 1e-3 m off its exact answer; the loose one 4e-3 m from it, in the first member 2e-4 m.
        def some(ahead, **more):
            return [
                row("law" + "m" * bool(more), 1e-3, **COULOMB, **more),
                row("loose" + "m" * bool(more), ahead, **made.EPS | {"epsilon": "1e-2"}, **more)]

        motions = {"law": {0: 0, 1: 1}, "loose": {0: 0, 1: 1.004}, "lawm": {0: 0, 1: 1}, "loosem": {0: 0, 1: 1.0002}}
        rows = {r["cell"]["run"]: r for r in precision.budget(self.results(*some(5e-3), motions=motions), "box", "")}
        self.assertAlmostEqual(rows["loose"]["solver"], 4e-3)
        self.assertEqual([rows["loose"][key] for key in ("model", "step_error", "dominates", "total")],
                         [0, 1e-3, "solver", 5e-3])
        self.assertEqual([rows["law"][key] for key in ("solver", "model", "step_error", "dominates")], [0, 0, 1e-3, "step"])
        results = self.results(*some(5e-3), ensemble=some(5e-3, member="1"), motions=motions)
        rows = {r["cell"]["run"]: r["dominates"] for r in precision.budget(results, "box", "")}
        self.assertEqual(rows, {"law": "step", "loose": "differs"})

    def test_the_step_s_share_is_against_the_polygon_s_own_answer_or_the_cone_s_where_they_are_one(self):
        own = "error_polygon_position_linf_m"
        for ahead, polygon, step in ((1.25, 3e-4, 3e-4), (1.25, "", math.nan), (1.0, "", 2e-3)):
            results = self.results(row("law", 1e-3, **COULOMB | {own: 7}), row("lemke", 2e-3, **{own: polygon}),
                                   row("loose", 9, **made.EPS), motions={
                                       "law": {0: 0, 1: 1}, "lemke": {0: 0, 1: ahead}, "loose": {0: 0, 1: 1.5}})
            for read in (precision.moments, precision.distances_of):
                read.cache_clear()  # each time the same folder
            rows = {r["cell"]["run"]: r for r in precision.parts_of_error(results, "box", "")}
            np.testing.assert_equal([rows[run]["step_error"] for run in ("lemke", "loose", "law")], [step, 1e-3, 1e-3])
            self.assertEqual([rows[run]["model"] for run in ("lemke", "loose")], [ahead - 1, 0])

    def test_where_nothing_is_left_no_part_dominates_and_where_nothing_is_known_none_is_named(self):
        results = self.results(row("law", 1e-13, **COULOMB), row("alone", 7e-3, step="0.1", **NEWTON),
                               row("free", 1e-3, step="", knobs="accuracy=1e-6", **COULOMB), motions={"law": {0: 0}})
        rows = {r["cell"]["run"]: r for r in precision.budget(results, "box", "")}
        self.assertEqual({run: r["dominates"] for run, r in rows.items()}, {"law": "none", "alone": ""})


class Orders(Results):
    def orders(self, errors, reference=ERROR, **more):
        rows = [
            made.row(run=f"{step}", sweeps="orders", step=step, knobs=f"step={step}", **{reference: e}, **more)
            for step, e in errors.items()]
        return precision.orders(self.results(*rows))

    def test_an_order_has_its_halvings_from_the_coarse_step_to_the_fine_one(self):
        # Halved by 2^1.2, 2^1, 2^0.8, in another order in the table; the line through four points: 1.0.
        errors = {"5e-3": 2**-1.2, "1.25e-3": 2**-3.0, "1e-2": 1.0, "2.5e-3": 2**-2.2}
        found, = self.orders(errors, **made.EPS)
        self.assertEqual(found["steps"], [1e-2, 5e-3, 2.5e-3, 1.25e-3])
        np.testing.assert_allclose(found["errors"], [1, 2**-1.2, 2**-2.2, 2**-3])
        np.testing.assert_allclose(found["halvings"], [1.2, 1.0, 0.8])
        # Least squares over x = 0 ... 3 of 0, 1.2, 2.2, 3: (1.5 * 3 + 0.5 * (2.2 - 1.2)) / 5.
        self.assertAlmostEqual(found["order"], 1.0)
        self.assertEqual([c["run"] for c in found["cells"]], ["1e-2", "5e-3", "2.5e-3", "1.25e-3"])
        self.assertEqual((found["method"], found["against"]), ("convex, epsilon 1e-12 J", "the exact answer"))
        ragged, = self.orders(errors | {"1.25e-3": 2**-2.89}, **made.EPS)  # the last halving 0.69, 0.51 less than the first
        self.assertIsNone(ragged["order"])
        self.assertEqual(self.orders({"1e-2": 1, "5e-3": 0.5}), [])
        # Of two halvings no order is claimed, and of errors of which one is rounding no halving is said.
        few, = self.orders({"1e-2": 1, "5e-3": 0.5, "2.5e-3": 0.25}, **made.EPS)
        np.testing.assert_allclose(few["halvings"], [1, 1])
        self.assertIsNone(few["order"])
        exact, = self.orders({"1e-2": 1e-3, "5e-3": 5e-4, "2.5e-3": 2.5e-4, "1.25e-3": 1e-13}, **made.EPS)
        self.assertEqual((exact["halvings"], exact["order"]), ([], None))

    def test_errors_of_a_polygon_stand_against_the_cone_and_against_its_own_answer(self):
        steps = ("8e-3", "4e-3", "2e-3", "1e-3")
        rows = [
            made.row(run=f"{k}{h}", sweeps="orders", step=h, knobs=f"step={h}", k=k, **{
                ERROR: int(k) * float(h), "error_polygon_position_linf_m": float(h)**2}) for k in ("4", "16") for h in steps]
        rows += [
            made.row(run=f"c{h}", scene="robot", sweeps="orders", step=h, knobs=f"step={h}", error_certified_linf_m=float(h),
                     **made.EPS) for h in steps]
        rows += [
            made.row(run=f"x{h}", scene="robot", sweeps="orders", step=h, knobs=f"step={h}",
                     error_certified_linf_m="" if h == "1e-3" else 1) for h in steps]
        found = precision.orders(self.results(*rows))
        self.assertEqual([(r["scene"], r["method"], r["against"], r["errors"][0], round(r["order"], 9)) for r in found],
                         [("box", "A-P Lemke, k = 4", "the exact answer", 0.032, 1),
                          ("box", "A-P Lemke, k = 4", "the polygon's exact answer", 6.4e-5, 2),
                          ("box", "A-P Lemke, k = 16", "the exact answer", 0.128, 1),
                          ("box", "A-P Lemke, k = 16", "the polygon's exact answer", 6.4e-5, 2),
                          ("robot", "convex, epsilon 1e-12 J", "the certified reference", 8e-3, 1)])

    def test_the_loss_of_a_polygon_is_fitted_from_eight_edges_on_above_the_step_s_share(self):
        def loss(k):
            return 1 - math.cos(math.pi / k)

        def rows(angle, error, own=1e-9, ks=(64, 16, 4, 8, 32)):
            return [
                made.row(run=f"{angle} {k}", sweeps="polygons", k=k,
                         parameters="mu=0.5" + (f" rotate_cone={angle(k)!r}" if angle(k) else ""), **{
                             ERROR: error(k), "error_polygon_position_linf_m": own}) for k in ks]

        # The square errs by something else; where the step errs by a third of it, the error is none of the polygon's.
        some = rows(lambda k: 0, lambda k: 100.0 if k == 4 else 3 * loss(k)**1.5)
        some += rows(lambda k: math.pi / k, lambda k: 2 * loss(k), 2 * loss(64) / 2.9) + rows(
            lambda k: math.pi / (2 * k), loss, 1.0)
        some += rows(lambda k: 0.25, loss, ks=(8, 16)) + [made.row(run="pgs", sweeps="polygons", solver="pgs", **{ERROR: 1})]
        found = {r["turned"]: r for r in precision.polygons(self.results(*some))}
        self.assertEqual(list(found), ["an edge's corner on the axes", "turned by pi/k", "turned by pi/2k", "turned by 0.25"])
        straight, worst = found["an edge's corner on the axes"], found["turned by pi/k"]
        self.assertEqual((straight["k"], straight["parameters"], straight["errors"][0]), ([4, 8, 16, 32, 64], "mu=0.5", 100))
        np.testing.assert_allclose(straight["loss"][:2], [1 - 0.5**0.5, 1 - math.cos(math.pi / 8)])
        self.assertAlmostEqual(straight["slope"], 1.5)
        self.assertAlmostEqual(worst["slope"], 1.0)
        self.assertEqual(set(worst["step_errors"]), {2 * loss(64) / 2.9})
        self.assertEqual([found[turned]["slope"] for turned in ("turned by pi/2k", "turned by 0.25")], [None, None])
        # One of three that is below three times the step's share leaves too few.
        few = precision.polygons(self.results(*rows(lambda k: 0, loss, loss(32) / 2.9, (8, 16, 32))))
        self.assertIsNone(few[0]["slope"])
        (orders, table), _ = made.page("convergence", sections.convergence(self.results(*some)).shown)
        self.assertEqual(len(orders), 1)
        self.assertEqual(table[2], [
            "box mu=0.5", "turned by pi/k", "4, 8, 16, 32, 64", "0.293, 0.0761, 0.0192, 0.00482, 0.0012",
            "0.586, 0.152, 0.0384, 0.00963, 0.00241", ", ".join(["0.000831"] * 5), "1.000"])


class Fits(unittest.TestCase):
    def test_three_points_have_their_circle_and_four_the_one_in_their_middle(self):
        # About (1, 2): 3, 4 and 5 are a right triangle.
        np.testing.assert_allclose(precision.circle([(4, 6), (-3, 5), (6, 2)]), (5, 0), atol=1e-7)
        # Two at 2 m from the middle and two at 3 m: algebraic least squares take the mean of the squares.
        radius, deviation = precision.circle([(3, 2), (-1, 2), (1, 5), (1, -1)])
        self.assertAlmostEqual(radius, math.sqrt((4 + 9) / 2))
        self.assertAlmostEqual(deviation, math.sqrt(((radius - 2)**2 + (3 - radius)**2) / 2) / radius)
        self.assertAlmostEqual(precision.slope([1, 2, 4, 8], [1, 3, 9, 27]), math.log(3) / math.log(2))


class Profiles(Results):
    def test_a_problem_is_a_scene_with_its_knobs_at_one_setting_a_method_and_all_errors_count_for_the_least(self):
        def some(knobs, **of):
            return [
                row(f"{name}{knobs}", e, knobs=knobs, processing_s=s, **METHODS[name] | {"status": status})
                for name, (e, s, status) in of.items()]

        METHODS = {
            "lemke": {}, "other_k": {"k": "4"}, "convex": made.EPS, "early": made.EPS | {"epsilon": "1e-6"}, "newton": NEWTON}
        rows = some("step=1", lemke=(1.9e-3, 3, "ok"), convex=(2.1e-3, 2, "ok"), newton=(1e-3, 1, "inaccurate"),
                    other_k=(1, 0.1, "ok"), early=(1, 0.1, "ok"))
        rows += some("step=2", lemke=(0.9e-9, 8, "ok"), convex=(0.0, 2, "ok"), newton=(1.1e-9, 4, "ok"))
        rows += [row("free", 1, knobs="accuracy=1", step="")]
        results = self.results(*rows)
        self.assertEqual({name: sorted(of) for name, of in precision.contenders(results).items()}, {
            name: [("box", "", "step=1"), ("box", "", "step=2")]
            for name in ("A-P Lemke", "convex, epsilon 1e-12 J", "Newton uncapped")})
        ended, right = precision.profiles(results)
        inf = math.inf
        self.assertEqual(ended, {"A-P Lemke": [1.5, 4], "convex, epsilon 1e-12 J": [1, 1], "Newton uncapped": [2, inf]})
        self.assertEqual(right, {"A-P Lemke": [1, 4], "convex, epsilon 1e-12 J": [1, inf], "Newton uncapped": [inf, inf]})

    def test_claims_are_counted_over_every_run_of_every_sweep(self):
        rows = [
            made.row(repeat=n, sweeps=sweeps, status=status, solves=solves, false_claims=claims, processing_s=1)
            for n, (sweeps, status, solves, claims) in enumerate((("paper", "ok", 100, 1), ("orders", "inaccurate", 20, 7),
                                                                  ("", "ray", "", "")), 1)]
        rows += [made.row(k="4", solves=1000, false_claims=2), made.row(solves="", false_claims="", **NEWTON)]
        results = self.results(*rows)
        truth = {"runs": 4, "ok": 2, "inaccurate": 1, "solves": 1120, "false_claims": 10}
        none = {"runs": 1, "ok": 1, "inaccurate": 0, "solves": 0, "false_claims": 0}
        self.assertEqual(precision.truthfulness(results), {"A-P Lemke": truth, "Newton uncapped": none})
        section = sections.performance(results)
        self.assertEqual((section.data["truth"], section.timing["truth"]), ({"A-P Lemke": truth, "Newton uncapped": none}, {}))
        (table, ), _ = made.page("performance", section.shown)
        self.assertEqual(table[1:], [["A-P Lemke", "4", "2 (50.0 %)", "1", "1120", "10", "99.1071 %"],
                                     ["Newton uncapped", "1", "1 (100.0 %)", "0", "0", "0", ""]])
        # How far a run that a limit cut comes is the machine's, and so is the number of its solves.
        results.table.loc[results.table["status"] == "ray", "status"] = "memory_limit"
        section = sections.performance(results.seen(results.table))
        self.assertEqual((section.data["truth"], len(section.timing["truth"])), ({}, 2))


class Stepping(Results):
    def test_what_was_wanted_stands_beside_what_was_reached_of_the_law_that_the_method_solves(self):
        def some(run, accuracy, error, own="", order="", **more):
            knobs = (f"accuracy={accuracy}" if accuracy else "step=1e-3") + (f" order={order}" if order else "")
            return made.row(run=run, sweeps="stepping", knobs=knobs, step="",
                            **{ERROR: error, "error_polygon_position_linf_m": own} | more)

        took = {"estimated_error_m": 3e-7, "solves": 11, "switches": 12, "impacts": 13, "first_order_steps": 14}
        rows = [
            some("polygon", "1e-6", 0.5, 4e-6, **took),
            some("cone", "1e-4", 2e-5, 0.5, solves="", **made.EPS),
            some("open", "1e-3", 2e-3, k="4"),
            some("ray", "1e-5", 1e-5, k="16", status="ray", finished="false"),
            some("chosen", "1e-6", 1, order=4),
            some("events", "", 1)]
        results = self.results(*rows)
        found = stepping.wanted(results)
        self.assertEqual([r["run"] for r in found], ["polygon", "cone", "open", "ray"])
        first = dict(found[0])
        self.assertAlmostEqual(first.pop("ratio"), 4)
        self.assertEqual(
            first, {
                "scene": "box", "parameters": "", "method": "A-P Lemke, k = 8", "wanted": 1e-6, "status": "ok", "reached": 4e-6,
                "estimated": 3e-7, "run": "polygon", "solves": 11, "switches": 12, "impacts": 13, "first_order_steps": 14})
        self.assertEqual([(r["reached"], r["status"], r["solves"], r["switches"]) for r in found[1:]], [(2e-5, "ok", 0, 0),
                                                                                                        (2e-3, "ok", 10, 0),
                                                                                                        (None, "ray", 10, 0)])
        (table, cost), _ = made.page("ways_of_stepping", sections.ways_of_stepping(results).shown)
        self.assertEqual(table[1], ["box", "A-P Lemke, k = 8", "1e-06", "4e-06", "4", "3e-07", "11", "12", "13", "14"])
        self.assertEqual(table[4][:5], ["box", "A-P Lemke, k = 16", "1e-05", "ray", ""])
        self.assertEqual(len(cost), 1)

    def test_an_order_s_cost_is_of_the_circle_alone_and_events_are_order_one(self):
        def some(solves, error, knobs, **more):
            of = {"scene": "circular_sliding", "sweeps": "stepping", "knobs": knobs, "solves": solves, ERROR: error}
            return made.row(run=f"{knobs} {solves}", **of | more)

        rows = [some(n, 10 / n, f"step={1 / n}")
                for n in (1000, 500, 100)] + [some(n, 1e4 / n**3, f"accuracy={n} order=3") for n in (100, 1000)]
        rows += [
            some(7, 1e-13, "accuracy=1e-13 order=3"),
            some(9, 1, "accuracy=1 order=2"),
            some(1000, 1e-9, "accuracy=1e-3 order=5"),
            some(1003, 9.99999e-10, "accuracy=1e-5 order=5"),
            some(100, 1e-8, "accuracy=1e-3 order=4"),
            some(100, 1e-9, "accuracy=1e-5 order=4"),
            some(1000, 1e-9, "accuracy=1e-3 order=6"),
            some(3000, 9.99999e-10, "accuracy=1e-5 order=6"),
            some(5, 1, "accuracy=1"),
            some(8, 1, "accuracy=5 order=3", finished="false", status="ray"),
            some(6, 1, "step=1e-6", scene="box")]
        results = self.results(*rows)
        found = stepping.cost(results)
        self.assertEqual([(r["order"], r["solves"]) for r in found], [(1, [100, 500, 1000]), (3, [100, 1000])])
        for r, errors in zip(found, ([0.1, 0.02, 0.01], [1e-2, 1e-5])):
            np.testing.assert_allclose(r["errors"], errors)
        np.testing.assert_allclose([r["slope"] for r in found], [1, 3])
        # 10 / n = 1e-6, and 1e4 / n^3 = 1e-6.
        np.testing.assert_allclose([r["solves_for_1e-6_m"] for r in found], [1e7, 1e10**(1 / 3)])
        (_, table), _ = made.page("ways_of_stepping", sections.ways_of_stepping(results).shown)
        self.assertEqual(table, [["order", "solves", "errors, m", "slope", "solves for 1e-6 m"],
                                 ["1", "100, 500, 1000", "0.1, 0.02, 0.01", "1.00", "1e+07"],
                                 ["3", "100, 1000", "0.01, 1e-05", "3.00", "2.15e+03"]])

    def test_steps_are_drawn_over_time_with_switches_and_impacts_marked(self):
        rows = [
            made.row(run=f"{name}", scene="circular_sliding", parameters="mu=0.1", sweeps="stepping", knobs=knobs, **of)
            for name, knobs, of in (("drawn", "accuracy=1e-6", made.EPS), ("other", "accuracy=1e-4", made.EPS),
                                    ("third", "accuracy=1e-6 order=2", made.EPS), ("ap", "accuracy=1e-6", {}))]
        results = self.results(*rows)
        cells = stepping.drawn(results)
        self.assertEqual([c["run"] for c in cells], ["drawn"])
        steps = [(1, 0.5, "macro", 0, 0.5, 9), (2, 0.75, "switch", 0, 0.25, 9), (3, 0.875, "first_order", 1, 0.125, 9),
                 (4, 1.5, "macro", 1, 0.625, 9)]
        made.write_files(results.runs / "drawn", {"stepping.csv": made.csv_of("step,t,kind,impact,length,more", steps)})
        figure, axes = stepping.canvas(cells)
        handles = stepping.steps_taken(cells, axes)
        panel = axes.flat[0]
        drawn = {line.get_marker(): line.get_xydata().tolist() for line in panel.lines}
        self.assertEqual(
            drawn,
            {".": [[0.5, 0.5], [1.5, 0.625]], "x": [[0.75, 0.25]], "+": [[0.875, 0.125]], "v": [[0.875, 0.125], [1.5, 0.625]]})
        self.assertEqual(
            (panel.get_yscale(), panel.get_xscale(), panel.get_xlabel(), panel.get_ylabel(), panel.get_title(loc="left")),
            ("log", "linear", "time (s)", "step (s)", "circular sliding mu=0.1"))
        self.assertEqual([(h.get_label(), h.get_marker()) for h in handles], [("macro step", "."), ("switch", "x"),
                                                                              ("first order (switches pile up)", "+"),
                                                                              ("after an impact", "v")])
        self.assertFalse(axes.flat[1].axison)
        plt.close(figure)
        figure, axes = stepping.canvas(cells * 3)
        self.assertEqual(axes.shape, (2, 2))
        plt.close(figure)


if __name__ == "__main__":
    unittest.main()
