#include "engine/lane_physics/lane_engine.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <new>

#include "engine/contact/collide.h"
#include "engine/contact/constraint.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/lane_physics/culling.h"
#include "engine/lanes/block.h"
#include "engine/lanes/scalar.h"
#include "engine/model/newton_limit.h"

namespace graze {

namespace {

static_assert(static_cast<int>(ShapeKind::box) == kBoxKind && static_cast<int>(ShapeKind::sphere) == kSphereKind &&
              static_cast<int>(ShapeKind::plane) == kPlaneKind);

constexpr double kFar = 1e9;  // m, extent of what has none

/// Writes the doubles of a kernel struct into one lane of rows.
template <class S>
void scatter(const S& numbers, double* rows, int lanes, int lane) {
  double flat[sizeof(S) / sizeof(double)];
  std::memcpy(flat, &numbers, sizeof(S));
  for (std::size_t i = 0; i < std::size(flat); ++i) rows[i * lanes + lane] = flat[i];
}

/// Half edges of a box about the frame's origin (a mesh's: its hull's centre) that holds the shape.
Vec3 extent_of(const Shape& shape, const HullArrays& hull) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return 0.5 * s;
    case ShapeKind::sphere:
      return Vec3::Constant(s.x());
    case ShapeKind::cylinder:
      return {s.x(), s.x(), 0.5 * s.y()};
    case ShapeKind::capsule:
      return {s.x(), s.x(), 0.5 * s.y() + s.x()};
    case ShapeKind::mesh: {
      Vec3 extent = Vec3::Zero();
      for (int k = 0; k < hull.count(); ++k) extent = extent.cwiseMax(hull.corner(k).cwiseProduct(s).cwiseAbs());
      return extent;
    }
    case ShapeKind::heightfield: {
      double highest = 0;
      for (double height : shape.grid->height) highest = std::max(highest, std::abs(height * s.z()));
      return {0.5 * s.x(), 0.5 * s.y(), highest + 1};  // 1 m: what has sunk deeper is not pushed out again
    }
    case ShapeKind::plane:
      break;
  }
  return Vec3::Constant(kFar);
}

/// Sweeps before newton_tree.h, where it comes first: our choice, found as kDeepTree was.
constexpr int kTreeAfter = 4;

/// Whether a ball and a box are bounds that leave room for a better one, which culling.h has.
bool is_flat(ShapeKind kind) {
  return kind == ShapeKind::box || kind == ShapeKind::cylinder || kind == ShapeKind::capsule;
}

double radius_of(const Shape& shape, const HullArrays& hull) {
  double radius = 0;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return shape.size.x();
    case ShapeKind::cylinder:
      return pinned::hypot(shape.size.x(), 0.5 * shape.size.y());
    case ShapeKind::capsule:
      return shape.size.x() + 0.5 * shape.size.y();
    case ShapeKind::mesh:
      for (int k = 0; k < hull.count(); ++k) radius = std::max(radius, hull.corner(k).cwiseProduct(shape.size).norm());
      return radius;
    default:
      return extent_of(shape, hull).norm();
  }
}

/// Law of a contact model by its name. Throws InputError for one that this engine does not know.
ContactLawT<double> law_of(const Model& model) {
  ContactLawT<double> law{};
  const std::vector<std::string>& names = lane_contact_models();
  const LaneContactModel& chosen = lane_contact_table()[contact_model_index(model.contact_model, "lanes", names)];
  law.convex = chosen.convex ? 1 : 0;
  law.compliance = chosen.compliant ? 1 : 0;
  law.correction = 0.2;
  law.recovery = 0.1;
  return law;
}

}  // namespace

const std::vector<LaneContactModel>& lane_contact_table() {
  static const std::vector<LaneContactModel> table = {
      {"complementarity", "rigid contact, Coulomb's cone (Stewart-Trinkle, Anitescu-Potra)", false, false},
      {"complementarity_free", "rigid contact by maximal dissipation: convex, what slides lifts a little (Anitescu)",
       true, false},
      {kCompliant, "the first with a spring and damper in each contact, integrated implicitly", false, true}};
  return table;
}

const std::vector<std::string>& lane_contact_models() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const LaneContactModel& model : lane_contact_table()) out.push_back(model.name);
    return out;
  }();
  return names;
}

const LaneKernel& kernel_of(Isa isa, int lanes) {
  const LaneKernel* kernel = GRAZE_KERNEL(isa, find_lane_kernel, lanes);
  assert(kernel != nullptr);
  return *kernel;
}

