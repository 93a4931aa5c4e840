"""What scripts/contactbench/measures.py makes of the files of a run: how far it is from what its case expects, held
against ways added up step after step. A run is off by another length along each axis, so that a number of the wrong
place shows."""
import math
import unittest

from contactbench import measures
from folder import Folder

G = 9.8
OFF = (3e-3, 4e-3, 12e-3)  # m along x, y, z: 13e-3 m altogether


def motion(acceleration, steps, h, speed=0.0):
    """Way of so many explicit Euler steps under `acceleration` of the step (velocities first); what slows stops."""
    x, v = 0.0, speed
    for n in range(steps):
        v += acceleration(n) * h if callable(acceleration) else acceleration * h
        v = max(v, 0.0)
        x += v * h
    return x


class Files(Folder):
    def run_of(self, bodies, h=0.01, summary=None, **parameters):
        """A run whose trajectory.csv holds {body: rows of t, p and what follows}."""
        lines = ["t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"]
        lines += [",".join([repr(row[0]), body, *map(repr, row[1:])]) for body, rows in bodies.items() for row in rows]
        (self.top / "trajectory.csv").write_text("\n".join(lines) + "\n")
        return measures.Run({"parameters": parameters, "options": {"step": h}, **(summary or {})}, self.top)

    def moved(self, way, steps, h=0.01, body="box", others=None, **parameters):
        """A run of a body from a place that is not the origin by `way`, and of others by theirs."""
        start = (1.0, -2.0, 5.0)
        bodies = {
            name: [[0.0, *start], [steps * h, *(a + b for a, b in zip(start, along))]]
            for name, along in {body: way, **(others or {})}.items()}
        return self.run_of(bodies, h, **parameters)


class Runs(Files):
    def test_a_run_is_read_by_body_from_its_start_to_its_end(self):
        run = self.run_of({"a": [[0.0, 1, 2, 4], [0.3, 7, 7, 7], [0.6, 2, 5, 9]], "b": [[0.0, 0, 0, 0], [0.6, 0, 0, 0.5]]}, h=0.2)
        self.assertEqual((run.start("a"), run.end("a"), run.moved("a")), ([1, 2, 4], [2, 5, 9], [1, 3, 5]))
        self.assertEqual((run.moved("b"), run.steps(), run.h), ([0, 0, 0.5], 3, 0.2))

    def test_a_run_without_a_step_has_so_many_that_none_shows(self):
        run = self.run_of({"a": [[0.0, 0, 0, 0], [0.25, 0, 0, 0]], "b": [[0.0, 0, 0, 0], [0.5, 0, 0, 0]]}, h=None)
        self.assertEqual(run.h, 0.5e-9)

    def test_a_number_that_is_none_is_seen_in_any_body_and_column(self):
        fine, late = [0.0] * 14, [0.5] + [0.0] * 13
        self.assertFalse(self.run_of({"a": [fine, late], "b": [fine, late]}).has_nan())
        for body, column, value in (("a", 1, math.nan), ("b", 13, math.nan), ("b", 8, math.inf), ("a", 4, -math.inf)):
            rows = {"a": [fine, list(late)], "b": [fine, list(late)]}
            rows[body][1][column] = value
            self.assertTrue(self.run_of(rows).has_nan(), (body, column))

    def test_a_run_that_left_no_file_has_no_bodies(self):
        run = measures.Run({"parameters": {}, "options": {"step": 0.1}}, self.top / "none")
        self.assertEqual((run.bodies, run.has_nan()), ({}, False))
        (self.top / "trajectory.csv").write_text("")
        self.assertEqual(measures.Run({"parameters": {}, "options": {"step": 0.1}}, self.top).bodies, {})


