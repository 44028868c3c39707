#pragma once
// The lane engine without its dress as a back end: one block of W particles, its tables and its memory. LanePhysics
// (lane_physics.h) runs it with W = 8; benchmarks and tests compare widths and instruction sets.

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/contact/hull_arrays.h"
#include "engine/contact/manifold.h"
#include "engine/contact/paths.h"
#include "engine/dynamics/topology.h"
#include "engine/lane_physics/kernel.h"
#include "engine/lane_physics/lane_memory.h"
#include "engine/lanes/isa.h"
#include "engine/model/fabrication.h"

namespace graze {

/// Where the state of a block lives; arrays [quantity][lane], as in BlockState.
struct StateRows {
  double *q, *v, *a, *X;
};

/// The kernel of an available instruction set. `lanes`: 8; for comparison also 1, and 4 with avx2.
const LaneKernel& kernel_of(Isa isa, int lanes = 8);

/// A contact model, and what its law has.
struct LaneContactModel {
  std::string name, help;  // help: what it does, in one line
  bool convex, compliant;
};
/// In the order of contact.model's choices; and their names.
const std::vector<LaneContactModel>& lane_contact_table();
const std::vector<std::string>& lane_contact_models();

class LaneEngine {
 public:
  /// All lanes hold `nominal` at q = 0 until they are started. `state` outlives this.
  LaneEngine(const Model& nominal, const LaneKernel& kernel, StateRows state);
  LaneEngine(const LaneEngine&) = delete;

  void start(int lane, const Model& model, const State& initial);

  /// A lane as it is: its numbers and what the step before has left. It fits engines of every width. What culling knows
  /// of distances is not in it, which changes no bit.
  struct Saved {
    struct Slot {
      int pair, slot;
      std::array<double, kKept> kept;
    };
    std::vector<double> rows;                              // the lane's numbers of each_kept_row(), in order
    std::vector<Slot> slots;                               // those of slot_impulse that are not zero
    std::vector<std::shared_ptr<const HeightGrid>> grids;  // its ground
  };
  Saved save(int lane) const;
  /// `saved` is of an engine that was made for a model with the same numbering.
  void restore(int lane, const Saved& saved);

  /// Before a step, of a lane: an impulse (N s, world axes) on a body at p_B (body frame, m); a point mass (kg) that
  /// becomes part of the body (lane_disturbance.cpp). No kernel knows of them: the velocity changes, and all that
  /// follows from it is settled anew.
  void push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W);
  void load(int lane, int body, const Vec3& p_B, double mass);

  /// tau: [na][lane]. `active`: bit l is lane l.
  void step(double h, unsigned active, const double* tau);
  void drive(double h, unsigned active, const DriveView& drive);
  /// Of actuated joint k after drive(), a row of lanes each: the torque of the step, and the demand.
  const double* torque(int k) const { return block_.servo + (kServoRows * k + 2) * kernel_.lanes; }
  const double* demand(int k) const { return block_.servo + (kServoRows * k + 3) * kernel_.lanes; }

  /// The lane's pairs of colliders are all measured in the next step, which costs time and must not change a bit.
  void forget_distances(int lane);

  const LaneBlock& block() const { return block_; }
  LaneBlock& block() { return block_; }
  int lanes() const { return kernel_.lanes; }
  /// Sweeps, residual (m/s), joint work (J) and what the brake has taken (m/s) of the last step; energy (J) after it.
  double sweeps(int lane) const { return block_.effort[lane]; }
  double residual(int lane) const { return block_.effort[kernel_.lanes + lane]; }
  double work(int lane) const { return block_.effort[2 * kernel_.lanes + lane]; }
  double braked(int lane) const { return block_.effort[3 * kernel_.lanes + lane]; }
  double energy(int lane) const { return block_.energy[lane]; }
  /// Lanes whose last step was not physical, as bits, and what the audit says of why.
  unsigned suspect() const { return block_.suspect; }
  /// The body that turns fastest, and how fast, rad/s.
  std::pair<int, double> fastest_spin(int lane) const;
  double energy_audit(AuditRow row, int lane) const { return block_.energy_audit[row * kernel_.lanes + lane]; }

 private:
  void number_contacts(const Model& nominal);
  void number_mimics(const Model& nominal);
  /// Sweeps, Newton's method or both.
  void choose_solver(const Model& nominal);
  /// Places all arrays behind `base`; returns how many doubles they take.
  std::size_t lay_out(double* base);
  void link_tables();  // what is the same for all lanes, which the block points to
  /// Calls f(rows, count) for all arrays of rows that a step reads and the step before it, or start(), has left.
  template <class F>
  void each_kept_row(const F& f) const;
  /// Of slot_impulse.
  double* kept_of(int pair, int slot) const {
    return block_.slot_impulse + static_cast<std::ptrdiff_t>(kKept) * (kSlots * pair + slot) * kernel_.lanes;
  }
  void load_bodies(int lane, const Model& model);
  void load_colliders(int lane, const Model& model);
  /// Heightfield number `field` of a lane.
  void set_ground(int field, int lane, std::shared_ptr<const HeightGrid> grid);
  double deep_overlap(const Model& model, const ColliderPair& pair, double mass, const Spring& spring) const;
  void load_law(int lane, const Model& model);
  void forget_contacts(int lane);
  void watch_joints();
  void make_room_for_contacts();
  void make_room_for_newton(std::size_t contacts);

  void show_pushes(double h, unsigned active);

  const LaneKernel& kernel_;
  Topology topology_;
  std::vector<double> pushed_;  // what push() has added to v since the last step, nv rows; empty: it never has
  unsigned pushed_lanes_ = 0;
  Paths paths_;
  std::vector<int> actuated_dof_, actuated_body_, watched_, near_, slot_used_, report_pair_;
  std::vector<unsigned> near_lanes_, report_lanes_, locked_;
  std::vector<MimicView> mimics_;
  std::vector<int> mimic_dofs_, whole_, newton_indices_;
  std::vector<JointPathView> joint_paths_;  // per degree of freedom
  std::vector<double> soonest_;
  // Of the heightfields among the colliders, in their order, for each lane: its own ground.
  std::vector<std::shared_ptr<const HeightGrid>> grids_;  // keeps alive what terrain_ points to
  std::vector<HeightView> terrain_;
  std::vector<HullArrays> hulls_;     // per collider; of meshes
  std::vector<HullView> hull_views_;  // per collider
  int axes_ = 0;                      // that are kept
  std::vector<ColliderView> colliders_;
  std::vector<PairView> pairs_;
  LaneMemory memory_, contacts_, contact_rows_, sweep_memory_, newton_, report_;
  LaneBlock block_{};
};

}  // namespace graze
