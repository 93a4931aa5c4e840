// What an adapter makes of a scene: shapes that stand as they are written down, each pair with its own law, joints; and
// what an engine cannot express, by name.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <map>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

/// A scene on level ground, which is at y = `level`, m.
void write_scene(const fs::path& file, const std::string& bodies, const std::string& pairs, const std::string& duration,
                 const std::string& gravity = "0 -9.8 0", const std::string& level = "0") {
  std::ofstream(file) << "<scenario title=\"engines\"><simulation step=\"1e-3\" duration=\"" << duration
                      << "\"/><reference kind=\"missing\"/><gravity constant=\"" << gravity
                      << "\"/><bodies><half_space name=\"ground\" point=\"0 " << level << " 0\" normal=\"0 1 0\"/>"
                      << bodies << "</bodies>" << (pairs.empty() ? "" : "<contacts>" + pairs + "</contacts>")
                      << "</scenario>";
}

/// The last row of each body or joint of a table, by name.
std::map<std::string, Row> last_rows(const fs::path& csv) {
  std::map<std::string, Row> last;
  for (const auto& [name, row] : named_rows(csv)) last[name] = row;
  return last;
}

/// Where all bodies of scene.xml are in the end.
std::map<std::string, Row> ended(const fs::path& directory, const Words& words) {
  const Result result = run(directory, joined({"run", "scene.xml", "--out", "out", "--quiet"}, words));
  INFO(result.err);
  REQUIRE(result.code == 0);
  return last_rows(directory / "out/trajectory.csv");
}

/// -: speed with which the ball of bounce.xml leaves the ground, over the one that it comes with.
double rebound(const fs::path& directory, const Words& words) {
  const Result result =
      run(directory, joined({"run", preflight_scenes + "bounce.xml", "--out", "out", "--quiet"}, words));
  INFO(result.err);
  REQUIRE(result.code == 0);
  const Words all = lines(read_file(directory / "out/trajectory.csv"));
  REQUIRE(cells(all[0])[10] == "vy");
  double down = 0, up = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double vy = std::strtod(cells(all[i])[10].c_str(), nullptr);
    down = std::max(down, -vy);
    up = std::max(up, vy);
  }
  CHECK(down == Approx(std::sqrt(2 * 9.8)).epsilon(0.01));
  return up / down;
}

}  // namespace

TEST_CASE("what stands in an engine is as tall and as thick as it is, along its own axes, fixed or free",
          "[program][engines]") {
  // Lying, unturned or of another size, each would be in what it is on, or something would come down by up to 0.2 m.
  const std::string
      can = R"(<cylinder name="can" radius="0.2" length="0.9" mass="1" position="0 0.45 0"/>)",
      pill = R"(<capsule name="pill" radius="0.15" length="0.6" mass="1" position="3 0.45 0"/>)",
      post = R"(<cylinder name="post" fixed="yes" radius="0.4" length="0.5" position="6 0.35 0"/>
<sphere name="on_post" radius="0.2" mass="1" position="6 0.8 0"/>)",
      wall =
          R"(<box name="wall" fixed="yes" size="0.6 0.2 1" position="9 0.8 0" axis="1 0 0" angle="${pi/2}"/>
<sphere name="on_wall" radius="0.2" mass="1" position="9 1.5 0"/>)",
      trunk =
          R"(<cylinder name="trunk" fixed="yes" radius="0.3" length="2" position="12 0.3 0" axis="0 0 1"
angle="${pi/2}"/>
<sphere name="on_trunk" radius="0.2" mass="1" position="12.6 0.8 0"/>)",
      bar =
          R"(<capsule name="bar" fixed="yes" radius="0.3" length="2" position="16 0.3 0" axis="0 0 1"
