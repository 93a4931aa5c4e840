// MuJoCo as an engine beside the methods.
//
// What is followed: MuJoCo's documentation of 2.2.2, chapters "Computation" (constraint model, friction cones,
// parameters, algorithms), "Modeling" (solver parameters, contact parameters), "XML reference" (option, geom,
// contact/pair), and mjdata.h.
//   * A pair's friction goes to a <pair>, or where all pairs of shapes have one law to every geom, whose larger one is
//     taken: then MuJoCo's own search for pairs works, as it does for most users.
//   * A robot is nested bodies with hinges and slides, by our model of it; its motors' torques come from our
//   controllers
//     (qfrc_applied), damping and springs are MuJoCo's, and so are limits, which are soft.
//   * There is no coefficient of restitution: with one, a scene is unsupported.
//   * The elliptic cone is Coulomb's. The pyramidal one is spanned by n +- mu t1, n +- mu t2, within Coulomb's cone: at
//     45 degrees to t1, t2 it has mu / sqrt(2).
//   * Contacts are soft: a_ref - R f is what a contact's acceleration is (R: "regularisation", of solimp), where a_ref
//     (of solref) takes depth and velocity away over timeconst seconds. `stiff` variants have the least timeconst that
//     MuJoCo takes without setting it itself (2 h, "refsafe"), and solimp at its largest (0.9999).
//
// Its own contact problem: M (q'' - q''_smooth) = J^T f holds in every step, and v+ = v + h q''. So v- = v + h
// q''_smooth is the velocity without contact and r = h f the impulse. u = J v+ + w with w = -(J v + h a_ref), so that u
// = -R r where nothing slides: rigid contacts would have u = 0.

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <memory>

#include "dynamics/kinematics.h"
#include "frame/engine.h"
#include "frame/own_problem.h"

namespace cb {

namespace {

std::string text(const Vec3& x) { return fmt::format("{:.17g} {:.17g} {:.17g}", x.x(), x.y(), x.z()); }
std::string text(const Quat& q) { return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(), q.z()); }

/// Has every pair of shapes that could touch the same law?
const PairLaw* common_law(const Scenario& scenario) {
  const auto n = static_cast<int>(scenario.shapes.size());
  const PairLaw* common = nullptr;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) {
      if (scenario.shapes[i].body == scenario.shapes[j].body) continue;
      const PairLaw* law = scenario.pairs.find(i, j);
      if (law == nullptr || (common && (law->mu != common->mu || law->restitution != common->restitution)))
        return nullptr;
      common = law;
    }
  return common;
}