LaneEngine::LaneEngine(const Model& nominal, const LaneKernel& kernel, StateRows state)
    : kernel_(kernel), topology_(nominal), paths_(topology_.view(), graze::mimic_dofs(nominal, topology_.view())) {
  for (int body : nominal.actuated) actuated_dof_.push_back(nominal.bodies[body].v);
  actuated_body_ = nominal.actuated;
  locked_.resize(nominal.bodies.size());
  number_contacts(nominal);
  number_mimics(nominal);
  choose_solver(nominal);
  memory_.grow(lay_out(nullptr));
  lay_out(memory_.data());
  block_.topology = topology_.view();
  block_.q = state.q;
  block_.v = state.v;
  block_.a = state.a;
  block_.X = state.X;
  State rest{Eigen::VectorXd::Zero(nominal.nq), Eigen::VectorXd::Zero(nominal.nv)};
  for (const Body& body : nominal.bodies) {
    if (body.type == JointType::floating) rest.q[body.q] = 1;
  }
  for (int lane = 0; lane < kernel_.lanes; ++lane) start(lane, nominal, rest);
}

void LaneEngine::number_contacts(const Model& nominal) {
  const auto is_ground = [](const Collider& one) { return one.shape.kind == ShapeKind::heightfield; };
  const auto fields =
      static_cast<std::size_t>(std::count_if(nominal.colliders.begin(), nominal.colliders.end(), is_ground));
  grids_.resize(fields * kernel_.lanes);
  terrain_.resize(fields * kernel_.lanes);
  const HeightView* next_ground = terrain_.data();
  hulls_.reserve(nominal.colliders.size());
  hull_views_.reserve(nominal.colliders.size());
  for (const Collider& collider : nominal.colliders) {
    const Shape& shape = collider.shape;
    const HeightView* terrain = nullptr;
    if (is_ground(collider)) {
      terrain = next_ground;  // start() fills it in
      next_ground += kernel_.lanes;
    }
    const bool mesh = shape.kind == ShapeKind::mesh;
    hulls_.push_back(mesh ? HullArrays(*hull_of(shape)) : HullArrays());
    hull_views_.push_back(hulls_.back().view());
    colliders_.push_back(
        {static_cast<int>(shape.kind), collider.body, false, terrain, mesh ? &hull_views_.back() : nullptr});
  }
  for (const ColliderPair& pair : nominal.pairs) {
    const int a = nominal.colliders[pair.a].body, b = nominal.colliders[pair.b].body;
    const ShapeKind kind_a = nominal.colliders[pair.a].shape.kind, kind_b = nominal.colliders[pair.b].shape.kind;
    colliders_[pair.a].used = colliders_[pair.b].used = true;
    pairs_.push_back({pair.a, pair.b, paths_.add(a, b), is_hull_pair(kind_a, kind_b) ? axes_++ : -1,
                      is_flat(kind_a) && is_flat(kind_b)});
  }
  near_.resize(pairs_.size());
  slot_used_.resize(pairs_.size());
  near_lanes_.resize(pairs_.size());
  soonest_.resize(pairs_.size() + kLanes);  // kernels read rows of it
}

void LaneEngine::number_mimics(const Model& nominal) {
  const TopologyView t = topology_.view();
  mimic_dofs_ = graze::mimic_dofs(nominal, t);
  for (int dof = 0; dof < t.nv; ++dof) joint_paths_.push_back(paths_.joint(dof));
  int first = t.bodies;  // of the trees on the world that mimic rows couple: they are one robot's
  for (std::size_t i = 0; i < nominal.bodies.size(); ++i) {
    const Body& body = nominal.bodies[i];
    whole_.push_back(t.top[i]);
    if (body.mimics < 0) continue;
    const Body& other = nominal.bodies[body.mimics];
    mimics_.push_back({static_cast<int>(i), body.mimics, body.q, other.q, body.v, other.v});
    first = std::min({first, t.top[i], t.top[body.mimics]});
  }
  std::vector<bool> coupled(nominal.bodies.size());
  for (const MimicView& mimic : mimics_) coupled[t.top[mimic.body]] = coupled[t.top[mimic.other_body]] = true;
  for (int& top : whole_) {
    if (coupled[top]) top = first;
  }
}

void LaneEngine::choose_solver(const Model& nominal) {
  SolverSettings& settings = block_.settings;
  const bool sweeps_only = nominal.contact_solver == ContactSolver::sweeps;
  if (nominal.contact_solver == ContactSolver::newton) settings.newton_after = 1;
  if (is_deep_tree(nominal) && !sweeps_only) {
    settings.tree_after = std::min(kTreeAfter, settings.newton_after);
    settings.newton_after = std::max(settings.newton_after, settings.tree_after + 1);
  }
  if (sweeps_only || static_cast<std::size_t>(nominal.nv) > kMostNewtonDofs)
    settings.newton_after = settings.most_sweeps;
}

