#pragma once
// The seam between the back end (lane_physics.cpp, compiled once) and the kernels (step.h, compiled once per
// instruction set): tables of integers and pointers to doubles. Every array is [quantity][lane]; W is the kernel's
// number of lanes.

#include "engine/contact/newton_memory.h"
#include "engine/contact/path_view.h"
#include "engine/dynamics/topology_view.h"
#include "engine/lanes/contact_rows.h"

namespace graze {

struct HeightView;  // engine/contact/manifold.h
struct HullView;    // likewise

/// ShapeKind's numbers (world.h itself may not be included by kernels); lane_engine.cpp checks them.
inline constexpr int kBoxKind = 0, kSphereKind = 1, kMeshKind = 4, kPlaneKind = 5;

/// A collision shape, as all particles share it.
struct ColliderView {
  int kind;                   // ShapeKind
  int body;                   // or -1: the world
  bool used;                  // in some pair
  const HeightView* terrain;  // heightfields only: one for each lane
  const HullView* hull;       // meshes only
};

struct PairView {
  int a, b;   // colliders
  int path;   // index into the paths
  int axis;   // place of its axis in `axis`; -1: none is kept
  bool flat;  // both are boxes, cylinders or capsules
};

/// A joint that follows another.
struct MimicView {
  int body, other_body;
  int q, other_q;      // place in q
  int dof, other_dof;  // and in v
};

/// Parameters of the solver, the same for all particles.
struct SolverSettings {
  int most_sweeps = 60;
  // m/s (rad/s): a lane ends when a sweep changes no velocity of a constraint by more. Where many contacts share a body
  // up to five times that is left of the laws, which shall be less than 1e-6 m/s (our choice).
  double tolerance = 3e-7;
  double accepted = 1e-6;     // likewise: what is left of a step that has converged, if it cannot be less
  bool sweep_servos = false;  // solve every servo as a row of the sweeps, for comparison
  bool measure = false;       // fills `measured`, which no step needs
  int newton_after = 16;      // sweeps, where they have not converged (newton.h); most_sweeps: never
  int tree_after = 1 << 30;   // likewise, of newton_tree.h; from newton_after on: never
  int most_newton_steps = 100;
};

/// Numbers of a collider, each a row of W lanes.
enum ColliderRow : int {
  kPose = 0,     // 12, in the body frame, or the world
  kSize = 12,    // 3, Shape::size
  kExtent = 15,  // 3, half edges of a box about the frame's origin that holds the shape, m
  kRadius = 18,  // of a sphere about the frame's origin that holds it, m
  kColliderRows = 19
};

/// Numbers of a pair of colliders, each a row of W lanes.
enum PairRow : int {
  kPairFriction,
  kPairRestitution,
  kPairSpring,    // 2: stiffness and damping, ContactSpringT
  kPairDeep = 4,  // m: what overlaps by more is pushed out (push_out.h)
  kPairRows
};

/// A body that turns more per step is no longer integrated: an eighth of a turn, rad (Bullet's bound, too).
inline constexpr double kLargestTurn = 0.78539816339744831;
/// What a trace may gain out of nothing before it counts as unphysical: what lifts everything by this height (m), and
/// this share of the largest kinetic energy so far; without gravity 1 nJ, for what rests. Our choices.
inline constexpr double kCreatedLift = 0.01, kCreatedShare = 0.05, kCreatedLeast = 1e-9;

/// What the audit of energy keeps (audit.h), each a row of W lanes.
enum AuditRow : int {
  kKinetic,  // energy after the last step, J
  kSpin2,    // squared speed of the fastest spin then, rad^2/s^2
  kRise,     // J, what the last step gained out of nothing
  kCreated,  // J, all steps
  kPeak,     // J, largest kinetic energy at the beginning of a step
  kLift,     // J, what lifts everything by kCreatedLift
  kAuditRows
};

/// Manifold slots per pair, and what is kept of each from step to step: impulse (world) and slip rate.
inline constexpr int kSlots = 8, kKept = 4;

/// Drives of a step (see Drive in block_physics.h), na rows each. Torques alone: only `tau` is not null.
struct DriveView {
  const double* tau;
  const double *q, *v, *kp, *kd, *lower, *upper, *prescribed;
  double *torque = nullptr, *demand = nullptr;  // out, active lanes: as DriveResult; null: not wanted
};

/// Numbers of a drive that are kept: mode, flips, torque, demand, warm; see drive_of_step.h.
inline constexpr int kServoRows = 5;
/// Rows of MimicRowT.
inline constexpr int kMimicRows = 3;
/// Rows of SweepMemoryT.
inline constexpr int kSweepMemory = 12;

struct LaneBlock {
  TopologyView topology;
  int na;
  const int* actuated_body;  // na
  const int* actuated_dof;   // na
  int watched_count;         // joints that have limits or dry friction in some lane
  const int* watched_body;
  int collider_count;
  const ColliderView* colliders;
  int pair_count;
  const PairView* pairs;
  const PathView* paths;
  const JointPathView* joint_paths;  // per degree of freedom of a joint
  int mimic_count;
  const MimicView* mimics;
  int mimic_dof_count;
  const int* mimic_dofs;  // of all mimic rows, with their ancestors, descending
  const int* whole;       // per body: the first of its tree and of the trees on the world that mimic rows couple it to
  SolverSettings settings;