/// The scene in MuJoCo's format.
class Mjcf {
 public:
  Mjcf(const Scenario& scenario, const EngineSetting& setting) : scenario_(scenario), setting_(setting) {
    const PairLaw* law = common_law(scenario);
    by_geom_ = law != nullptr;
    if (by_geom_) friction_ = law->mu;
    for (const PairLaw& pair : scenario.pairs.laws)
      if (pair.restitution > 0) throw Unsupported("restitution: MuJoCo has no coefficient of it");
    text_ = "<mujoco><compiler angle=\"radian\"/>";
    add_options();
    text_ += "<worldbody>";
    for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
      if (scenario.shapes[i].body < 0) add_geom(i);
    for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b)
      if (scenario.model.bodies[b].tree < 0) add_free(static_cast<int>(b));
    for (const Tree& tree : scenario.model.trees)
      for (const Joint& joint : tree.joints)
        if (joint.parent < 0) add_link(tree, joint);
    text_ += "</worldbody>";
    if (!by_geom_) add_pairs();
    text_ += "</mujoco>";
  }
  const std::string& str() const { return text_; }

 private:
  double knob(const char* name) const { return setting_.knobs.at(name); }

  void add_options() {
    const std::string& variant = setting_.variant;
    const bool pyramid = variant.find("pyramidal") != std::string::npos;
    const char* solver = variant.starts_with("pgs") ? "PGS" : variant.starts_with("cg") ? "CG" : "Newton";
    text_ += fmt::format(
        "<option timestep=\"{:.17g}\" gravity=\"0 0 0\" integrator=\"Euler\" cone=\"{}\" solver=\"{}\" "
        "iterations=\"{}\" tolerance=\"{:.17g}\" noslip_iterations=\"{}\" impratio=\"{:.17g}\">"
        // Left to itself a link passes through the one that it hangs on.
        "<flag filterparent=\"disable\"/></option>",
        setting_.step, pyramid ? "pyramidal" : "elliptic", solver, static_cast<int>(knob("iterations")),
        knob("tolerance"), static_cast<int>(knob("noslip_iterations")), knob("impratio"));
    // Room for four contacts of each of 8 neighbours of a shape, and the rows of the larger cone.
    const auto contacts = static_cast<int>(64 + 32 * scenario_.shapes.size());
    const auto limits = static_cast<int>(2 * scenario_.initial.q.size());
    text_ += fmt::format("<size nconmax=\"{}\" njmax=\"{}\"/>", contacts, 4 * contacts + limits);
    const double timeconst = knob("timeconst") > 0 ? knob("timeconst") : 2 * setting_.step;
    softness_ = fmt::format("solref=\"{:.17g} {:.17g}\" solimp=\"{:.17g} {:.17g} {:.17g} 0.5 2\"", timeconst,
                            knob("dampratio"), knob("solimp_min"), knob("solimp_max"), knob("solimp_width"));
  }

  void add_geom(std::size_t index) {
    const Shape& shape = scenario_.shapes[index];
    Quat turn = shape.local.q;
    std::string kind, size;
    switch (shape.kind) {
      case ShapeKind::sphere:
        kind = "sphere";
        size = fmt::format("{:.17g}", shape.radius);
        break;
      case ShapeKind::box:
        kind = "box";
        size = text(shape.half_extents);
        break;
      case ShapeKind::cylinder:  // along z in MuJoCo, along y here
        if (shape.half_extents.y() == 0) throw Unsupported("a disc (" + shape.name + "): MuJoCo's have a length");
        kind = "cylinder";
        size = fmt::format("{:.17g} {:.17g}", shape.radius, shape.half_extents.y());
        turn = turn * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
        break;
      case ShapeKind::capsule:  // likewise
        if (shape.half_extents.y() == 0)
          throw Unsupported("a capsule without length (" + shape.name + "): MuJoCo's have one");
        kind = "capsule";
        size = fmt::format("{:.17g} {:.17g}", shape.radius, shape.half_extents.y());
        turn = turn * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
        break;
      case ShapeKind::hull:
        throw Unsupported("a hull (" + shape.name + "): the adapter makes no mesh for MuJoCo");
      case ShapeKind::half_space:  // its normal is z in MuJoCo, y here
        kind = "plane";
        size = "0 0 1";
        turn = turn * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
        break;
    }
    text_ += fmt::format("<geom name=\"s{}\" type=\"{}\" size=\"{}\" pos=\"{}\" quat=\"{}\" condim=\"3\" ", index, kind,
                         size, text(shape.local.p), text(turn));
    text_ += by_geom_ ? fmt::format("friction=\"{:.17g} 0 0\" {}/>", friction_, softness_)
                      : std::string("contype=\"0\" conaffinity=\"0\"/>");
  }

  void begin_body(int index, const Pose& pose) {
    text_ += fmt::format("<body name=\"b{}\" pos=\"{}\" quat=\"{}\">", index, text(pose.p), text(pose.q));
  }
  /// What every body has besides its joint.
  void fill_body(int index) {
    const Body& body = scenario_.model.bodies[static_cast<std::size_t>(index)];
    text_ +=
        fmt::format("<inertial pos=\"0 0 0\" mass=\"{:.17g}\" diaginertia=\"{}\"/>", body.mass, text(body.inertia));
    for (std::size_t i = 0; i < scenario_.shapes.size(); ++i)
      if (scenario_.shapes[i].body == index) add_geom(i);
  }
  void add_free(int index) {
    begin_body(index, scenario_.initial.pose[static_cast<std::size_t>(index)]);
    text_ += "<freejoint/>";
    fill_body(index);
    text_ += "</body>";
  }

  /// A link where its coordinate is 0, with all that hang on it.
  void add_link(const Tree& tree, const Joint& joint) {
    const bool free = joint.kind == JointKind::free;
    const Pose at = free ? scenario_.initial.pose[static_cast<std::size_t>(joint.body)]
                         : Pose{joint.anchor_P - joint.turn_PC * joint.anchor_C, joint.turn_PC};
    begin_body(joint.body, at);
    if (free) text_ += "<freejoint/>";
    if (joint.nv() == 1) add_joint(joint);
    fill_body(joint.body);
    for (const Joint& other : tree.joints)
      if (other.parent == joint.body) add_link(tree, other);
    text_ += "</body>";
  }

  void add_joint(const Joint& joint) {
    if (joint.limit_rate != 0)
      throw Unsupported("limits of the joint " + joint.name + " that move: MuJoCo's stand still");
    constexpr double none = 1e10;
    text_ += fmt::format(
        "<joint type=\"{}\" pos=\"{}\" axis=\"{}\" damping=\"{:.17g}\" stiffness=\"{:.17g}\" springref=\"{:.17g}\" ",
        joint.kind == JointKind::revolute ? "hinge" : "slide", text(joint.anchor_C), text(joint.axis_C), joint.damping,
        joint.stiffness, joint.rest);
    if (joint.limited())
      text_ += fmt::format("limited=\"true\" range=\"{:.17g} {:.17g}\"", std::max(joint.lower, -none),
                           std::min(joint.upper, none));
    text_ += "/>";
  }

  void add_pairs() {
    const auto n = static_cast<int>(scenario_.shapes.size());
    text_ += "<contact>";
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j)
        if (const PairLaw* law = scenario_.pairs.find(i, j);
            law != nullptr && scenario_.shapes[i].body != scenario_.shapes[j].body)
          text_ += fmt::format("<pair geom1=\"s{}\" geom2=\"s{}\" condim=\"3\" friction=\"{:.17g} {:.17g} 0 0 0\" {}/>",
                               i, j, law->mu, law->mu, softness_);
    text_ += "</contact>";
  }

  const Scenario& scenario_;
  const EngineSetting& setting_;
  bool by_geom_ = false;
  double friction_ = 0;
  std::string text_, softness_;
};