std::size_t LaneEngine::lay_out(double* base) {
  const TopologyView t = topology_.view();
  std::size_t used = 0;
  const auto rows = [&](int count) {
    double* place = base ? base + used : nullptr;
    used += (static_cast<std::size_t>(count) * kernel_.lanes + 7) / 8 * 8;
    return place;
  };
  LaneBlock& b = block_;
  const int nb = t.bodies, nc = static_cast<int>(colliders_.size()), np = static_cast<int>(pairs_.size());
  int chains = 0;
  for (int i = 0; i < nb; ++i) chains += 2 * joint_paths_[t.v[i]].count;
  b.body = rows(nb * kernel_.body_rows);
  b.gravity = rows(3);
  b.law = rows(kernel_.law_rows);
  b.limit = rows(3 * nb);
  const int mimics = static_cast<int>(mimics_.size());
  b.mimic = rows(2 * mimics);
  b.mimic_rows = rows(mimics * (2 * static_cast<int>(mimic_dofs_.size()) + kMimicRows));
  b.energy = rows(1);
  b.energy_audit = rows(kAuditRows);
  b.effort = rows(4);
  b.measured = rows(4);
  b.motion = rows(nb * kernel_.motion_rows);
  b.origin = rows(3 * nb);
  b.balance = rows(nb * kernel_.balance_rows);
  b.M = rows(t.row[t.nv]);
  b.inverse_D = rows(t.nv);
  b.bias = rows(t.nv);
  b.z = rows(t.nv);
  b.dz = rows(t.nv);
  b.free = rows(t.nv);
  b.scratch = rows(3 * std::max(t.nv, nb));
  b.push = rows(t.nv + 3 * nb);
  b.joint_impulse = rows(3 * nb);
  b.joint_rows = rows(chains);
  const int na = static_cast<int>(actuated_dof_.size());
  int driven = 0;
  for (const int dof : actuated_dof_) driven += 2 * joint_paths_[dof].count;
  b.servo = rows(kServoRows * na);
  b.servo_rows = rows(driven);
  b.M_kept = rows(t.row[t.nv]);
  b.diagonal = rows(t.nv);
  b.joints = base ? base + used : nullptr;
  used += static_cast<std::size_t>(nb + na) * kernel_.joint_doubles;
  b.collider = rows(nc * kColliderRows);
  b.pose = rows(12 * nc);
  b.speed = rows(nc);
  b.pair = rows(kPairRows * np);
  b.slot_impulse = rows(kKept * kSlots * np);
  b.travel = rows(2);
  b.due = rows(np);
  b.axis = rows(3 * axes_);
  link_tables();
  return used;
}

void LaneEngine::link_tables() {
  LaneBlock& b = block_;
  b.na = static_cast<int>(actuated_dof_.size());
  b.actuated_body = actuated_body_.data();
  b.locked = locked_.data();
  b.actuated_dof = actuated_dof_.data();
  b.collider_count = static_cast<int>(colliders_.size());
  b.colliders = colliders_.data();
  b.pair_count = static_cast<int>(pairs_.size());
  b.pairs = pairs_.data();
  b.paths = paths_.views().data();
  b.joint_paths = joint_paths_.data();
  b.mimic_count = static_cast<int>(mimics_.size());
  b.mimics = mimics_.data();
  b.mimic_dof_count = static_cast<int>(mimic_dofs_.size());
  b.mimic_dofs = mimic_dofs_.data();
  b.whole = whole_.data();
  b.slot_used = slot_used_.data();
  b.soonest = soonest_.data();
  b.near = near_.data();
  b.near_lanes = near_lanes_.data();
}

void LaneEngine::load_bodies(int lane, const Model& model) {
  const int W = kernel_.lanes;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    scatter(body_numbers(body), block_.body + i * kernel_.body_rows * W, W, lane);
    double* limit = block_.limit + 3 * i * W;
    limit[lane] = body.lower;
    limit[W + lane] = body.upper;
    limit[2 * W + lane] = body.friction;
  }
  for (std::size_t i = 0; i < mimics_.size(); ++i) {
    const Body& body = model.bodies[mimics_[i].body];
    scatter(std::array<double, 2>{body.multiplier, body.offset}, block_.mimic + 2 * i * W, W, lane);
  }
  const double mass = moving_mass(model);
  for (int i = 0; i < kAuditRows; ++i) block_.energy_audit[i * W + lane] = 0;
  block_.energy_audit[kLift * W + lane] = std::max(kCreatedLift * mass * model.gravity.norm(), kCreatedLeast);
  for (int k = 0; k < 3; ++k) block_.gravity[k * W + lane] = model.gravity[k];
}

