#pragma once
// The seam between policies and trackers (compiled once) and their kernels (compiled once per instruction set): tables
// of the nominal model and pointers to rows of lanes, [quantity][lane]; each row has kLanes. Lanes that
// are not active (bit l is lane l) keep what they have.

#include "engine/contact/manifold.h"
#include "engine/control/gait_parameters.h"
#include "engine/dynamics/topology_view.h"

namespace graze {

/// A leg as the gait sees it.
template <class Number>
struct LegOf {
  ChainOf<Number> chain;
  const HipKneeOf<Number>* closed;  // null: inverse kinematics by iteration
  const Number* reference;          // chain.n initial joint positions, guess of the first step
  int forces;                       // rows of link_force that count as the foot's
  const int* force;
};

template <class Number>
struct GaitOf {
  GaitParametersOf<Number> p;
  const LegOf<Number>* legs;  // p.timing.feet
  bool by_joints;             // joint targets by inverse kinematics
  int na;
  const Number* initial;  // na: targets of joints that belong to no leg
};

/// Modes of a foot (Figure 67).
enum class FootMode { stance = 0, swing = 1, reach = 2, support = 3 };

struct GaitCall {
  unsigned active, fresh;  // fresh: of the active, those that begin a trace
  // Sensed; see Observation. Rows that the parameters do not ask for may be null.
  const double *time, *joint_position, *base_rpy, *base_rate, *link_force;
  const double* command;  // 6: velocity of the base, linear and angular
  // Memory of the gait, zero at first.
  double* feet;       // foot_doubles per foot
  double* last_time;  // 1, s
  double* guess;      // kMaxChainJoints per leg
  // Targets.
  double *q, *v, *tau;  // na each
  double *x, *xd;       // 3 per foot each
};

template <class Number>
struct OperationalPdOf {
  int effectors;
  const ChainOf<Number>* chains;
  double kp, kd;  // N/m, N s/m
  double period;  // s, over which the damper is implicit; 0: explicit
  int na;
};

struct OperationalPdCall {
  unsigned active;
  const double *joint_position, *joint_velocity;  // na each, sensed
  const double *target_tau, *x, *xd;              // targets
  double *tau, *kp, *kd, *ki;                     // na each: what the actuators are asked for
};

/// Where inverse dynamics has contact forces from: none, the convex program with Coulomb's cones or without slip, what
/// was sensed, or a complementarity problem that is solved lane by lane.
enum class PredictedContact : int { none, coulomb, no_slip, sensed, pivoted };

/// A body of the robot whose contacts count.
struct TouchingLinkView {
  int body;
  int dof;     // the last degree of freedom that moves it
  int frames;  // rows of link_force that count as the body's
  const int* frame;
};

/// A body with six degrees of freedom of its own, whose velocity contacts tell: the robot's base, or a movable object.
struct FreeBodyView {
  int body, q, dof;  // dof: the first of the six
  int mass;          // where the 21 entries of its rows of M begin
  int row;           // its first in Observation::object_state; -1: it is not told of
};

/// A shape of the robot, or of a movable object, and one that it may touch.
struct GroundPairView {
  struct Part {
    ShapeKind kind;
    double size[3];             // Shape::size
    double pose[12];            // R row by row, then p: in the body's frame, of a standing part in the world's (m)
    const HeightView* terrain;  // [kLanes]
    const HullView* hull;
  };
  Part own, ground;
  int link;         // that carries the robot's shape; -1: an object has it
  int body, other;  // that carry the shapes; other -1: it stands in the world
  int place;        // of its manifold's first point in InverseDynamicsMemory::impulse
  double friction;  // of the pair
};

/// A joint that follows another.
struct FollowerView {
  int q, v, other_q, other_v;
  double multiplier, offset;  // position = multiplier times the other's + offset
};

/// Numbers of a ProgramContactT (contact_program.h).
inline constexpr int kProgramContactRows = 37;

/// Working memory of inverse dynamics, rows of kLanes each; inverse_dynamics.h says what is in them.
struct InverseDynamicsMemory {
  double *body, *gravity, *motion, *pose, *origin, *M, *inverse_D, *bias;      // as TreeT
  double *q, *v;                                                               // nq, nv
  double *want, *free, *z, *step, *trial, *gradient, *torque, *weight, *soft;  // nv each
  double *H, *contacts, *jacobian;
  double* pivot;         // PivotRow of each contact
  double* normal_force;  // of each link, N: what the torques count on
  // 3 rows per point that any pair may have: the impulse of the control step before, N s, about the contact's frame;
  // zero where there was none. A lane's own from call to call.
  double* impulse;
  int places;             // points that it has rows of
  int* place_of_contact;  // -1: none
  int* dof_of_contact;    // the last that moves it
  int* link_of_contact;
  unsigned* lanes_of_contact;  // where it is
  int room;                    // contacts
};

/// What a scalar solver is told of a contact, and its answer: velocity without impulses plus gap term (3), friction,
/// and impulse (3), which is that of the convex program before it is found.
enum PivotRow : int { kPivotVelocity = 0, kPivotFriction = 3, kPivotImpulse = 4, kPivotRows = 7 };
/// Finds the impulses of one lane's contacts, of which there are `count` in any lane.
using PivotContacts = void (*)(void* solver, int lane, int count);

/// What effectors shall do, if it is them and not joints that have targets.
struct OperationalWishView {
  int effectors;  // 0: joints have targets
  const ChainView* chains;
  double kp, kd;    // 1/s^2, 1/s
  bool transposed;  // joint accelerations by the transposed Jacobian
};

/// The nominal robot, with the movable objects that it is told of, and how its torques are found. h: time in which
/// joints and contacts shall move as asked, s.
struct InverseDynamicsView {
  TopologyView topology;
  TopologyView program;  // the same degrees of freedom as contacts couple them: those of free bodies above all joints
  bool floating;
  int free_count;
  const FreeBodyView* free;
  int joint_begin, joint_end;  // degrees of freedom of the joints
  int na;
  const int *q, *v;  // of each actuated joint
  int follower_count;
  const FollowerView* followers;
  const double* damping;       // nv, N m s/rad
  const double *kp, *kd, *ki;  // na, 1/s^2, 1/s and 1/s^3
  OperationalWishView operational;
  double h, weight, stiffness;  // s; N, of the robot; weight of torques against energy (contact_program.h)
  PredictedContact law;
  bool told;             // contacts are where link_force says so
  double within, force;  // m, N: what counts as a contact
  int link_count;
  const TouchingLinkView* links;
  int pair_count;
  const GroundPairView* pairs;
  PivotContacts pivot;
  void* solver;
  InverseDynamicsMemory memory;