[[noreturn]] void fatal(const char* message) {
  std::fprintf(stderr, "MuJoCo: %s\n", message);
  std::exit(1);
}

class MujocoScene {
 public:
  MujocoScene(const Scenario& scenario, const EngineSetting& setting)
      : scene_(scenario.model),
        model_(nullptr, mj_deleteModel),
        data_(nullptr, mj_deleteData),
        bodies_(scenario.model.bodies.size()) {
    mju_user_error = fatal;
    mju_user_warning = [](const char*) {};  // counted in mjData
    const std::string xml = Mjcf(scenario, setting).str();
    const auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(xml.size()));
    std::copy(xml.begin(), xml.end(), static_cast<char*>(files->filedata[0]));
    char error[1000] = "";
    model_.reset(mj_loadXML("scene.xml", files.get(), error, sizeof error));
    mj_deleteVFS(files.get());
    if (!model_) throw Unsupported(std::string("MuJoCo refuses the scene: ") + error);
    data_.reset(mj_makeData(model_.get()));
    start(scenario.initial);
  }

  void load(const Loads& loads) {
    for (int k = 0; k < 3; ++k) model_->opt.gravity[k] = loads.gravity[k];
    for (std::size_t b = 0; b < bodies_; ++b)
      for (int k = 0; k < 3; ++k) data_->xfrc_applied[6 * id_[b] + k] = loads.force[b][k];
    each_joint([&](const Joint& joint, int, int dof) { data_->qfrc_applied[dof] = loads.torque[joint.v]; });
    v_before_.assign(data_->qvel, data_->qvel + model_->nv);
  }
  void step(double h) {
    model_->opt.timestep = h;
    mj_step(model_.get(), data_.get());
  }
  void read(State& state) const {
    // MuJoCo begins anew where numbers run away, and goes on without what has no room: neither is an answer.
    double bad = 0;
    for (const int kind : {mjWARN_INERTIA, mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC})
      if (data_->warning[kind].number > 0) bad = NAN;
    for (const int kind : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})
      if (data_->warning[kind].number > 0) fatal("no room for all contacts");
    each_free([&](std::size_t b, int place, int dof) {
      const double *q = data_->qpos + place, *v = data_->qvel + dof;
      Pose& pose = state.pose[b];
      pose = {Vec3(q[0] + bad, q[1], q[2]), Quat(q[3], q[4], q[5], q[6])};
      const Vec3 spin = pose.q * Vec3(v[3], v[4], v[5]);
      for (std::size_t k = 0; k < 3; ++k) {
        state.v[6 * b + k] = v[k];
        state.v[6 * b + 3 + k] = spin[static_cast<Eigen::Index>(k)];
      }
    });
    each_joint([&](const Joint& joint, int place, int dof) {
      state.q[joint.q] = data_->qpos[place] + bad;
      state.qd[joint.v] = data_->qvel[dof];
    });
    for (const Tree& tree : scene_.trees) {
      for (const Joint& joint : tree.joints)
        if (joint.kind == JointKind::free) std::copy_n(&state.v[6 * joint.body], 6, &state.qd[joint.v]);
      forward_kinematics(scene_, tree, state);
    }
  }
  int contacts() const { return data_->ncon; }

  bool problem(OwnProblem& out) const;

 private:
  /// Row of the constraint Jacobian, dense.
  void row(int index, std::vector<double>& out) const;
  void add_contact(const mjContact& contact, OwnProblem& out) const;

  void start(const State& initial);
  /// see(body, where its place begins, where its velocity begins) of all that move freely, roots of robots too.
  template <class See>
  void each_free(const See& see) const {
    for (std::size_t b = 0; b < bodies_; ++b)
      if (const int joint = model_->body_jntadr[id_[b]]; joint >= 0 && model_->jnt_type[joint] == mjJNT_FREE)
        see(b, model_->jnt_qposadr[joint], model_->jnt_dofadr[joint]);
  }
  /// see(joint, where its coordinate is, where its rate is) of the robots' hinges and slides.
  template <class See>
  void each_joint(const See& see) const {
    for (const Tree& tree : scene_.trees)
      for (const Joint& of : tree.joints)
        if (of.nv() == 1) {
          const int joint = model_->body_jntadr[id_[static_cast<std::size_t>(of.body)]];
          see(of, model_->jnt_qposadr[joint], model_->jnt_dofadr[joint]);
        }
  }

  Model scene_;
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::size_t bodies_;
  std::vector<int> id_;  // MuJoCo's number of each body
  std::vector<double> v_before_;
};