class Measures(Files):
    def test_a_displacement_is_the_largest_of_any_body_at_any_time(self):
        there_and_back = [[0.0, 1, 1, 1], [0.1, 4, 5, 13], [0.2, 1, 1, 1]]
        for bodies in ({"a": there_and_back, "b": [[0.0, 0, 0, 0], [0.2, 5, 0, 0]]}, {
                "b": [[0.0, 0, 0, 0], [0.2, 5, 0, 0]], "c": there_and_back}):
            self.assertEqual(measures.displacement(self.run_of(bodies), {})[0], 13)

    def test_what_oscillates_stays_within_ten_times_its_first_amplitude(self):
        run = self.run_of({"second": [[0.0, 9, 0, 0], [1.0, 9, 0, 0]], "first": [[0.0, 0.02, 5, 5], [1.0, 0.12, 5, 5]]})
        self.assertAlmostEqual(measures.bounded(run, {})[0], 0.1 / 0.2, delta=1e-12)

    def test_energy_rises_by_what_is_there_over_what_was_there_at_first(self):
        run = self.run_of({})
        self.assertIsNone(measures.total_rise(run))
        # Altogether 11, 12, 10: kinetic energy falls all the while, and potential energy alone rises by more.
        (self.top / "steps.csv").write_text("t,potential_energy,kinetic_energy\n0,1,10\n1,7,5\n2,9,1\n")
        self.assertEqual(measures.total_rise(run), 1)
        for gain, error in ((-0.5, 0), (0.25, 0.25), (None, 0)):
            run.summary = {"energy": {"max_gain_relative": gain}}
            self.assertEqual(measures.event_gain(run, {}), (error, "total energy rises by 1 J"))
        (self.top / "steps.csv").write_text("t,potential_energy,kinetic_energy\n")
        self.assertIsNone(measures.total_rise(run))

    def test_what_slides_is_off_by_its_distance_from_the_way_of_the_steps(self):
        case = {"arguments": {"body": "box", "v": "vx", "mu": 0.3}}
        for steps in (8, 60):  # still on its way, and at rest since the 18th
            x = motion(-0.3 * G, steps, 0.01, 0.5)
            self.assertAlmostEqual(measures.slides(self.moved((x, 0, 0), steps, vx=0.5), case)[0], 0, delta=1e-14)
            off = [x + OFF[0], *OFF[1:]]
            self.assertAlmostEqual(measures.slides(self.moved(off, steps, vx=0.5), case)[0], 13e-3, delta=1e-14)

    def test_a_ball_that_rolls_off_its_line_is_off_by_that_too(self):
        # Without friction it slides on.
        case = {"arguments": {"body": "ball", "v": "vx"}}
        off = [0.5 * 0.1 + OFF[0], *OFF[1:]]
        self.assertAlmostEqual(measures.rolls(self.moved(off, 10, body="ball", vx=0.5, mu=0.0), case)[0], 13e-3, delta=1e-14)

    def test_a_ball_in_a_groove_is_off_by_its_way_or_by_leaving_the_line(self):
        n, h, slope, half = 20, 0.01, 0.3, math.pi / 6
        x = motion(0.25 / 0.65 * G * math.sin(slope), n, h)
        for off, error in (((0, 0, 2e-3), 2e-3), ((3e-3, 4e-3, 2e-3), 5e-3)):
            run = self.moved((off[0], off[1], x + off[2]), n, h, "ball", half_angle=half, slope=slope, mu=0.9)
            self.assertAlmostEqual(measures.groove(run, {})[0], error, delta=1e-14)

    def test_a_ball_rolls_in_a_groove_where_friction_is_enough_and_where_squeeze_may_help(self):
        # At 30 degrees and a slope of 1 it takes mu = T = tan(1) 0.4 * 0.5 / (0.25 + 0.4) to roll, and
        # T sqrt(1 - (mu / tan 30)^2) where the walls squeeze it.
        n, h, slope, half = 20, 0.01, 1.0, math.pi / 6
        enough = math.tan(slope) * 0.2 / 0.65
        squeezed = enough / math.sqrt(1 + enough**2 / math.tan(half)**2)
        rolls = motion(0.25 / 0.65 * G * math.sin(slope), n, h)
        for mu, may_roll, may_slip in ((enough + 1e-6, True, False), (enough - 1e-6, True, True), (squeezed + 1e-6, True, True),
                                       (squeezed - 1e-6, False, True)):
            slips = motion(G * (math.sin(slope) - mu * math.cos(slope) / 0.5), n, h)
            for way, may in ((rolls, may_roll), (slips, may_slip)):
                run = self.moved((0, 0, way), n, h, "ball", half_angle=half, slope=slope, mu=mu)
                self.assertEqual(measures.groove(run, {})[0] < 1e-12, may, (mu, way))

    def test_a_ball_is_pulled_from_a_tenth_of_a_second_on(self):
        y = motion(lambda n: 12 - G if n >= 10 else 0.0, 50, 0.01)
        for off, error in (((0, 0, 0), 0), (OFF, 13e-3)):
            run = self.moved((off[0], y + off[1], off[2]), 50, body="ball", pull=12.0)
            self.assertAlmostEqual(measures.pulled_free(run, {})[0], error, delta=1e-13)

    def test_two_sides_hold_a_box_by_twice_their_friction(self):
        for pull, press, y, said in ((8.0, 10.0, 0.0, "held"), (11.0, 10.0, motion(
                1.0, 30, 0.01), "slides"), (8.0, 3.0, motion(5.0, 30, 0.01), "slides")):
            run = self.moved((0, y, 0), 30, pull=pull, press=press, mu=0.5)
            error, note = measures.squeezed(run, {})
            self.assertAlmostEqual(error, 0, delta=1e-13)
            self.assertEqual(note, said)
            run = self.moved((OFF[0], y + OFF[1], OFF[2]), 30, pull=pull, press=press, mu=0.5)
            self.assertAlmostEqual(measures.squeezed(run, {})[0], 13e-3, delta=1e-13)

    def test_a_cube_is_driven_to_the_wall_and_no_further(self):
        # 0.5 m/s over 20 steps of 10 ms: 0.1 m.
        run = self.moved((0.1 + OFF[0], *OFF[1:]), 20, body="cube", speed=0.5, gap=0.11)
        self.assertAlmostEqual(measures.driven(run, {})[0], 13e-3, delta=1e-14)
        run = self.moved((0.1, 0, 0), 20, body="cube", speed=0.5, gap=0.09)
        self.assertEqual(measures.driven(run, {})[0], math.inf)

    def test_a_box_on_a_ramp_slides_down_along_it_or_sticks(self):
        for mu, said in ((0.2, "slides"), (0.8, "sticks")):
            a = max(0.0, G * (0.5 - mu * math.sqrt(0.75)))  # 30 degrees
            way = motion(a, 40, 0.01)
            down = (way * math.sqrt(0.75), -way * 0.5, 0)
            run = self.moved(down, 40, tilt=math.pi / 6, mu=mu)
            error, note = measures.ramp(run, {})
            self.assertAlmostEqual(error, 0, delta=1e-13)
            self.assertEqual(note, said)
            run = self.moved([d + o for d, o in zip(down, OFF)], 40, tilt=math.pi / 6, mu=mu)
            self.assertAlmostEqual(measures.ramp(run, {})[0], 13e-3, delta=1e-13)

    def test_the_verdict_on_a_ramp_is_the_share_of_the_way_by_which_it_is_wrong(self):
        # What should slide and goes three quarters of the way; what should stick and goes a quarter of it.
        for mu, share, error in ((0.2, 0.75, 0.25), (0.2, 1.0, 0.0), (0.8, 0.25, 0.25), (0.8, 0.0, 0.0)):
            way = share * motion(abs(G * (0.5 - mu * math.sqrt(0.75))), 40, 0.01)
            run = self.moved((way * math.sqrt(0.75), -way * 0.5, 0), 40, tilt=math.pi / 6, mu=mu)
            found, note = measures.ramp_verdict(run, {})
            self.assertAlmostEqual(found, error, delta=1e-12)
            self.assertEqual(note, f"{share:.3g} of the way that it would slide")

    def test_a_pair_that_is_pulled_moves_together(self):
        # 2 kg under 3 N less mu of their weight of 2 g.
        for mu, a in ((0.1, (3 - 0.2 * G) / 2), (0.2, 0.0)):
            x = motion(a, 30, 0.01)
            for lower, upper, error in ((0, 0, 0), (2e-3, 0, 2e-3), (1e-3, -5e-3, 5e-3)):
                run = self.moved((x + lower, 0, 0), 30, body="lower", others={"upper": (x, upper, 0)}, pull=3.0, mu=mu)
                self.assertAlmostEqual(measures.pulled_pair(run, {})[0], error, delta=1e-13)

    def test_a_pushed_box_goes_as_far_in_any_direction(self):
        # 1 N less mu g = 0.98 on 1 kg for 4 s, then friction alone, in steps of 1 ms.
        way = motion(lambda n: 0.02 if n < 4000 else -0.98, 5000, 1e-3)
        for degrees in (0, 30, -75):
            angle = math.radians(degrees)
            along = (math.cos(angle), 0.0, -math.sin(angle))  # about y, from x
            exact = self.moved([way * d for d in along], 9, push_angle=angle)
            error, note = measures.pushed(exact, {})
            self.assertLess(error, 1e-8)
            self.assertIn("1 of the way, turned by ", note)
            turned = angle + math.radians(2)
            run = self.moved((0.5 * way * math.cos(turned), 0, -0.5 * way * math.sin(turned)), 9, push_angle=angle)
            self.assertEqual(measures.pushed(run, {})[1], "0.5 of the way, turned by 2 deg")
            run = self.moved([way * d + o for d, o in zip(along, OFF)], 9, push_angle=angle)
            self.assertAlmostEqual(measures.pushed(run, {})[0], 13e-3, delta=1e-8)

    def test_an_error_of_the_scene_is_in_its_unit_or_in_steps(self):
        run = self.run_of({}, h=0.01, summary={"errors": {"position_linf_m": 0.006, "other_m": 5.0}})
        for arguments, error in (({"error": "position_linf_m"}, 0.006), ({"error": "position_linf_m", "per_step": 0.2}, 3.0)):
            found, note = measures.scene_error(run, {"arguments": arguments})
            self.assertAlmostEqual(found, error, delta=1e-14)
            self.assertEqual(note, "position_linf_m 0.006")
        self.assertEqual(measures.scene_error(run, {"arguments": {"error": "drift_m"}}), (None, "no drift_m"))

    def test_places_are_compared_without_units_and_in_the_frame_that_is_not_turned(self):
        places = {"b": (1.0, 2.0, 4.0), "a": (-3.0, 0.5, 7.0)}
        flat = [*places["a"], *places["b"]]
        for heading, metre in ((0.0, 1.0), (0.3, 1.0), (0.0, 1e3), (2.0, 1e-3)):
            c, s = math.cos(heading), math.sin(heading)
            bodies = {
                name: [[0.0, 0, 0, 0], [0.5, metre * (c * x + s * z), metre * y, metre * (c * z - s * x)]]
                for name, (x, y, z) in places.items()}  # turned about y, as the scene turns
            place, _ = measures.same_as_first(self.run_of(bodies, heading=heading, metre=metre), {})
            for found, wanted in zip(place, flat, strict=True):
                self.assertAlmostEqual(found, wanted, delta=1e-12)

    def test_what_stops_is_off_along_the_way_alone(self):
        run = self.run_of({"ball": [[0.0, 1, 0, 0], [1.0, 0.2, 7, 9]], "wall": [[0.0, 5, 0, 0], [1.0, 5, 0, 0]]})
        self.assertAlmostEqual(measures.stopped(run, {"arguments": {"body": "ball", "x": 0.5}})[0], 0.3, delta=1e-15)

    def test_far_away_one_box_rests_and_one_slides(self):
        x = motion(-0.5 * G, 40, 0.01, 1.2)
        for rest, slider, error in (((0, 0, 0), (0, 0, 0), 0), (OFF, (0, 0, 0), 13e-3), ((0, 1e-3, 0), OFF, 13e-3)):
            run = self.moved((x + slider[0], *slider[1:]), 40, body="slider", others={"rest": rest}, vx=1.2)
            self.assertAlmostEqual(measures.far_away(run, {})[0], error, delta=1e-14)