angle="${pi/2}"/>
<sphere name="on_bar" radius="0.2" mass="1" position="16.6 0.8 0"/>)";
  const TemporaryDirectory directory;
  for (const auto& [name, engine] : engines_here(directory.path())) {
    INFO(name);
    if (name == "simbody") continue;  // knows half-spaces alone to be on
    const bool cylinders = name != "dart", capsules = cylinders && name != "siconos";
    write_scene(directory.path() / "scene.xml",
                wall + (cylinders ? can + post + trunk : "") + (capsules ? pill + bar : ""),
                R"(<pair a="*" b="*" mu="0.5"/>)", "0.2");
    const auto rows = ended(directory.path(), {"--engine", name});
    CHECK(rows.at("on_wall").at("py") == Approx(1.5).margin(0.05));
    if (cylinders) CHECK(rows.at("on_post").at("py") == Approx(0.8).margin(0.05));
    if (cylinders) CHECK(rows.at("can").at("py") == Approx(0.45).margin(0.05));
    if (capsules) CHECK(rows.at("pill").at("py") == Approx(0.45).margin(0.05));
    if (cylinders) CHECK(rows.at("on_trunk").at("py") == Approx(0.8).margin(0.05));
    if (capsules) CHECK(rows.at("on_bar").at("py") == Approx(0.8).margin(0.05));
  }
}

TEST_CASE("bodies in an engine meet by the law of their own pair, and those of no pair pass through each other",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_scene(directory.path() / "scene.xml",
              R"(<box name="slick" size="1 0.2 1" mass="1" position="0 2.1 0" velocity="2 0 0"/>
<box name="rough" size="1 0.2 1" mass="1" position="0 2.1 3" velocity="0 0 2"/>
<sphere name="ghost" radius="0.4" mass="1" position="0 2.5 6"/>)",
              R"(<pair a="slick" b="ground" mu="0.1"/><pair a="rough" b="ground" mu="0.3"/>)", "0.3", "0 -9.8 0", "2");
  for (const auto& [name, engine] : engines_here(directory.path())) {
    INFO(name);
    Words words = {"--engine", name};
    if (name == "simbody") words = joined(words, {"--variant", "rigid"});
    const auto rows = ended(directory.path(), words);
    CHECK(rows.at("slick").at("vx") == Approx(2 - 0.1 * 9.8 * 0.3).margin(0.05));
    CHECK(rows.at("rough").at("vz") == Approx(2 - 0.3 * 9.8 * 0.3).margin(0.05));
    for (const char* box : {"slick", "rough"}) CHECK(rows.at(box).at("py") == Approx(2.1).margin(0.02));
    CHECK(rows.at("ghost").at("py") == Approx(2.5 - 9.8 * 0.3 * 0.3 / 2).margin(0.01));
    const int points = summary(directory.path() / "out")["contacts_max"];
    CHECK((points > 4) == (name != "simbody"));  // of both boxes together, where an engine says
    if (name != "simbody") continue;
    // Its compliant contact has one coefficient for all pairs.
    const auto soft = ended(directory.path(), {"--engine", name, "--friction", "0.2"});
    CHECK(soft.at("ghost").at("py") == Approx(2.5 - 9.8 * 0.3 * 0.3 / 2).margin(0.01));
    for (const char* box : {"slick", "rough"}) CHECK(soft.at(box).at("py") == Approx(2.1).margin(0.02));
  }
  // Where every pair is named MuJoCo could have one law for all, which these are not.
  if (!engines_here(directory.path()).contains("mujoco")) return;
  write_scene(directory.path() / "scene.xml",
              R"(<box name="slick" size="1 0.2 1" mass="1" position="0 0.1 0" velocity="2 0 0"/>
<box name="rough" size="1 0.2 1" mass="1" position="0 0.1 3" velocity="0 0 2"/>)",
              R"(<pair a="slick" b="ground" mu="0.1"/><pair a="rough" b="ground" mu="0.3"/>
<pair a="slick" b="rough" mu="0.2"/>)",
              "0.3");
  const auto all = ended(directory.path(), {"--engine", "mujoco"});
  CHECK(all.at("slick").at("vx") == Approx(2 - 0.1 * 9.8 * 0.3).margin(0.05));
  CHECK(all.at("rough").at("vz") == Approx(2 - 0.3 * 9.8 * 0.3).margin(0.05));
}

