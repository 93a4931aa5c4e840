"""scripts/contactbench/found.py: what was found, in ten lines; each on made-up tables of which every number can be told."""
import math
import types
import unittest
from unittest import mock

import made
from contactbench import claims
from contactbench import found as found_out
from folder import Folder

NEWTON, MIRTICH = {"method": "newton", "solver": "", "variant": "uncapped"}, {"method": "mirtich", "solver": ""}
LEMKE, CONVEX = {"k": "8"}, made.EPS


class Lines(Folder):
    def results(self, *rows):
        """A table of runs, each finished and ok in one second of one simulated where nothing else is said."""
        usual = {"scene": "stack", "duration": "1", "solves": "0", "reference": "analytic"}
        return made.results(self.top, [usual | row for row in rows])

    def test_runs_and_claims_are_counted_over_all_sweeps_and_repeats(self):
        results = self.results(
            LEMKE | {"solves": "20", "false_claims": "3"}, LEMKE | {"solves": "30", "repeat": "2", "status": "inaccurate"},
            NEWTON | {"sweeps": "orders", "solves": "", "false_claims": ""},
            CONVEX | {"sweeps": "orders", "solves": "7", "false_claims": "1", "status": "ray", "finished": "false"})
        self.assertEqual(found_out.how_many(results),
                         ("2 of 4 runs ended ok. Of the answers to 57 contact problems in them that their solver called right, "
                          "the referee refuted 4.", "performance"))

    def test_claims_are_counted_by_grade_and_parts_by_verdict(self):
        answers = {
            f"C{n}": types.SimpleNamespace(grade=grade, parts=[types.SimpleNamespace(verdict=v) for v in verdicts])
            for n, (grade, verdicts) in enumerate(((claims.YES, [claims.YES] * 3), (claims.YES, [claims.YES]), (claims.YES,
                                                                                                                [claims.YES]),
                                                   ("in part", [claims.YES, claims.NO]), ("in part", [claims.NO, claims.YES]),
                                                   ("contradicted", [claims.NO]), (claims.UNKNOWN, [claims.UNKNOWN])))}
        with mock.patch.object(claims, "ALL", answers), mock.patch.object(claims, "asked", lambda name, _: answers[name]):
            said, section = found_out.of_the_paper(None)
        self.assertEqual(said, "Of the paper's 7 claims 3 are reproduced whole, 2 in part, 1 not at all; of their 11 parts 7.")
        self.assertEqual(section, "claim_table")

    def test_the_cheapest_method_is_counted_over_scenes_and_wanted_errors(self):
        def timed(scene, method, error, seconds):
            return method | {"sweeps": "error_time", "scene": scene, "error_position_linf_m": error, "processing_s": seconds}

        # Of a the cheapest by error is Newton, A-P, convex; of b A-P twice, and none comes to 1e-6 m.
        results = self.results(timed("a", NEWTON, "5e-3", "1"), timed("a", LEMKE, "5e-5", "2"), timed("a", CONVEX, "5e-7", "3"),
                               timed("b", NEWTON, "5e-3", "1"), timed("b", LEMKE, "5e-5", "0.5"))
        said, section = found_out.which_method(results)
        self.assertEqual(
            said, "Asked for 1e-2, 1e-4 and 1e-6 m on 2 scenes, a setting of the sweep answers in 5 of 6 cases; the cheapest is "
            "A-P Lemke in 3, Newton uncapped in 1, convex in 1.")
        self.assertEqual(section, "advice")
        self.assertIsNone(found_out.which_method(self.results(timed("a", NEWTON, "0.5", "1"))))

    def test_one_contact_after_another_is_off_at_the_finest_step_by_what_it_is_off(self):
        def slides(method, step, error, scene="sliding_box"):
            return method | {
                "sweeps": "error_time", "scene": scene, "step": step, "knobs": f"step={step}", "error_position_linf_m": error}

        rows = [
            slides(NEWTON, "0.001", "0.25"),
            slides(NEWTON, "0.01", "0.5"),
            slides(MIRTICH, "0.01", "0.75"),
            slides(MIRTICH, "0.001", "0.13"),
            slides(LEMKE, "0.01", "0.004"),
            slides(CONVEX, "0.01", "0.003"),
            slides(CONVEX, "0.001", "0.006"),
            slides(CONVEX, "0.001", "1e-9", "other")]
        said, section = found_out.one_at_a_time(self.results(*rows))
        self.assertEqual(
            said, "Contacts one after the other are another model: a sliding box ends 0.25 m off with Newton uncapped, "
            "0.13 m off with Mirtich at the finest step, and 0.003 m with what solves them together.")
        self.assertEqual(section, "error_time")
        self.assertIsNone(found_out.one_at_a_time(self.results(*rows[:4])))
        self.assertIsNone(found_out.one_at_a_time(self.results(*rows[4:])))

    def test_a_polygon_costs_what_it_costs_where_it_is_turned(self):
        def turned(k, error, share=1.0, **more):
            return LEMKE | {
                "sweeps": "polygons", "scene": "round_way", "k": str(k), "error_position_linf_m": error,
                "parameters": f"mu=0.3 rotate_cone={share * math.pi / k!r}"} | more

        def cone(error, parameters="mu=0.3", **more):
            return CONVEX | {
                "sweeps": "error_time", "scene": "round_way", "parameters": parameters, "error_position_linf_m": error} | more

        rows = [turned(8, "0.9", 0.5), turned(16, "0.02"), turned(4, "0.5"), turned(64, "0.001")]
        said = "A friction polygon costs accuracy where bodies slide across its edges: round way, turned by pi/k, " \
               "errs by 0.5 m with 4 edges " \
               "and 0.001 m with 64"
        self.assertEqual(found_out.polygon(self.results(*rows)), (said + ".", "convergence"))
        rows += [
            cone("2e-4", knobs="step=1"),
            cone("3e-5"),
            cone("1e-9", "mu=0.4"),
            cone("1e-9", knobs="step=2", status="inaccurate"),
            LEMKE | {"sweeps": "error_time", "scene": "round_way", "parameters": "mu=0.3", "error_position_linf_m": "1e-7"}]
        self.assertEqual(found_out.polygon(self.results(*rows))[0], said + "; the least error with a cone is 3e-05 m.")
        self.assertIsNone(found_out.polygon(self.results(*rows[:1])))

    def test_a_stack_of_sixteen_is_named_by_its_cost_the_cheapest_first(self):
        boxes = {"parameters": "boxes=16", "duration": "4"}
        rows = [
            LEMKE | boxes | {"processing_s": "10"}, NEWTON | boxes | {"processing_s": "2"},
            CONVEX | boxes | {"processing_s": "3"}, CONVEX | boxes | {"epsilon": "1e-2", "processing_s": "1"},
            LEMKE | {"parameters": "boxes=8", "processing_s": "7"}, NEWTON | boxes | {"knobs": "step=1", "processing_s": "5"},
            MIRTICH | boxes | {"finished": "false", "status": "ray", "t_reached": "0.25"}]
        said, section = found_out.growth(self.results(*rows))
        self.assertEqual(
            said, "A stack of 16 boxes costs, a simulated second: Newton uncapped 0.5 s, convex, epsilon 1e-12 J 0.75 s, "
            "A-P Lemke 2.5 s. Not to the end: Mirtich (ray at 0.25 s).")
        self.assertEqual(section, "table_one")
        self.assertIsNone(found_out.growth(self.results(rows[4])))

    def test_who_drives_and_who_holds_is_named_and_why_others_do_not(self):
        drives = {"scene": "mobile_robot", "error_no_slip_cross_track_rms_m": "0.1"}
        rows = [
            LEMKE | drives | {"error_cross_track_rms_m": "0.15"}, NEWTON | drives | {"error_cross_track_rms_m": "0.9"},
            MIRTICH | drives | {"finished": "false", "status": "cycling", "t_reached": "7"},
            CONVEX | drives | {"epsilon": "1e-2", "error_cross_track_rms_m": "0.1"},
            # Neither at another step nor with other parameters.
            *(LEMKE | drives | {"error_cross_track_rms_m": "0.9"} | of for of in ({"knobs": "step=5e-5"}, {"parameters": "mu=1"}))]
        self.assertEqual(found_out.robot(self.results(*rows)),
                         ("The figure eight at the paper's step is driven by A-P Lemke; not by Newton uncapped (off its path), "
                          "Mirtich (cycling at 7 s).", "C6"))
        self.assertIn("driven by nobody; not by Newton", found_out.robot(self.results(rows[1]))[0])
        self.assertIsNone(found_out.robot(self.results(rows[3])))
        held = {"scene": "grasp"}
        rows = [
            LEMKE | held | {"error_creep_linf_m": "0.004"}, NEWTON | held | {"error_creep_linf_m": "0.02"},
            MIRTICH | held | {"error_creep_linf_m": "0.003", "error_dropped_s": "1.5"},
            LEMKE | held | {"solver": "path", "finished": "false", "status": "ray", "t_reached": "0.3"},
            CONVEX | held | {"epsilon": "1e-2", "error_creep_linf_m": "9"},
            *(LEMKE | held | {"error_creep_linf_m": "9"} | of for of in ({"knobs": "step=5e-5"}, {"parameters": "mu=1"}))]
        self.assertEqual(
            found_out.grasp(self.results(*rows)),
            ("The grasped box is held by A-P Lemke; not by Newton uncapped (creeps 0.02 m), Mirtich (dropped at 1.5 s), "
             "A-P PATH (ray at 0.3 s).", "C7"))
        self.assertEqual(found_out.grasp(self.results(rows[0]))[0], "The grasped box is held by A-P Lemke.")
        self.assertIsNone(found_out.grasp(self.results(rows[4])))

    def test_stiff_cases_are_counted_by_verdict(self):
        results = self.results({})
        self.assertIsNone(found_out.hard(results))
        verdicts = ["right"] * 7 + ["model"] * 6 + ["typed"] * 5 + ["engine"] * 4 + ["wrong", "silent", "defect"]
        (self.top / "stress").mkdir()
        (self.top / "stress/stress.csv").write_text("verdict\n" + "\n".join(verdicts) + "\n")
        self.assertEqual(found_out.hard(results), (
            "Of 25 stiff and extreme cases by method 7 are right, 6 are what the method's model says, 5 end with a typed status, "
            "4 are engines that are off, 3 are wrong, silent or a defect.", "stiff_cases"))

    def test_solvers_of_stored_problems_are_those_that_solve_all_and_the_one_that_solves_the_smallest_share(self):
        results = self.results({})
        self.assertIsNone(found_out.stored(results))
        rows = ["kind,method,solver,variant,k,compression_bound,status,false_claim,busy,residual,law_residual,time_median_s"]
        of = {
            "a": "ok ok", "b": "ok ok", "c": "ok ray", "d": "ok ok ok ray", "e": "ray ok ray", "f": "ok ok",
            "g": "unavailable unavailable"} | dict.fromkeys("hijk", "ok")
        rows += [f"contact,m,{name},,,,{status},,,,," for name, ends in of.items() for status in ends.split()]
        rows += ["lcp,,z,,,,ray,,,,,"]
        (self.top / "solve_all").mkdir()
        (self.top / "solve_all/solve_all.csv").write_text("\n".join(rows) + "\n")
        self.assertEqual(
            found_out.stored(results),
            ("Of the stored contact problems 7 of 10 solvers solve all: m a, m b, m f, m h, m i, m j; fewest by m e (1 of 3).",
             "stored_problems"))

    def test_of_other_scenes_it_is_said_how_many_settings_end_and_what_an_event_gains(self):
        mine = {"sweeps": "error_time", "scene": "my", "parameters": "mu=1"}
        results = self.results(NEWTON | mine | {"max_gain_relative": "0.03"}, LEMKE | mine | {"max_gain_relative": "1e-4"},
                               CONVEX | mine | {"finished": "false", "max_gain_relative": "0.5"},
                               LEMKE | {"scene": "her", "max_gain_relative": "0.5e-9"},
                               NEWTON | {"scene": "her", "max_gain_relative": ""})
        self.assertEqual(found_out.apart(results),
                         ("my mu=1: 2 of 3 settings came to the end, an event gains up to 0.03 of the energy; "
                          "her: 2 of 2 settings came to the end.", "differences"))

    def test_lines_of_which_nothing_is_there_are_left_out(self):
        measured = LEMKE | {"scene": "way", "sweeps": "error_time", "error_position_linf_m": "1e-3"}
        results = self.results(LEMKE | {"scene": "grasp", "error_creep_linf_m": "0.001"}, measured)
        for of_paper, sections in ((False, ["performance", "differences", "advice"]), (True, [
                "performance", "advice", "claim_table", "C7"])):
            self.assertEqual([section for _, section in found_out.lines(results, of_paper)], sections)

    def test_a_number_that_is_not_there_is_a_question_mark(self):
        self.assertEqual([found_out.some(x) for x in (None, math.nan, 0.00256)], ["?", "?", "0.0026"])


if __name__ == "__main__":
    unittest.main()
