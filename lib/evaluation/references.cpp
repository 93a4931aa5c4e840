// The table of closed forms that a scenario can name as its reference, with the errors that a run reports against them.
// Names are fixed once published. The names end in their unit; `relative` has none.
#include <array>

#include "evaluation/scene_errors.h"

namespace cb {

namespace {

using Errors = std::vector<std::pair<std::string_view, std::string_view>>;

const std::array<ReferenceRow, 7>& table() {
  static const std::array<ReferenceRow, 7> rows = {{
      {"impacting_sphere",
       "a sphere's impact, sliding and rolling in closed form (Coulomb; normal impulse (1 + e) m v_n, sticks iff "
       "slip <= (1 + m r^2 / I) mu (1 + e) v_n)",
       Errors{
           {"velocity_after_impact_m_per_s", "m/s; velocity after the first impact, from the recorded one before it"},
           {"spin_after_impact_rad_per_s", "rad/s; the same of the spin"},
           {"ke_after_impact_j", "J; the same of the kinetic energy, its size"},
           {"ke_after_impact_relative", "-; the same as a fraction of the kinetic energy before the impact"},
           {"polygon_velocity_after_impact_m_per_s", "m/s; against the polygon of the run's k edges (ap, e = 0)"},
           {"polygon_spin_after_impact_rad_per_s", "rad/s; against the polygon"},
           {"polygon_ke_after_impact_j", "J; against the polygon"},
           {"energy_rise_linf_j", "J; largest kinetic energy that one event adds (0 where none does)"},
           {"energy_rise_relative", "-; the same as a fraction of the kinetic energy before that event"},
           {"impact_time_error_s", "s; time of the first impact against exact free fall"},
           {"rolling_start_error_s", "s; time from impact to rolling (slip below 1e-6 of the speed before it), e = 0"},
           {"position_final_m", "m; distance from the exact centre at the end, e = 0"},
           {"position_linf_m", "m; the same, largest over time"},
           {"position_l2_m", "m; the same, root mean square over time"},
           {"horizon_s", "s; first time at which it passes a tenth of the diameter"}}},
      {"sliding_box",
       "a box pushed along a plane: piecewise constant acceleration under Coulomb friction (along one line in closed "
       "form, else integrated to 1e-12), and under the polygon of the run's k edges",
       Errors{{"x_final_relative", "-; |x - x_exact| / x_exact at the end, x along the first push"},
              {"position_final_m", "m; distance from the exact place at the end"},
              {"position_linf_m", "m; the same, largest over time"},
              {"position_l2_m", "m; the same, root mean square over time"},
              {"horizon_s", "s; first time at which it passes a tenth of the box's size"},
              {"creep_before_push_m", "m; largest displacement before the first push"},
              {"creep_after_stop_m", "m; largest displacement from the place 0.3 s after the last push, once it stops"},
              {"lateral_drift_m", "m; largest displacement along the plane across the first push"},
              {"lift_linf_m", "m; largest displacement along the plane's normal"},
              {"polygon_x_final_relative", "-; x_final_relative against the polygon's own answer"},
              {"polygon_position_final_m", "m; position_final_m against the polygon's own answer"},
              {"polygon_position_linf_m", "m; position_linf_m against it"},
              {"polygon_position_l2_m", "m; position_l2_m against it"},
              {"polygon_horizon_s", "s; horizon_s against it"}}},
      {"sticking_box",
       "a box on a slope rests where mu >= tan(slope), else slides with g (sin - mu cos); and the same for the polygon "
       "of the run's k edges",
       Errors{{"displacement_final_m", "m; |p(T) - p(0)|"},
              {"displacement_linf_m", "m; largest |p(t) - p(0)|"},
              {"creep_rate_m_per_s", "m/s; |p(T) - p(T/2)| / (T/2)"},
              {"first_past_1nm_s", "s; first time at which |p(t) - p(0)| passes 1e-9 m"},
              {"first_past_1um_s", "s; 1e-6 m"},
              {"first_past_1mm_s", "s; 1e-3 m"},
              {"tilt_linf_rad", "rad; largest angle turned from the start"},
              {"position_final_m", "m; distance from the exact place at the end (at rest: the displacement)"},
              {"position_linf_m", "m; the same, largest over time"},
              {"position_l2_m", "m; the same, root mean square over time"},
              {"horizon_s", "s; first time at which it passes a tenth of the box's size"},
              {"polygon_position_final_m", "m; position_final_m against the polygon's own answer"},
              {"polygon_position_linf_m", "m; position_linf_m against it"},
              {"polygon_position_l2_m", "m; position_l2_m against it"},
              {"polygon_horizon_s", "s; horizon_s against it"}}},
      {"circular_sliding",
       "a box that a turning drive slides round: Coulomb's slider integrated to 1e-12 (steady: the circle with speed "
       "sqrt(a^2 - mu^2 g^2)), and the polygon's slider, exact",
       Errors{{"position_final_m", "m; distance from the exact place at the end"},
              {"position_linf_m", "m; the same, largest over time"},
              {"position_l2_m", "m; the same, root mean square over time"},
              {"horizon_s", "s; first time at which it passes a tenth of the box's size"},
              {"radius_error_m", "m; radius (root mean square) of the last whole turn against the exact one's"},
              {"centre_error_m", "m; mean place over the last whole turn against the exact one's"},
              {"drift_per_turn_m", "m; shift of that mean a turn, beyond the exact one's"},
              {"lift_linf_m", "m; largest displacement along the plane's normal"},
              {"polygon_position_final_m", "m; position_final_m against the polygon's own answer"},
              {"polygon_position_linf_m", "m; position_linf_m against it"},
              {"polygon_position_l2_m", "m; position_l2_m against it"},
              {"polygon_horizon_s", "s; horizon_s against it"}}},
      {"stack", "a stack at rest: nothing moves, and the normal impulses at an interface carry what is above it",
       Errors{{"displacement_linf_m", "m; largest displacement of a body's centre"},
              {"displacement_final_m", "m; the same at the end"},
              {"tilt_linf_rad", "rad; largest angle turned by a body"},
              {"interface_sum_relative",
               "-; sum of normal impulses of a step at an interface against m g h of all above "
               "it; worst of all steps and interfaces"},
              {"interface_total_relative", "-; the same for the sum over all interfaces, worst of all steps"},
              {"penetration_linf_m", "m; deepest penetration"}}},
      {"mobile_robot",
       "a robot on two wheels that never slip, with the same mass, motors and law: rolling in the plane, integrated by "
       "Runge and Kutta's method to 1e-12 m",
       Errors{
           {"cross_track_rms_m", "m; distance from the figure eight, root mean square from 5 s on"},
           {"cross_track_linf_m", "m; the same, largest"},
           {"no_slip_cross_track_rms_m", "m; cross_track_rms_m of the robot that never slips"},
           {"no_slip_cross_track_linf_m", "m; cross_track_linf_m of the robot that never slips"},
           {"cross_track_rms_difference_m", "m; |cross_track_rms_m - no_slip_cross_track_rms_m|"},
           {"position_final_m", "m; distance of the axle's middle from that of the robot that never slips, at the end"},
           {"position_linf_m", "m; the same, largest over time"},
           {"position_l2_m", "m; the same, root mean square over time"},
           {"slip_left_along_rms_m_per_s",
            "m/s; speed of the left wheel's lowest point along the heading, root mean "
            "square over time, loaded or not"},
           {"slip_left_along_linf_m_per_s", "m/s; the same, largest"},
           {"slip_left_across_rms_m_per_s", "m/s; level, across the heading, root mean square"},
           {"slip_left_across_linf_m_per_s", "m/s; the same, largest"},
           {"slip_right_along_rms_m_per_s", "m/s; the right wheel's"},
           {"slip_right_along_linf_m_per_s", "m/s; the right wheel's"},
           {"slip_right_across_rms_m_per_s", "m/s; the right wheel's"},
           {"slip_right_across_linf_m_per_s", "m/s; the right wheel's"},
           {"load_asymmetry_mean_relative",
            "-; |N_L - N_R| / (N_L + N_R) of the wheels' normal impulses of a step, mean over "
            "the steps with a load"},
           {"load_asymmetry_linf_relative", "-; the same, largest"},
           {"unloaded_left_relative",
            "-; share of steps in which the left wheel has less than 1e-6 of the load, or "
            "neither has any"},
           {"unloaded_right_relative", "-; the same of the right wheel"}}},
      {"grasp", "what two fingers hold does not move in their frames; joints are where their wanted sinusoids are",
       Errors{{"creep_final_m",
               "m; root sum of squares of the held body's displacement in both fingers' frames, at the "
               "end"},
              {"creep_linf_m", "m; the same, largest over time"},
              {"creep_rate_m_per_s", "m/s; the same from T/2 to T, over T/2"},
              {"rotation_linf_rad", "rad; largest angle turned in a finger's frame"},
              {"dropped_s",
               "s; first time at which the body is more than half its size from its start in both fingers' "
               "frames"},
              {"tracking_shoulder1_rms_rad", "rad; first joint on a sinusoid against it, root mean square over time"},
              {"tracking_shoulder1_linf_rad", "rad; the same, largest"},
              {"tracking_shoulder2_rms_rad", "rad; second joint on a sinusoid"},
              {"tracking_shoulder2_linf_rad", "rad; the same, largest"}}},
  }};
  return rows;
}

}  // namespace

std::span<const ReferenceRow> references() { return table(); }

}  // namespace cb