TEST_CASE("a ball in an engine that has restitution parts with the pair's share of its speed", "[program][engines]") {
  const TemporaryDirectory directory;
  const auto here = engines_here(directory.path());
  for (const auto& [name, variant] :
       {std::pair("ode", "world"), {"dart", "dantzig"}, {"simbody", "rigid"}, {"siconos", "nsgs"}}) {
    INFO(name);
    if (!here.contains(name)) continue;
    CHECK(rebound(directory.path(), {"--engine", name, "--variant", variant}) == Approx(0.5).margin(0.01));
  }
  // None below ODE's own knob; what is left is the way out of the depth.
  const Words slow = {"--engine", "ode", "--variant", "world", "--knob", "bounce_speed=10"};
  if (here.contains("ode")) CHECK(rebound(directory.path(), slow) < 0.3);
  // Bullet's contacts begin before they touch, and take most of a bounce; nearer ones leave it, and add to it.
  if (!here.contains("bullet")) return;
  const Words near = {"--engine", "bullet", "--knob", "breaking_threshold=1e-3"};
  const double none = rebound(directory.path(), joined(near, {"--restitution", "0"}));
  CHECK(rebound(directory.path(), near) > 0.2 + none);
  CHECK(rebound(directory.path(), joined(near, {"--knob", "bounce_speed=10"})) == Approx(none).margin(1e-3));
}

TEST_CASE("balls that meet in an engine that has restitution part with the share that their pair says",
          "[program][engines]") {
  // Alike, with 4 m/s: (1 - e) / 2 of it is left to the one, and the other gets (1 + e) / 2.
  const TemporaryDirectory directory;
  write_scene(directory.path() / "scene.xml",
              R"(<sphere name="left" radius="0.5" mass="1" position="-1.2 9 0" velocity="4 0 0"/>
<sphere name="right" radius="0.5" mass="1" position="0 9 0"/>)",
              R"(<pair a="left" b="right" mu="0" restitution="0.5"/>)", "0.1", "0 0 0");
  const auto here = engines_here(directory.path());
  for (const auto& [name, variant] :
       {std::pair("ode", "world"), {"dart", "dantzig"}, {"simbody", "rigid"}, {"siconos", "nsgs"}}) {
    INFO(name);
    if (!here.contains(name)) continue;
    const auto rows = ended(directory.path(), {"--engine", name, "--variant", variant});
    CHECK(rows.at("left").at("vx") == Approx(1).margin(0.05));
    CHECK(rows.at("right").at("vx") == Approx(3).margin(0.05));
  }
}

TEST_CASE("friction at 45 degrees to the axes is in an engine what its variant says, on the corners of a box",
          "[program][engines]") {
  const double pyramid = std::sqrt(2.0), within = std::sqrt(0.5);
  struct Case {
    const char *name, *variant;
    double diagonal;
  };
  const TemporaryDirectory directory;
  const auto here = engines_here(directory.path());
  for (const auto& [name, variant, diagonal] : {Case{"ode", "quick", pyramid},
                                                {"ode", "world-slip", 1},
                                                {"bullet", "si50", 1},
                                                {"mujoco", "newton-elliptic", 1},
                                                {"mujoco", "newton-pyramidal", within},
                                                {"dart", "dantzig", pyramid},
                                                {"simbody", "rigid", 1},
                                                {"siconos", "nsgs", 1}}) {
    INFO(name << " " << variant);
    if (!here.contains(name)) continue;
    for (const Json& row : here.at(name).at("variants"))
      if (row["name"] == variant) CHECK(row["diagonal"].get<double>() == Approx(diagonal));
    const Result result =
        run(directory.path(), {"run", preflight_scenes + "slide.xml", "--set", "heading=0.78539816339744831",
                               "--engine", name, "--variant", variant, "--duration", "0.1", "--out", "out", "--quiet"});
    INFO(result.err);
    REQUIRE(result.code == 0);
    const Row box = last_rows(directory.path() / "out/trajectory.csv").at("box");
    CHECK(std::hypot(box.at("vx"), box.at("vz")) == Approx(2 - diagonal * 0.2 * 9.8 * 0.1).margin(0.02));
    CHECK(box.at("vx") == Approx(box.at("vz")).margin(0.02));
    const bool says = std::string(name) != "simbody";
    const int points = summary(directory.path() / "out")["contacts_max"];  // those that each engine puts at its corners
    CHECK((points > 0) == says);
    CHECK(points <= 4);
  }
}