void MujocoScene::start(const State& initial) {
  for (std::size_t b = 0; b < bodies_; ++b)
    id_.push_back(mj_name2id(model_.get(), mjOBJ_BODY, fmt::format("b{}", b).c_str()));
  each_free([&](std::size_t b, int, int dof) {
    const double* v = &initial.v[6 * b];
    const Vec3 spin = initial.pose[b].q.conjugate() * Vec3(v[3], v[4], v[5]);
    for (int k = 0; k < 3; ++k) {
      data_->qvel[dof + k] = v[k];
      data_->qvel[dof + 3 + k] = spin[k];  // in the body's frame
    }
  });
  each_joint([&](const Joint& joint, int place, int dof) {
    data_->qpos[place] = initial.q[joint.q];
    data_->qvel[dof] = initial.qd[joint.v];
  });
}

void MujocoScene::row(int index, std::vector<double>& out) const {
  const auto nv = static_cast<std::size_t>(model_->nv);
  out.assign(nv, 0.0);
  if (!mj_isSparse(model_.get())) {
    std::copy_n(data_->efc_J + index * model_->nv, nv, out.begin());
    return;
  }
  const int start = data_->efc_J_rowadr[index];
  for (int e = 0; e < data_->efc_J_rownnz[index]; ++e) out[data_->efc_J_colind[start + e]] = data_->efc_J[start + e];
}

