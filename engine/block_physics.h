#pragma once
// The block interface of every back end: W particles start, step and report together, arrays [quantity][lane]. Which
// back ends there are, and how to make one, stands in physics.h.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/contact_record.h"
#include "engine/lanes/block.h"
#include "engine/lanes/contact_rows.h"
#include "engine/model/fabrication.h"

namespace graze {

/// One contact point of a block after a step, in the lanes where it is.
struct ContactPoint {
  int a = 0, b = 0;              // colliders, a < b
  LaneMask lanes;                // where `rows` is valid
  const double* rows = nullptr;  // [ContactRow][kLanes], until the next step, start or restore

  double operator()(ContactRow row, int lane) const { return rows[row * kLanes + lane]; }
  const double* row(int i) const { return rows + i * kLanes; }
  /// Lanes in which the point touches, as Contact::touching().
  LaneMask touching() const;
  Contact contact(int lane) const;
};

/// State of a block after a step, all lanes.
struct BlockState {
  BlockArray q;  // nq rows, see Model
  BlockArray v;  // nv rows
  BlockArray a;  // nv rows: (v - v before the step) / h; zero at start
  BlockArray X;  // 12 rows per body: world rotation R_WB row by row (9), then position p_WB (3)

  Mat3 rotation(int body, int lane) const;
  Vec3 position(int body, int lane) const { return X.vec3(12 * body + 9, lane); }
  Pose pose(int body, int lane) const;  // body -1: identity
};

/// What drives the actuated joints during one physics step, na rows each. With q and v of the step's end, the torque is
///   tau + kp (q_ref - q) + kd (v_ref - v),   held between `lower` and `upper`.
/// Where `prescribed` is not 0 the joint moves to q_ref within the step, v = (q_ref - q_begin) / h, by whatever torque
/// between `lower` and `upper` that takes (§8.4); beyond it the bound is applied. Errors of the encoders are contained
/// in q and v.
struct Drive {
  BlockArray tau, q, v, kp, kd, lower, upper, prescribed;
  explicit Drive(int na = 0) : tau(na), q(na), v(na), kp(na), kd(na), lower(na), upper(na), prescribed(na) {}
};

/// What came out of a Drive, na rows each: the torque of the step, and the demand, which is the torque without bounds.
struct DriveResult {
  BlockArray torque, demand;
  explicit DriveResult(int na = 0) : torque(na), demand(na) {}
};

/// What the contact solver did in one step of a lane.
struct SolverEffort {
  double sweeps = 0;         // 0: the back end does not tell
  double residual = 0;       // largest change of a constraint's velocity in the last sweep, m/s or rad/s
  bool unconverged = false;  // it ended at its bound, with a residual above its tolerance
  double braked = 0;         // what was taken of impulses because they would have given energy, m/s or rad/s
};

/// A lane as it was after a step: all that its further way depends on. What is in it is the business of the back end
/// that saved it. It never changes and refers to no block, so that any number of blocks and threads may go on from it.
class SavedLane {
 public:
  /// `back_end`: its name; `numbering`: numbering_of() the model that its blocks were made for.
  SavedLane(std::string back_end, std::uint64_t numbering) : back_end_(std::move(back_end)), numbering_(numbering) {}
  virtual ~SavedLane() = default;
  const std::string& back_end() const { return back_end_; }
  std::uint64_t numbering() const { return numbering_; }

 private:
  std::string back_end_;
  std::uint64_t numbering_;
};

/// A number for all that the particles of one campaign have in common: bodies, joints, colliders and pairs with their
/// order, meshes and terrain. Masses, sizes, limits, poses and ground that is drawn, which particles may have of their
/// own, do not count.
std::uint64_t numbering_of(const Model& model);

/// A back end. One object simulates one block at a time and belongs to one thread.
class BlockPhysics {
 public:
  virtual ~BlockPhysics() = default;

  /// Puts a fresh particle into a lane. The trace that follows depends on nothing that the object did before.
  virtual void start(int lane, const Particle& particle) = 0;
  /// Advances the active lanes by h seconds under the joint torques (or forces) tau [na][lane], constant over the step.
  /// Lanes that are not active keep their state.
  virtual void step(double h, LaneMask active, const BlockArray& tau) = 0;

  /// Whether drive() may be called: servos and prescribed motion are part of the back end's solve.
  virtual bool solves_drives() const { return false; }
  /// As step(), under servos. Lanes that are not active keep their state and their columns of `result`.
  virtual void drive(double h, LaneMask active, const Drive& drive, DriveResult& result);
  /// Of the last step; zero where the back end does not tell.
  virtual SolverEffort effort(int lane) const;

  /// Before a step: gives a body an impulse (N s, world axes) at p_B (body frame, m), which acts within that step. The
  /// state may show it at once or after the step. Costs nothing where it is not called. Throws std::logic_error, as
  /// load() does, where a back end cannot do it.
  virtual void push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W);
  /// Before a step: a point mass (kg) at p_B becomes part of a body. Velocities stay as they are.
  virtual void load(int lane, int body, const Vec3& p_B, double mass);

  /// The lane as it is. A particle must have been started or restored in it.
  virtual std::shared_ptr<const SavedLane> save(int lane) const;
  /// Puts a lane back as it was saved, in this or another lane of this or another block: state, contacts and fault are
  /// shown as they were then, and it goes on with the same bits, whatever the object did before. Throws
  /// std::invalid_argument, and changes nothing, if another back end saved it or its blocks are made for other models;
  /// save() and restore() throw std::logic_error where a back end cannot do it.
  virtual void restore(int lane, const SavedLane& saved);

  const BlockState& state() const { return state_; }
  /// Contacts and near points of the last step, all lanes; valid until the next step, start or restore. Those of one
  /// lane stand in an order that depends on its particle alone.
  const std::vector<ContactPoint>& contact_points() const { return points_; }
  /// Those of one lane (slow: copies).
  std::vector<Contact> contacts(int lane) const;
  /// Why the lane's state is no longer physical (non-finite, energy out of nothing), or nothing.
  const std::optional<std::string>& fault(int lane) const { return fault_[lane]; }

 protected:
  /// `saved` as what this back end saves. Throws std::invalid_argument if it is none of `back_end` and `numbering`.
  template <class Own>
  static const Own& own(const SavedLane& saved, const std::string& back_end, std::uint64_t numbering) {
    check_own(saved, back_end, numbering);
    return dynamic_cast<const Own&>(saved);
  }

  BlockState state_;
  std::vector<ContactPoint> points_;
  std::array<std::optional<std::string>, kLanes> fault_;

 private:
  static void check_own(const SavedLane& saved, const std::string& back_end, std::uint64_t numbering);
};

/// Contact points from lists per lane, for back ends that have no lanes.
class ContactLists {
 public:
  std::vector<Contact>& operator[](int lane) { return lists_[lane]; }
  const std::vector<Contact>& operator[](int lane) const { return lists_[lane]; }
  /// The points, which are valid until the lists are gathered again.
  std::vector<ContactPoint> gather();

 private:
  std::array<std::vector<Contact>, kLanes> lists_;
  BlockArray rows_;
};

}  // namespace graze