TEST_CASE("a block on a slab that moves, too, is braked in ODE along its slip on the slab", "[program][engines]") {
  // It slips with (1, 0, 1) m/s; what both do together is at right angles to that.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("ode")) return;
  write_scene(directory.path() / "scene.xml",
              R"(<box name="slab" size="4 0.2 4" mass="100" position="0 0.1 0" velocity="0.5 0 -1.5"/>
<box name="block" size="0.4 0.4 0.4" mass="1" position="0 0.4 0" velocity="1.5 0 -0.5"/>)",
              R"(<pair a="slab" b="ground" mu="0"/><pair a="block" b="slab" mu="0.2"/>)", "0.1");
  const auto rows = ended(directory.path(), {"--engine", "ode", "--variant", "world-slip"});
  const double vx = rows.at("block").at("vx") - rows.at("slab").at("vx"),
               vz = rows.at("block").at("vz") - rows.at("slab").at("vz"), braked = 0.2 * 9.8 * 0.1 * (1 + 1.0 / 100);
  CHECK(std::hypot(vx, vz) == Approx(std::sqrt(2.0) - braked).margin(0.03));
  CHECK(vx == Approx(vz).margin(0.03));
}

TEST_CASE("what an engine cannot express is unsupported, and named", "[program][engines]") {
  const std::string can = R"(<cylinder name="can" radius="0.5" length="1" mass="1" position="0 0.5 0"/>)",
                    coin = R"(<cylinder name="coin" radius="0.5" length="0" mass="1" position="0 0.5 0"/>)",
                    pill = R"(<capsule name="pill" radius="0.5" length="1" mass="1" position="0 1 0"/>)",
                    ball = R"(<capsule name="ball" radius="0.5" length="0" mass="1" position="0 1 0"/>)",
                    lump = R"(<hull name="lump" points="0 0 0 1 0 0 0 1 0 0 0 1" mass="1" position="0 0 0"/>)",
                    boxes = R"(<box name="a" size="1 1 1" mass="1" position="0 0.5 0"/>
<box name="b" size="1 1 1" mass="1" position="0 1.5 0"/>)",
                    arm = R"(<robot name="arm"><link name="bar" mass="3" position="0.5 1 0" inertia="1 1 1">
<sphere name="tip" radius="0.1" position="1 1 0"/></link>
<joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 1 0" axis="0 0 1"/></robot>)",
                    ram = R"(<robot name="press"><link name="bar" mass="3" position="0 1 0" inertia="1 1 1"/>
<joint name="rail" kind="prismatic" parent="world" child="bar" axis="1 0 0" lower="0" limit_rate="0.5"/></robot>)";
  const std::string ground = R"(<pair a="*" b="ground" mu="0.5"/>)",
                    apart = R"(<pair a="a" b="ground" mu="0.1"/><pair a="b" b="ground" mu="0.3"/>)",
                    knots = apart + R"(<pair a="a" b="b" mu="0.5"/>)",
                    bounce = R"(<pair a="a" b="ground" mu="0.1"/><pair a="b" b="ground" mu="0.1" restitution="0.25"/>)",
                    bounces = R"(<pair a="a" b="ground" mu="0.1" restitution="0.5"/>