/// Rows n, t1, t2 of a contact from those of its cone, with R and what the contact is to have as J v+.
void MujocoScene::add_contact(const mjContact& contact, OwnProblem& out) const {
  const double h = model_->opt.timestep, mu = contact.friction[0];
  const bool pyramid = mj_isPyramidal(model_.get());
  const int at = contact.efc_address;
  std::vector<std::vector<double>> rows(pyramid ? 4 : 3);
  std::vector<double> target(rows.size()), force(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int e = at + static_cast<int>(i);
    row(e, rows[i]);
    target[i] = h * data_->efc_aref[e];
    for (std::size_t j = 0; j < v_before_.size(); ++j) target[i] += rows[i][j] * v_before_[j];
    force[i] = data_->efc_force[e];
  }
  std::vector<double> wanted(3), impulse(3), compliance(3);
  std::vector<std::vector<double>> J(3);
  if (pyramid) {  // edges n + mu t1, n - mu t1, n + mu t2, n - mu t2
    J[0].resize(rows[0].size());
    J[1] = J[2] = J[0];
    for (std::size_t j = 0; j < rows[0].size(); ++j) {
      J[0][j] = (rows[0][j] + rows[1][j]) / 2;
      J[1][j] = (rows[0][j] - rows[1][j]) / (2 * mu);
      J[2][j] = (rows[2][j] - rows[3][j]) / (2 * mu);
    }
    wanted = {(target[0] + target[1]) / 2, (target[0] - target[1]) / (2 * mu), (target[2] - target[3]) / (2 * mu)};
    impulse = {h * (force[0] + force[1] + force[2] + force[3]), h * mu * (force[0] - force[1]),
               h * mu * (force[2] - force[3])};
    compliance.assign(3, data_->efc_R[at]);  // of an edge
  } else {
    J = rows;
    wanted = target;
    for (std::size_t i = 0; i < 3; ++i) {
      impulse[i] = h * force[i];
      compliance[i] = data_->efc_R[at + static_cast<int>(i)];
    }
  }
  const int first = model_->geom_bodyid[contact.geom1] - 1, second = model_->geom_bodyid[contact.geom2] - 1;
  out.problem.J.add_band();
  for (const int body : {std::min(first, second), std::max(first, second)}) {
    if (body < 0) continue;
    const int entry = out.problem.J.add_entry(body, 6);
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 6; ++k)
        out.problem.J.entry(entry)(r, k) = J[static_cast<std::size_t>(r)][static_cast<std::size_t>(6 * body + k)];
  }
  for (std::size_t r = 0; r < 3; ++r) {
    out.problem.offset.push_back(-wanted[r]);
    out.impulse.push_back(impulse[r]);
    out.compliance.push_back(compliance[r]);
  }
  out.problem.mu.push_back(mu);
  out.problem.restitution.push_back(0);
}