  /// Whether objects take part, or an arm: then hands grip, and what fingers are told contradicts what they hold nearly
  /// always.
  bool grips() const { return free_count > 1 || !floating; }
};

struct InverseDynamicsCall {
  unsigned active;
  const double *joint_position, *joint_velocity;                       // na each, sensed
  const double *base_position, *base_rpy, *base_velocity, *base_rate;  // 3 each, sensed, world; or null
  const double* object_state;                                          // as sensed, or null
  const double *link_force, *link_push;                                // sensed, or null
  const double* error_sum;                                             // na, rad s or m s, or null
  const double *target_q, *target_v, *target_tau;                      // na each
  const double *target_x, *target_xd;                                  // 3 per effector each, or null
  double *tau, *kp, *kd, *ki;                                          // na each: what the actuators are asked for
};

/// The functions of one instruction set.
struct ControlKernel {
  int foot_doubles;  // memory of a foot, all lanes
  void (*gait)(const GaitOf<double>& view, const GaitCall& call);
  void (*gait_of_each)(const GaitOf<LaneNumber>& view, const GaitCall& call);  // a robot in each lane
  void (*operational_pd)(const OperationalPdOf<double>& view, const OperationalPdCall& call);
  void (*operational_pd_of_each)(const OperationalPdOf<LaneNumber>& view, const OperationalPdCall& call);
  void (*inverse_dynamics)(const InverseDynamicsView& view, const InverseDynamicsCall& call);
  /// Modes of a lane's feet, out[count], as FootMode; `feet`: memory of the gait.
  void (*foot_modes)(const double* feet, int count, int lane, double* out);
  int foot_numbers;  // memory of a foot, one lane
  /// Copies a lane's memory of its feet to `numbers` [count][foot_numbers], or from there if `back`.
  void (*copy_feet)(double* feet, int count, int lane, double* numbers, bool back);
};

const ControlKernel& find_control_kernel_portable();
const ControlKernel& find_control_kernel_avx2();
const ControlKernel& find_control_kernel_avx512();

}  // namespace graze