void LaneEngine::set_ground(int field, int lane, std::shared_ptr<const HeightGrid> grid) {
  const std::size_t at = static_cast<std::size_t>(field) * kernel_.lanes + lane;
  terrain_[at] = {grid->nx, grid->ny, grid->height.data()};
  grids_[at] = std::move(grid);
}

void LaneEngine::load_colliders(int lane, const Model& model) {
  const int W = kernel_.lanes;
  int field = 0;
  for (std::size_t i = 0; i < model.colliders.size(); ++i) {
    const Collider& collider = model.colliders[i];
    double* rows = block_.collider + i * kColliderRows * W;
    const HullArrays& hull = hulls_[i];
    scatter(to_kernel(hull.placed(collider.X_BG, collider.shape.size)), rows + kPose * W, W, lane);
    scatter(to_kernel(collider.shape.size), rows + kSize * W, W, lane);
    scatter(to_kernel(extent_of(collider.shape, hull)), rows + kExtent * W, W, lane);
    rows[kRadius * W + lane] = radius_of(collider.shape, hull);
    for (int k : {0, 4, 8}) block_.pose[(12 * i + k) * W + lane] = 1;
    if (collider.shape.kind == ShapeKind::heightfield) set_ground(field++, lane, collider.shape.grid);
  }
  const double mass = moving_mass(model);
  for (std::size_t i = 0; i < model.pairs.size(); ++i) {
    const ColliderPair& pair = model.pairs[i];
    const Spring spring = default_spring(mass, pair.spring);
    double* rows = block_.pair + kPairRows * i * W;
    scatter(std::array<double, kPairRows>{pair.friction, pair.restitution, spring.stiffness, spring.damping,
                                          deep_overlap(model, pair, mass, spring)},
            rows, W, lane);
  }
}

/// From which overlap on a pair is pushed out, m. Where no floating body lies between the two, a joint may stand so
/// that any speed of recovery would have it whirl about, or hold the two in each other: then all of it, but for
/// rounding. Else never: what impulses give there is at most the recovery speed of the whole robot. Springs of links
/// are left alone as far as the robot's weight presses them, twice over; links that are deeper in each other began so.
double LaneEngine::deep_overlap(const Model& model, const ColliderPair& pair, double mass, const Spring& spring) const {
  constexpr double kRounding = 1e-6, kNever = 1e300, kWeights = 2, kGravity = 9.81;
  const TopologyView t = topology_.view();
  const int a = model.colliders[pair.a].body, b = model.colliders[pair.b].body;
  const int base_a = a < 0 ? -1 : t.root[a], base_b = b < 0 ? -1 : t.root[b];
  if (base_a != base_b) return kNever;
  if (law_of(model).compliance == 0) return kRounding;
  return a >= 0 && b >= 0 ? kWeights * mass * kGravity / spring.stiffness : kNever;
}

void LaneEngine::load_law(int lane, const Model& model) { scatter(law_of(model), block_.law, kernel_.lanes, lane); }

void LaneEngine::forget_contacts(int lane) {
  const int W = kernel_.lanes;
  const auto clear = [&](double* rows, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) rows[i * W + lane] = 0;
  };
  clear(block_.slot_impulse, kKept * kSlots * pairs_.size());
  clear(block_.joint_impulse, 3 * block_.topology.bodies);
  clear(block_.effort, 4);
  clear(block_.servo, static_cast<std::size_t>(kServoRows) * block_.na);
  forget_distances(lane);
  block_.fresh |= 1u << lane;
}

void LaneEngine::forget_distances(int lane) {
  constexpr double kNow = -1e300;
  for (std::size_t i = 0; i < pairs_.size(); ++i) block_.due[i * kernel_.lanes + lane] = kNow;
  for (int i = 0; i < 3 * axes_; ++i) block_.axis[i * kernel_.lanes + lane] = 0;  // says nothing of any pair
  std::fill(soonest_.begin(), soonest_.end(), kNow);
}