bool MujocoScene::problem(OwnProblem& out) const {
  if (!scene_.trees.empty()) throw Unsupported("--save-problems: of free bodies only, and this scene has a robot");
  const int nv = model_->nv;
  out = {};
  std::vector<double> M(static_cast<std::size_t>(nv) * static_cast<std::size_t>(nv));
  mj_fullM(model_.get(), M.data(), data_->qM);
  for (int b = 0; b < static_cast<int>(bodies_); ++b) {
    auto block = out.problem.M.block(out.problem.M.add_block(6));
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i) block(i, j) = M[static_cast<std::size_t>((6 * b + i) * nv + 6 * b + j)];
  }
  for (std::size_t i = 0; i < v_before_.size(); ++i)
    out.problem.v_minus.push_back(v_before_[i] + model_->opt.timestep * data_->qacc_smooth[i]);
  out.v_plus.assign(data_->qvel, data_->qvel + nv);
  for (int c = 0; c < data_->ncon; ++c)
    if (data_->contact[c].efc_address >= 0) add_contact(data_->contact[c], out);
  out.law = mj_isPyramidal(model_.get()) ? "regularised convex, friction pyramid spanned by n +- mu t1, n +- mu t2"
                                         : "regularised convex, friction cone";
  out.offset_means =
      "-(J v + h a_ref): what MuJoCo would have J v+ be if R were 0; takes away depth and velocity over timeconst";
  return out.problem.nc() > 0;
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<MujocoScene>(scenario, setting);
  EngineWorld world;
  world.load = [scene](const Loads& loads) { scene->load(loads); };
  world.step = [scene](double h) { scene->step(h); };
  world.read = [scene](State& state) { scene->read(state); };
  world.contacts = [scene] { return scene->contacts(); };
  world.problem = [scene](OwnProblem& out) { return scene->problem(out); };
  return world;
}

Engine mujoco() {
  const double diamond = std::sqrt(0.5);
  // Where contacts are stiff, a gradient within the default tolerance is a momentum that is off by 1e-11.
  const Knobs stiff = {{"timeconst", 0}, {"solimp_min", 0.9999}, {"solimp_max", 0.9999}, {"tolerance", 1e-15}};
  Engine engine;
  engine.name = "mujoco";
  engine.summary =
      "MuJoCo: regularised convex contact, solved by Newton's method, conjugate gradients or Gauss and Seidel";
  engine.version = mj_versionString();
  engine.precision = "double";
  engine.package = "libmujoco-dev";
  engine.documentation = {
      "MuJoCo 2.2.2 documentation: Computation; Modeling (solver and contact parameters); XML reference",
      "mujoco/mjdata.h, mujoco/mjmodel.h of 2.2.2"};
  engine.shared = {"friction: of the pair (<pair>), or of every geom where all pairs have one law",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep: 2.2.2 has none; damping: none"};
  engine.apart = {"contacts are soft in the normal direction and in friction (solref, solimp)",
                  "no coefficient of restitution; an impact rebounds by what solref gives it",
                  "contact points: MuJoCo's own, of overlapping shapes",
                  "robots: damping of joints is implicit, their limits are soft"};
  engine.variants = {
      {"newton-elliptic", "Newton's method, friction cone", 1, {}},
      {"newton-pyramidal", "Newton's method, friction pyramid", diamond, {}},
      {"pgs-elliptic", "projected Gauss and Seidel, friction cone", 1, {}},
      {"cg-elliptic", "conjugate gradients, friction cone", 1, {}},
      {"newton-elliptic-stiff", "Newton's method, friction cone, contacts as stiff as they go", 1, stiff},
      {"newton-pyramidal-stiff", "the same with the pyramid", diamond, stiff}};
  engine.knobs = {{"iterations", 100, "", "of the solver a step at most", 1},
                  {"tolerance", 1e-8, "", "scaled improvement or gradient at which the solver stops"},
                  {"noslip_iterations", 0, "", "of a second solver that takes slip away", 0},
                  {"impratio", 1, "", "impedance of friction over that of the normal"},
                  {"timeconst", 0.02, "s", "solref: time in which depth is taken away; 0: 2 h"},
                  {"dampratio", 1, "", "solref: damping ratio"},
                  {"solimp_min", 0.9, "", "solimp: impedance without depth; 1 - this over this is the softness"},
                  {"solimp_max", 0.95, "", "solimp: impedance at depth solimp_width"},
                  {"solimp_width", 0.001, "m", "solimp: depth at which impedance is solimp_max"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::mujoco(), argc, argv); }