class Bounces(Files):
    def ball(self, heights, e, gain=0.0):
        rows = [[0.1 * n, 0, y + 0.1, 0] for n, y in enumerate(heights)]  # a ball of radius 0.1
        summary = {"energy": {"max_gain_relative": gain}, "events": 7}
        return measures.bounces(self.run_of({"ball": rows}, summary=summary, e=e), {})

    def test_the_first_peak_counts_in_hundredths_of_the_height(self):
        for peak, error in ((0.5, 0), (0.54, 2), (0.47, 1.5)):
            # Of 2 m with e = 1/2: a quarter. The second bounce is higher, and counts for nothing.
            found, note = self.ball([2, 1, 0.01, 0.3, peak, 0.2, 0.0, 1.0, 0.5], 0.5)
            self.assertAlmostEqual(found, error, delta=1e-12)
            self.assertEqual(note, f"first peak {peak:.4g} of 2 m, 7 events")
        # On its way up when the run ends: as far as it came.
        self.assertAlmostEqual(self.ball([2, 1, 0, 0.2, 0.4], 0.5)[0], 5, delta=1e-12)

    def test_what_never_rises_is_right_where_nothing_bounces(self):
        self.assertEqual(self.ball([2, 1, 0, 0, 0], 0.01), (0, "never rises"))
        self.assertEqual(self.ball([2, 1, 0, 0, 0], 0.03), (math.inf, "never rises"))

    def test_no_event_may_gain_energy(self):
        self.assertEqual(self.ball([2, 1, 0, 0.5, 0.2], 0.5, 2e-12), (math.inf, "an event gains 2e-12"))
        self.assertAlmostEqual(self.ball([2, 1, 0, 0.5, 0.2], 0.5, 0.5e-12)[0], 0, delta=1e-12)
        self.assertAlmostEqual(self.ball([2, 1, 0, 0.5, 0.2], 0.5, None)[0], 0, delta=1e-12)