<pair a="b" b="ground" mu="0.1" restitution="0.25"/><pair a="a" b="b" mu="0.1" restitution="0.25"/>)";
  struct Case {
    std::string engine, bodies, pairs, reason;
  };
  const std::vector<Case> cases = {
      {"ode", coin, ground, "a disc (coin): ODE's cylinders have a length"},
      {"ode", lump, ground, "a hull (lump): the adapter has no planes and polygons for ODE's"},
      {"ode", arm, ground, "a robot (arm): the adapter of ODE makes free bodies only"},
      {"bullet", coin, ground, "a disc (coin): Bullet's cylinders have a length"},
      {"bullet", lump, ground, "a hull (lump): Bullet's are larger than their points by a margin"},
      {"bullet", arm, ground, "a robot (arm): the adapter of Bullet makes free bodies only"},
      {"mujoco", coin, ground, "a disc (coin): MuJoCo's have a length"},
      {"mujoco", ball, ground, "a capsule without length (ball): MuJoCo's have one"},
      {"mujoco", lump, ground, "a hull (lump): the adapter makes no mesh for MuJoCo"},
      {"mujoco", boxes, bounce, "restitution: MuJoCo has no coefficient of it"},
      {"mujoco", ram, "", "limits of the joint rail that move: MuJoCo's stand still"},
      {"dart", can, ground, "a cylinder (can): DART's own detector knows boxes and spheres"},
      {"dart", pill, ground, "a capsule: this adapter knows no such shape"},
      {"dart", lump, ground, "a hull: this adapter knows no such shape"},
      {"dart", arm, ground, "a robot (arm): the adapter of DART makes free bodies only"},
      {"dart", boxes, knots,
       "friction: DART takes the lesser of both shapes', which gives this scene's pairs no numbers"},
      {"dart", boxes, bounces,
       "restitution: DART takes the product of both shapes', which gives this scene's pairs no numbers"},
      {"simbody", can, ground,
       "contact of can and ground: Simbody knows two spheres, and boxes and spheres on half-spaces"},
      {"simbody", boxes, apart,
       "friction: compliant materials have one coefficient here, and this scene's pairs several"},
      {"simbody", boxes, bounce, "restitution: Simbody's compliant contact has dissipation in its place"},
      {"siconos", coin, ground, "a disc (coin): Siconos' cylinders have a length"},
      {"siconos", arm, ground, "a robot (arm): the adapter of Siconos makes free bodies only"}};
  const TemporaryDirectory directory;
  const auto here = engines_here(directory.path());
  for (const auto& [engine, bodies, pairs, reason] : cases) {
    if (!here.contains(engine)) continue;
    INFO(engine << ": " << reason);
    write_scene(directory.path() / "scene.xml", bodies, pairs, "0.01");
    const Result result = run(directory.path(), {"run", "scene.xml", "--engine", engine, "--out", "out", "--quiet"});
    INFO(result.err);
    CHECK(result.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "unsupported");
    CHECK(row["reason"] == reason);
  }
}

TEST_CASE("a slide in MuJoCo starts where the scene says, swings about its spring's rest and stops at its limits",
          "[program][engines]") {
  // Along the robot's x axis, which is turned by 0.5 rad about y: q = 0.3 - 0.2 cos 5 t + 0.1 sin 5 t.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  const auto cart = [](const std::string& name, const std::string& joint) {
    return "<robot name=\"" + name + "\" position=\"1 2 3\" axis=\"0 1 0\" angle=\"0.5\"><link name=\"" + name +
           R"(_cart" mass="2" position="0.4 0 0" inertia="1 1 1"/><joint name=")" + name +
           R"(_rail" kind="prismatic" parent="world" child=")" + name + R"(_cart" axis="1 0 0" )" + joint +
           "/></robot>";
  };
  write_scene(directory.path() / "scene.xml",
              cart("swings", R"(stiffness="50" rest="0.3" position="0.1" velocity="0.5")") +
                  cart("up", R"(upper="0.1" velocity="1")") + cart("down", R"(lower="-0.1" velocity="-1")"),
              "", "0.3", "0 0 0");
  const auto rows = ended(directory.path(), {"--engine", "mujoco"});
  const auto joints = last_rows(directory.path() / "out/joints.csv");
  const double q = 0.3 - 0.2 * std::cos(1.5) + 0.1 * std::sin(1.5), c = std::cos(0.5), s = std::sin(0.5);
  CHECK(joints.at("swings_rail").at("q") == Approx(q).margin(3e-3));
  CHECK(joints.at("swings_rail").at("qd") == Approx(std::sin(1.5) + 0.5 * std::cos(1.5)).margin(1e-2));
  const Row& body = rows.at("swings_cart");
  CHECK(body.at("px") == Approx(1 + c * (0.4 + q)).margin(3e-3));
  CHECK(body.at("py") == Approx(2).margin(1e-9));
  CHECK(body.at("pz") == Approx(3 - s * (0.4 + q)).margin(3e-3));
  // Limits are soft: each is met after 0.1 s and would be 0.2 m behind it by now.
  CHECK(joints.at("up_rail").at("q") == Approx(0.1).margin(0.07));
  CHECK(joints.at("down_rail").at("q") == Approx(-0.1).margin(0.07));
}

