#pragma once
// One particle in Bullet: trees, solids, contact detection and solver, stepped by hand in the order
//   detect at q  ->  v += h a(q, v, tau)  ->  impulses (contacts, joint limits, dry friction)  ->  q += h v+
// (semi-implicit Euler). btMultiBodyDynamicsWorld does the same around the same parts, but with islands, sleeping,
// predictive transforms and one collider per link; here every pair, order and number is the Model's.

#include <memory>
#include <optional>
#include <string>

#include "engine/bullet/contacts.h"
#include "engine/bullet/energy.h"
#include "engine/bullet/joint_rows.h"
#include "engine/bullet/mimic_row.h"

namespace graze::bullet {

class World {
 public:
  World(const Model& model, const State& initial, HullCache& hulls);

  /// A world as it is between two steps: the particle, and all that is not made anew in each step.
  struct Saved {
    std::shared_ptr<const Model> model;
    State state;  // q and v as they are shown
    Forest::Raw raw;
    std::vector<NarrowPhase::Memory> points;
    EnergyWatch::Audit audit;
    std::vector<Contact> contacts;
    std::optional<std::string> fault;
  };
  Saved save() const;
  World(const Saved& saved, HullCache& hulls);

  /// tau: force of each actuator, in the order of Model::actuated.
  void step(double h, const Eigen::VectorXd& tau);
  const Forest& forest() const { return forest_; }
  const Model& model() const { return *shared_model_; }
  const std::vector<Contact>& contacts() const { return contacts_; }
  const std::optional<std::string>& fault() const { return fault_; }

 private:
  World(std::shared_ptr<const Model> model, const State& initial, HullCache& hulls);
  /// Contact impulses and joint rows; the solver that was used, or null if nothing was near.
  const ContactSolver* solve(double h);

  const std::shared_ptr<const Model> shared_model_;  // with what is saved of this world
  const Model& model_;
  Forest forest_;
  std::vector<Solid> solids_;
  NarrowPhase narrow_phase_;
  ContactSet contact_set_;
  std::unique_ptr<ContactSolver> solver_;
  std::vector<std::unique_ptr<JointRows>> joint_rows_;
  std::vector<std::unique_ptr<MimicRow>> mimic_rows_;
  std::vector<btMultiBodyConstraint*> active_rows_;  // first those of mimic_rows_
  EnergyWatch energy_;
  std::vector<Contact> contacts_;
  std::optional<std::string> fault_;
  Eigen::VectorXd joint_force_, v_before_;  // nv
};

}  // namespace graze::bullet