class Cradle(Files):
    def test_momentum_and_energy_are_those_of_the_ball_that_came(self):
        aside = math.hypot(0.4, 0.8)
        for speeds, error in ((((0, 0, 0), (1, 0, 0)), 0), (((0.5, 0, 0), (0.5, 0, 0)), 0.5), (((-0.1, 0, 0), (1, 0, 0)), 0.1),
                              (((0.6, 0, 0.8), (0, 0, 0)), aside), (((0, 0.8, 0), (0.6, 0, 0)), aside)):
            bodies = {
                name: [[0.0, 9, 9, 9, 1, 0, 0, 0, 5, 5, 5, 5, 5, 5], [1.0, 9, 9, 9, 1, 0, 0, 0, *v, 5, 5, 5]]
                for name, v in zip(("a", "b"), speeds)}
            found, note = measures.cradle(self.run_of(bodies), {})
            self.assertAlmostEqual(found, error, delta=1e-15)
            self.assertEqual(note, f"leave with {speeds[0][0]:.3g} {speeds[1][0]:.3g}")

    def test_balls_are_listed_as_they_stand(self):
        rows = {
            name: [[0.0, 9, 9, 9, 1, 0, 0, 0, 5, 5, 5, 5, 5, 5], [1.0, 9, 9, 9, 1, 0, 0, 0, x, 0, 0, 5, 5, 5]]
            for name, x in (("first", 0.25), ("ball_2", 0.5), ("ball_10", 1))}
        self.assertEqual(measures.cradle(self.run_of(rows), {})[1], "leave with 0.25 0.5 1")