  // Numbers of the particles.
  double* body;      // BodyT per body
  double* gravity;   // 3
  double* law;       // ContactLawT
  double* collider;  // kColliderRows per collider
  double* pair;      // kPairRows per pair
  double* limit;     // 3 per body: lower, upper, dry friction
  double* mimic;     // 2 per mimic row: multiplier, offset (rad or m)

  // State.
  double *q, *v, *a, *X;
  double* energy;    // 1: kinetic and potential, J
  double* effort;    // 4 of the last step: sweeps, residual (m/s), work of the joint torques (J), and what the
                     // brake has taken (m/s)
  double* measured;  // 4 of the last step, if the settings ask for it: ContactResidualsT, m/s

  double* energy_audit;  // kAuditRows
  unsigned suspect;      // lanes whose last step was not physical

  // Working memory.
  double *motion, *origin, *balance, *M, *inverse_D, *bias, *z, *dz, *free, *scratch;
  double* push;           // nv: speeds that take overlaps back; 3 per body: momentum of them, of floating trees
  unsigned pushing;       // lanes in which there are any
  double* pose;           // 12 per collider
  double* speed;          // 1 per collider, bound of the speed of its points, m/s
  double* servo;          // kServoRows per actuated joint
  double* servo_rows;     // 2 per degree of freedom of its path per actuated joint
  double* M_kept;         // M without drives
  double* diagonal;       // nv: what M has there beside the inertias of bodies, if settings.tree_after asks for it
  unsigned* locked;       // per body: lanes in which prescribed motion holds its joint
  double* joints;         // JointRowT per watched joint and actuated joint
  double* joint_rows;     // 2 per degree of freedom of its path per watched joint
  double* mimic_rows;     // 2 mimic_dof_count and a MimicRowT per mimic row
  double* joint_impulse;  // 3 per body: lower, upper, dry; warm start
  double* slot_impulse;   // kKept kSlots per pair, warm start
  int* slot_used;         // per pair: bit k: slot k's may be other than zero
  double* travel;         // 2: m, bounds of how far two colliders can have come nearer, of the lane and of any lane
  unsigned fresh;         // lanes that have just been started: their colliders have gone no way yet
  double* due;            // 1 per pair: m, distance when last measured, and the lane's travel up to then
  double* soonest;        // per pair: the least distance of the lanes, and any lane's travel up to then (not per lane)
  double* axis;  // 3 per kept axis: a unit vector from b to a along which the pair was apart when last looked at,
                 // in b's frame. It may be any: what is found does not depend on it
  int near_count;
  int* near;             // pairs that may touch within this step
  unsigned* near_lanes;  // per near pair: in which lanes