void LaneEngine::watch_joints() {
  const int W = kernel_.lanes;
  std::vector<int> watched;
  for (int i = 0; i < block_.topology.bodies; ++i) {
    bool some = false;
    for (int lane = 0; lane < W; ++lane) {
      const double* limit = block_.limit + 3 * i * W + lane;
      some = some || std::isfinite(limit[0]) || std::isfinite(limit[W]) || limit[2 * W] > 0;
    }
    if (some) watched.push_back(i);
  }
  watched_ = std::move(watched);
  block_.watched_count = static_cast<int>(watched_.size());
  block_.watched_body = watched_.data();
}

void LaneEngine::start(int lane, const Model& model, const State& initial) {
  const int W = kernel_.lanes;
  assert(lane < W && initial.q.size() == block_.topology.nq && initial.v.size() == block_.topology.nv);
  load_bodies(lane, model);
  load_colliders(lane, model);
  load_law(lane, model);
  forget_contacts(lane);
  watch_joints();
  for (int i = 0; i < initial.q.size(); ++i) block_.q[i * W + lane] = initial.q[i];
  for (int i = 0; i < initial.v.size(); ++i) block_.v[i * W + lane] = initial.v[i], block_.a[i * W + lane] = 0;
  for (const Body& body : model.bodies) {
    if (body.type != JointType::floating) continue;
    const double length = initial.q.segment<4>(body.q).norm();
    for (int k = 0; k < 4; ++k) block_.q[(body.q + k) * W + lane] /= length;
  }
  kernel_.settle(block_);
}

std::pair<int, double> LaneEngine::fastest_spin(int lane) const {
  constexpr std::size_t kSpin = offsetof(MotionT<double>, V.w) / sizeof(double);
  std::pair<int, double> out{0, 0};
  for (int i = 0; i < block_.topology.bodies; ++i) {
    const double* w = block_.motion + (i * kernel_.motion_rows + kSpin) * kernel_.lanes + lane;
    const double speed =
        std::sqrt(w[0] * w[0] + w[kernel_.lanes] * w[kernel_.lanes] + w[2 * kernel_.lanes] * w[2 * kernel_.lanes]);
    if (speed > out.second) out = {i, speed};
  }
  return out;
}

void LaneEngine::make_room_for_contacts() {
  std::size_t rows = 0;
  for (int i = 0; i < block_.near_count; ++i) rows += kSlots * 6 * paths_.views()[pairs_[near_[i]].path].count;
  const std::size_t count = static_cast<std::size_t>(kSlots) * block_.near_count;
  contacts_.grow(count * kernel_.contact_doubles);
  contact_rows_.grow(rows * kernel_.lanes);
  sweep_memory_.grow(count * kSweepMemory * kernel_.lanes);
  report_.grow(count * kContactRows * kernel_.lanes);
  if (report_pair_.size() < count) {
    report_pair_.resize(count);
    report_lanes_.resize(count);
  }
  block_.contacts = contacts_.data();
  block_.contact_rows = contact_rows_.data();
  block_.sweep_memory = sweep_memory_.data();
  block_.report = report_.data();
  block_.report_pair = report_pair_.data();
  block_.report_lanes = report_lanes_.data();
  make_room_for_newton(count);
}

void LaneEngine::make_room_for_newton(std::size_t contacts) {
  const bool by_tree = block_.settings.tree_after < block_.settings.newton_after;
  const bool by_matrix = block_.settings.newton_after < block_.settings.most_sweeps;
  if (!by_tree && !by_matrix) return;
  const auto nv = static_cast<std::size_t>(block_.topology.nv),
             bodies = static_cast<std::size_t>(block_.topology.bodies);
  const std::size_t joints = bodies + actuated_dof_.size();
  const std::size_t numbers = by_matrix ? (newton_numbers(nv, contacts, joints) + 7) / 8 * 8 : 0;
  newton_.grow(numbers +
               (by_tree ? tree_rows(nv, bodies, contacts, joints) * static_cast<std::size_t>(kernel_.lanes) : 0));
  const std::size_t indices = by_matrix ? newton_indices(nv, contacts, joints) : 0;
  if (newton_indices_.size() < indices) newton_indices_.resize(indices + indices / 2);
  block_.newton = {newton_.data(), newton_indices_.data(), newton_.data() + numbers};
}

void LaneEngine::step(double h, unsigned active, const double* tau) {
  drive(h, active, {tau, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr});
}

void LaneEngine::drive(double h, unsigned active, const DriveView& drive) {
  kernel_.begin(block_, h, active, drive);
  make_room_for_contacts();
  kernel_.finish(block_, h, active, drive);
  if (pushed_lanes_ != 0) show_pushes(h, active);
}

}  // namespace graze
