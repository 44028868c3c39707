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

  /// As another, with a point mass (kg) at p_B (body frame, m) on a body: Bullet's trees are made anew, since their
  /// frames are at the centres of mass.
  World(const World& other, int body, const Vec3& p_B, double mass, HullCache& hulls);

  /// An impulse on a body, which acts evenly within the next step.
  struct Push {
    int body;
    Vec3 p_B;        // body frame, m
    Vec3 impulse_W;  // world axes, N s
  };
  void push(const Push& push) { pushes_.push_back(push); }

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
  Vec3 velocity_at(const Push& push) const;

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
  std::vector<Push> pushes_;                // of the next step
};

}  // namespace graze::bullet