  // Contacts of the step; room for kSlots per near pair is made between begin and finish.
  double* contacts;        // ContactT
  double* contact_rows;    // Y and D^-1 Y
  double* sweep_memory;    // SweepMemoryT per contact
  NewtonMemory newton;     // unless newton_after is most_sweeps
  double* report;          // kContactRows per contact
  int* report_pair;        // per contact
  unsigned* report_lanes;  // per contact: where it is valid
  int contact_count;
};

/// Servos with encoders, limits and integrals around a step (engine/actuation), na rows each.
struct ActuatorRows {
  int na;
  double h;         // s
  unsigned active;  // lanes
  bool torque_speed;
  const int *q_index, *v_index;                               // per joint: its row of q and v
  const double *q, *v;                                        // state before the step
  const double *tau, *q_target, *v_target, *ki, *prescribed;  // command
  const double *q_bias, *v_bias, *tau_bias;                   // errors of encoders and torques
  const double *effort, *speed;                               // limits of the particles
  double* integral;                                           // in and out
  double* q_error;                                            // at the beginning of the step; fill_drive writes it
  double *feed, *q_ref, *v_ref, *lower, *upper;               // the Drive, which fill_drive writes
  const double *torque, *demand;                              // the DriveResult, which follow_drive reads
  double *out, *headroom;                                     // what follow_drive writes beside the integral
};

/// A pair of shapes whose gap is asked for, outside of any step (gaps.h).
struct GapQuery {
  struct Side {
    int kind;                   // ShapeKind
    const double *size, *pose;  // rows: 3, as Shape::size; 12, world
    const HeightView* terrain;  // heightfields only: one for each lane
    const HullView* hull;       // meshes only
  };
  Side a, b;
  unsigned lanes;        // in which it is wanted
  const double* enough;  // 1 row, m: beyond that a bound will do
  const double* reach;   // 1 row, m: points farther apart than that need not be found
  double* axis;          // 3 rows, in and out: a unit vector along which the shapes were apart when last seen, in the
                         // frame of the one that rank_of() puts second; any at first
  double* bound;         // 1 row, out: no more than the gap, m
  double* manifold;      // out: kManifoldRows kSlots rows; places and normals are left out
};

/// How far bodies have moved since they were last looked at, added up.
struct MoveQuery {
  int count;
  const int* body;     // per body: place in X
  const double* X;     // 12 rows per place, world
  unsigned fresh;      // lanes whose sums begin now
  double* last;        // 12 rows per body, in and out: X when last looked at
  double *turn, *way;  // 1 row per body, in and out: chords of turns, at 1 m; ways of the origin, m
};

/// What that makes of any point of the bodies. Place 0 of `travel` stands for the world, which stays.
struct TravelQuery {
  int count;
  const int* row;            // per body: in `turn` and `way`
  const double *turn, *way;  // as in MoveQuery
  const double* radius;      // 1 row per body, m: of a ball about the body's origin that holds all that is asked about
  double* travel;            // 1 row per body from place 1 on, in and out, m: bound of any point's way
  double* most;              // 1 row, out, m: by how much any of these has grown
};

/// Which pairs may be nearer than `enough` by now.
struct DueQuery {
  int count;
  const int* places;      // 2 per pair: of its bodies in `travel`
  const double* reserve;  // 1 row per pair, m: the gap when last measured, and both travels then
  const double* travel;   // as in TravelQuery
  const double* enough;   // 1 row, m
  unsigned lanes;         // in which it is wanted
  double* lowest;         // 1 row, out: no more than the gap of any pair that is not due, m
  int* due;               // out: these pairs in order; room for all
  unsigned* due_lanes;    // out: per due pair
};

/// The functions of one instruction set and width.
struct LaneKernel {
  int lanes;
  int body_rows, motion_rows, balance_rows, law_rows, contact_doubles,
      joint_doubles;  // sizes in rows (doubles: all lanes)
  /// Everything that follows from q and v: poses, M, bias.
  void (*settle)(LaneBlock& block);
  /// First half of a step: free motion, and which pairs are near.
  void (*begin)(LaneBlock& block, double h, unsigned active, const DriveView& drive);
  /// Second half: contacts, impulses, new state. Lanes that are not active keep q and v.
  void (*finish)(LaneBlock& block, double h, unsigned active, const DriveView& drive);
  /// Fills `bound` in all lanes. Returns the lanes in which that is not enough; in these `manifold` is filled, too.
  unsigned (*measure_gap)(const GapQuery& query);
  void (*add_moves)(const MoveQuery& query);
  void (*add_travel)(const TravelQuery& query);
  /// Returns how many pairs are due.
  int (*find_due)(const DueQuery& query);
  /// X_WG = X_WB X_BG, 12 rows each.
  void (*place)(const double* X_WB, const double* X_BG, double* X_WG);
  /// Before a step: the Drive that the back end solves. All lanes.
  void (*fill_drive)(const ActuatorRows& rows);
  /// After it: torques, headroom and integrals of the active lanes.
  void (*follow_drive)(const ActuatorRows& rows);
};

/// The kernel of a width, or null: 1 and 8 lanes exist everywhere, 4 in the AVX2 build. Builds for x86 exist if the
/// program has GRAZE_X86_KERNELS.
const LaneKernel* find_lane_kernel_portable(int lanes);
const LaneKernel* find_lane_kernel_avx2(int lanes);
const LaneKernel* find_lane_kernel_avx512(int lanes);

}  // namespace graze