TEST_CASE("a robot that floats and is turned moves in MuJoCo as in our own steps, its fixed links too",
          "[program][engines]") {
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  write_scene(directory.path() / "scene.xml",
              R"(<robot name="satellite" position="0 5 0" axis="1 2 2" angle="0.9">
<link name="hull" mass="3" position="0 0 0" inertia="0.1 0.2 0.15"/>
<link name="boom" mass="1" position="1 0 0" inertia="0.01 0.3 0.3"/>
<link name="eye" mass="0.2" position="0 0.5 0" inertia="0.01 0.01 0.01"/>
<joint name="space" kind="free" parent="world" child="hull" velocity="1 -2 0.5" angular_velocity="1 2 -1"/>
<joint name="elbow" kind="revolute" parent="hull" child="boom" axis="0 1 1" anchor="0.5 0 0" velocity="2"/>
<joint name="mount" kind="fixed" parent="hull" child="eye"/></robot>)",
              "", "0.2", "0 0 0");
  const auto ours = ended(directory.path(), {"--method", "ap"});
  const auto theirs = ended(directory.path(), {"--engine", "mujoco"});
  for (const char* link : {"hull", "boom", "eye"}) {
    INFO(link);
    const Row &a = theirs.at(link), &b = ours.at(link);
    double cosine = 0;  // of half the angle between the two
    for (const char* turn : {"qw", "qx", "qy", "qz"}) cosine += a.at(turn) * b.at(turn);
    CHECK(std::abs(cosine) > 1 - 2e-5);
    for (const char* place : {"px", "py", "pz"}) CHECK(a.at(place) == Approx(b.at(place)).margin(5e-3));
    for (const char* speed : {"vx", "vy", "vz", "wx", "wy", "wz"})
      CHECK(a.at(speed) == Approx(b.at(speed)).margin(0.03));
  }
}

TEST_CASE("a link meets the one that it hangs on in MuJoCo, too", "[program][engines]") {
  // 2 kg at 1 m/s catch up with 1 kg at rest on the same rail, 0.1 m on: both go on with 2/3 m/s.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  write_scene(directory.path() / "scene.xml",
              R"(<robot name="train" position="0 5 0">
<link name="engine" mass="2" position="0 0 0" inertia="1 1 1"><sphere name="bow" radius="0.1" position="0 0 0"/></link>
<link name="wagon" mass="1" position="0.3 0 0" inertia="1 1 1"><sphere name="stern" radius="0.1" position="0.3 0 0"/></link>
<joint name="rail" kind="prismatic" parent="world" child="engine" axis="1 0 0" velocity="1"/>
<joint name="coupling" kind="prismatic" parent="engine" child="wagon" axis="1 0 0" velocity="-1"/></robot>)",
              R"(<pair a="*" b="*" mu="0"/>)", "0.3", "0 0 0");
  for (const Words& words : {Words{"--engine", "mujoco"}, Words{"--method", "ap"}}) {
    INFO(words[1]);
    const auto rows = ended(directory.path(), words);
    for (const char* link : {"engine", "wagon"}) CHECK(rows.at(link).at("vx") == Approx(2.0 / 3).margin(0.1));
  }
}

#endif