class Painleve(Files):
    """A rod of half length 1 m and half thickness 0.5 mm, whose end slides on the ground."""
    def rod(self, states, angle, spin=0.0, gain=0.0, h=1e-4):
        """`states`: angle in degrees, slip of the end, its height, and the rate of turning at each step."""
        rows = []
        for n, (degrees, slip, gap, rate) in enumerate(states):
            a = math.radians(degrees)
            x, y = -math.cos(a) + 5e-4 * math.sin(a), -math.sin(a) - 5e-4 * math.cos(a)  # the end as seen from the middle
            quaternion = (math.cos(a / 2), 0, 0, math.sin(a / 2))
            rows.append([n * h, 7.0, gap - y, 0, *quaternion, slip + rate * y, -rate * x, 0, 0, 0, rate])
        summary = {"energy": {"max_gain_relative": gain}}
        return measures.painleve(self.run_of({"rod": rows}, h, summary, angle=math.radians(angle), spin=spin, mu=0.5), {})

    def test_an_impact_is_a_step_that_takes_more_than_a_hundred_of_friction(self):
        # mu g h = 5e-4 m/s a step: a hundred of it is 0.05 m/s.
        slides = [(31, -30, 0, 0.2), (40, -29.99, 0, 0.3), (43, -29.98, 0, 0.4)]
        error, note = self.rod([*slides, (44, -29.92, 0, 9)], 31)
        self.assertAlmostEqual(error, math.radians(2), delta=1e-9)  # of the step before, from 45 degrees
        self.assertIn("at 43.00 deg, t = 0.0002 s, takes the slip from -30 to -29.9 m/s", note)
        error, note = self.rod([*slides, (44, -29.94, 0, 9)], 31)
        self.assertEqual(error, math.inf)
        self.assertIn("slides on with -29.9 m/s at 44.0 deg", note)

    def test_in_what_begins_beyond_45_degrees_the_impact_is_due_at_once(self):
        error, _ = self.rod([(60, -30, 0, 0), (61, -10, 0, 0)], 60)
        self.assertAlmostEqual(error, 0, delta=1e-9)
        error, _ = self.rod([(60, -30, 0, 0), (63, -30, 0, 0), (64, -10, 0, 0)], 60)
        self.assertAlmostEqual(error, math.radians(3), delta=1e-9)

    def test_a_rod_that_lifts_off_is_right_where_it_spins(self):
        states = [(60, -30, 0, 5), (61, -30, 0.5e-6, 5), (62, -30, 2e-6, 5)]
        error, note = self.rod(states, 60, spin=5.0)
        self.assertEqual(error, 0)
        self.assertIn("lifts off at 62.00 deg, t = 0.0002 s, slipping with -30 m/s", note)
        self.assertEqual(self.rod(states, 60)[0], math.inf)

    def test_no_event_may_gain_energy(self):
        states = [(60, -30, 0, 0), (61, -10, 0, 0)]
        self.assertEqual(self.rod(states, 60, gain=2e-9), (math.inf, "an event gains 2e-09 of the energy"))
        for gain in (0.5e-9, None):
            self.assertAlmostEqual(self.rod(states, 60, gain=gain)[0], 0, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
