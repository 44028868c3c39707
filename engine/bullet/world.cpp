#include "engine/bullet/world.h"

#include <algorithm>
#include <cmath>

namespace graze::bullet {
namespace {

/// Pairs are watched this far ahead: what closes faster than kWatchSpeed overlaps for a step before it is seen.
constexpr double kWatchSpeed = 2.0;                      // m/s
constexpr double kLeastReach = 1e-3, kMostReach = 0.02;  // m

double reach(double h) { return std::clamp(kWatchSpeed * h, kLeastReach, kMostReach); }

}  // namespace

World::World(const Model& model, const State& initial, HullCache& hulls)
    : World(std::make_shared<const Model>(model), initial, hulls) {}

World::World(std::shared_ptr<const Model> model, const State& initial, HullCache& hulls)
    : shared_model_(std::move(model)),
      model_(*shared_model_),
      forest_(model_, initial),
      solids_(make_solids(model_, forest_, hulls)),
      narrow_phase_(model_, solids_),
      contact_set_(model_, solids_),
      solver_(make_contact_solver(model_.contact_model)),
      energy_(model_, forest_) {
  for (int i = 0; i < static_cast<int>(model_.bodies.size()); ++i) {
    const Body& body = model_.bodies[i];
    if (JointRows::needed(body)) joint_rows_.push_back(std::make_unique<JointRows>(body, forest_, i));
    if (body.mimics >= 0) mimic_rows_.push_back(std::make_unique<MimicRow>(model_, forest_, i));
  }
  joint_force_.setZero(model_.nv);
}

World::World(const Saved& saved, HullCache& hulls) : World(saved.model, saved.state, hulls) {
  forest_.restore(saved.raw);
  place_solids(solids_, forest_);
  narrow_phase_.restore(saved.points);
  energy_.restore(saved.audit);
  contacts_ = saved.contacts;
  fault_ = saved.fault;
}

namespace {

std::shared_ptr<const Model> loaded(const Model& model, int body, const Vec3& p_B, double mass) {
  auto out = std::make_shared<Model>(model);
  add_point_mass(out->bodies.at(static_cast<std::size_t>(body)), p_B, mass);
  return out;
}

}  // namespace

World::World(const World& other, int body, const Vec3& p_B, double mass, HullCache& hulls)
    : World(loaded(other.model_, body, p_B, mass), {other.forest_.q(), other.forest_.v()}, hulls) {
  narrow_phase_.restore(other.narrow_phase_.memory());
  EnergyWatch::Audit audit = energy_.audit();  // of the new masses; what has been is kept
  audit.created = other.energy_.audit().created;
  audit.peak_kinetic = std::max(audit.peak_kinetic, other.energy_.audit().peak_kinetic);
  energy_.restore(audit);
  contacts_ = other.contacts_;
  fault_ = other.fault_;
}

Vec3 World::velocity_at(const Push& push) const {
  return forest_.twist(push.body).at(forest_.pose(push.body).linear() * push.p_B);
}

World::Saved World::save() const {
  return {shared_model_, {forest_.q(), forest_.v()}, forest_.raw(), narrow_phase_.memory(), energy_.audit(), contacts_,
          fault_};
}

const ContactSolver* World::solve(double h) {
  active_rows_.clear();
  for (const auto& row : mimic_rows_) active_rows_.push_back(row.get());
  for (const auto& rows : joint_rows_) {
    rows->clear();
    if (rows->active(h)) active_rows_.push_back(rows.get());
  }
  if (contact_set_.manifolds().empty() && active_rows_.empty()) return nullptr;
  for (Tree& tree : forest_.trees()) tree.body->setCompanionId(-1);  // no place in the solver's arrays yet
  solver_->solve(contact_set_.manifolds(), active_rows_, !mimic_rows_.empty(), h, narrow_phase_.dispatcher());
  for (std::size_t i = mimic_rows_.size(); i < active_rows_.size(); ++i) {
    static_cast<JointRows*>(active_rows_[i])->after_solve();
  }
  return solver_.get();
}

void World::step(double h, const Eigen::VectorXd& tau) {
  v_before_ = forest_.v();
  for (int k = 0; k < model_.na(); ++k) joint_force_[model_.bodies[model_.actuated[k]].v] = tau[k];
  contact_set_.prepare(narrow_phase_.detect(reach(h)), forest_, h);
  forest_.set_forces(joint_force_);
  double push_work = 0;  // J, the most that the pushes can do
  std::vector<double> power;
  for (const Push& push : pushes_) {
    forest_.add_force(push.body, push.p_B, push.impulse_W / h);
    power.push_back(push.impulse_W.dot(velocity_at(push)));
  }
  forest_.accelerate(h);
  forest_.damp(h);
  const ContactSolver* used = solve(h);
  forest_.apply_impulses();
  forest_.refresh_twists();
  contact_set_.read(used, forest_, h);
  forest_.move(h);
  forest_.refresh();
  for (std::size_t i = 0; i < pushes_.size(); ++i) {
    push_work += std::max(power[i], pushes_[i].impulse_W.dot(velocity_at(pushes_[i])));
  }
  pushes_.clear();
  place_solids(solids_, forest_);
  contact_set_.place(contacts_);
  StepInput input;
  input.h = h;
  input.work =
      h * joint_force_.cwiseProduct(v_before_).cwiseMax(joint_force_.cwiseProduct(forest_.v())).sum() + push_work;
  for (const Contact& contact : contacts_) input.contact_impulse += contact.normal_impulse();
  for (const auto& rows : joint_rows_) input.limit_impulse += rows->limit_impulse();
  for (const auto& row : mimic_rows_) input.limit_impulse += std::abs(row->impulse());
  fault_ = energy_.check(forest_, input);
}

}  // namespace graze::bullet
