/* A controller of your own in a shared object, judged by Graze (docs/controllers.md).
 *
 * Plain C99, nothing to link. A library exports one function, graze_policy(), that returns a table of functions:
 *
 *   GRAZE_POLICY_EXPORT const GrazePolicy* graze_policy(void) {
 *     static const GrazePolicy policy = {GRAZE_POLICY_VERSION, sizeof(GrazePolicy), GRAZE_READS_JOINT_POSITION,
 *                                        create, start, act, destroy, last_error};
 *     return &policy;
 *   }
 *
 * Build it by: cc -std=c99 -O2 -fPIC -shared -I INCLUDE -o my_controller.so my_controller.c
 *
 * Eight copies of the robot ("lanes") act in one call. Arrays are [quantity][lane]: quantity k of lane l stands at
 * k * lanes + l. If you write for one robot, let graze_each_robot() below loop over the lanes.
 *
 * What a controller promises, so that a trace has the same bits in any lane, beside any neighbours and on any number of
 * threads ("graze check --determinism" tries it): what it does in a lane depends on that lane's observations since its
 * start() and on the seed it was given there, and on nothing else: no clock, no rand(), no lane's number, nothing kept
 * from the trace before. It leaves rounding mode and floating-point exceptions as they are.
 *
 * All numbers are SI: m, rad, s, N, N m; axes are the world's.
 */
#ifndef GRAZE_POLICY_H
#define GRAZE_POLICY_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this interface. A program refuses libraries of another version, and names both. */
#define GRAZE_POLICY_VERSION 1u

#if defined(__GNUC__)
#define GRAZE_POLICY_EXPORT __attribute__((visibility("default")))
#else
#define GRAZE_POLICY_EXPORT
#endif

/* What act() reads of an observation. The rest is not sensed, which saves time, and is NaN. */
enum {
  GRAZE_READS_NOTHING = 0,
  GRAZE_READS_JOINT_POSITION = 1 << 0,
  GRAZE_READS_JOINT_VELOCITY = 1 << 1,
  GRAZE_READS_JOINT_ACCELERATION = 1 << 2,
  GRAZE_READS_JOINT_TORQUE = 1 << 3,
  GRAZE_READS_BASE_POSITION = 1 << 4,
  GRAZE_READS_BASE_RPY = 1 << 5,
  GRAZE_READS_BASE_VELOCITY = 1 << 6,
  GRAZE_READS_BASE_RATE = 1 << 7,
  GRAZE_READS_IMU_LINEAR = 1 << 8,
  GRAZE_READS_IMU_ANGULAR = 1 << 9,
  GRAZE_READS_LINK_FORCE = 1 << 10,
  GRAZE_READS_LINK_PUSH = 1 << 11,
  GRAZE_READS_EVERYTHING = (1 << 12) - 1
};

/* A driven joint of the nominal robot. */
typedef struct GrazeJoint {
  const char* name;
  int32_t slides;      /* 0: it turns (rad, N m); 1: it slides (m, N) */
  double lower, upper; /* position limits; -INFINITY, INFINITY: none */
  double effort;       /* largest torque or force; INFINITY: any */
  double speed;        /* largest velocity; INFINITY: any */
  double initial;      /* position in the nominal initial state */
} GrazeJoint;

/* What create() is given. It lives until destroy(). */
typedef struct GrazeSetup {
  uint32_t version, size;  /* GRAZE_POLICY_VERSION and sizeof(GrazeSetup) of the program */
  int32_t lanes;           /* stride of all arrays */
  int32_t joints;          /* driven joints */
  const GrazeJoint* joint; /* [joints], in the order of all arrays */
  int32_t links;
  const char* const* link; /* names [links], in the order of link_force and link_push */
  double period;           /* s, from one act() of a lane to its next */
  const char* urdf;        /* the nominal robot, as a URDF; "" where the program has none at hand */
  const char* settings;    /* what the scenario says under `settings`, a JSON object */
} GrazeSetup;

/* What is sensed at a control step, with sensor errors. Lanes that do not act hold old values. */
typedef struct GrazeObservation {
  int32_t lanes, joints, links;
  const double* time;               /* [lanes], s since the trace began */
  const double* joint_position;     /* [joints][lanes] */
  const double* joint_velocity;     /* [joints][lanes] */
  const double* joint_acceleration; /* [joints][lanes] */
  const double* joint_torque;       /* [joints][lanes]: that was applied */
  const double* base_position;      /* [3][lanes]: x, y, z */
  const double* base_rpy;           /* [3][lanes]: roll, pitch, yaw */
  const double* base_velocity;      /* [3][lanes]: of the base's origin */
  const double* base_rate;          /* [3][lanes]: angular velocity */
  const double* imu_linear;         /* [3][lanes]: acceleration of the base's origin */
  const double* imu_angular;        /* [3][lanes]: angular acceleration */
  const double* link_force;         /* [links][lanes]: sum of normal contact forces, N */
  const double* link_push;          /* [6 links][lanes]: contact force (N) and the point it acts at (m), world */
} GrazeObservation;

/* What act() fills. Before each call the positions are those of the nominal initial state, velocities and torques 0.
 * What they are for is the scenario's to say: control: {joint_pd: …} follows positions and velocities and adds the
 * torques; control: {torque: {}} takes the torques alone. */
typedef struct GrazeTargets {
  double* position; /* [joints][lanes] */
  double* velocity; /* [joints][lanes] */
  double* torque;   /* [joints][lanes] */
} GrazeTargets;

/* The table. All functions of one policy object are called from one thread; several objects may be alive. */
typedef struct GrazePolicy {
  uint32_t version; /* GRAZE_POLICY_VERSION */
  uint32_t size;    /* sizeof(GrazePolicy) */
  uint32_t reads;   /* GRAZE_READS_… */
  /* An object of your own, or NULL: last_error(NULL) says why. */
  void* (*create)(const GrazeSetup* setup);
  /* A trace begins in `lane`: whatever is kept of that lane is forgotten. `seed`: of this campaign, particle and
   * policy; all randomness is to come from it. 0: done; else: last_error() says what is wrong. */
  int (*start)(void* policy, int32_t lane, uint64_t seed);
  /* One control step of the lanes whose bit in `active` is set (bit l: lane l). 0 or an error, as start(). */
  int (*act)(void* policy, const GrazeObservation* observation, uint32_t active, GrazeTargets* targets);
  void (*destroy)(void* policy);
  /* Why the last call failed; valid until the next call. May be NULL, and return NULL. */
  const char* (*last_error)(void* policy);
} GrazePolicy;

/* What a library exports. */
GRAZE_POLICY_EXPORT const GrazePolicy* graze_policy(void);

/* ---- for those who write for one robot ---- */

/* One lane of an observation and of targets. */
typedef struct GrazeRobot {
  const GrazeObservation* sees;
  GrazeTargets* wants;
  int32_t lane, joints;
  double time; /* s */
} GrazeRobot;

/* Value k of the robot in any array of the observation: graze_see(robot, robot->sees->base_rpy, 1) is its pitch. */
static inline double graze_see(const GrazeRobot* robot, const double* array, int32_t k) {
  return array[k * robot->sees->lanes + robot->lane];
}
static inline double graze_position(const GrazeRobot* robot, int32_t joint) {
  return graze_see(robot, robot->sees->joint_position, joint);
}
static inline double graze_velocity(const GrazeRobot* robot, int32_t joint) {
  return graze_see(robot, robot->sees->joint_velocity, joint);
}
/* Sets value k of the robot in an array of the targets: graze_want(robot, robot->wants->torque, 2, 0.5). */
static inline void graze_want(const GrazeRobot* robot, double* array, int32_t k, double value) {
  array[k * robot->sees->lanes + robot->lane] = value;
}

/* Calls act_one for each active robot; ends at the first error, which it returns. */
static inline int graze_each_robot(void* policy, const GrazeObservation* observation, uint32_t active,
                                   GrazeTargets* targets, int (*act_one)(void* policy, const GrazeRobot* robot)) {
  GrazeRobot robot;
  robot.sees = observation;
  robot.wants = targets;
  robot.joints = observation->joints;
  for (robot.lane = 0; robot.lane < observation->lanes; ++robot.lane) {
    if (!((active >> robot.lane) & 1u)) continue;
    robot.time = observation->time[robot.lane];
    const int error = act_one(policy, &robot);
    if (error != 0) return error;
  }
  return 0;
}

/* A key of the settings' outermost map, and where its value begins. For the two functions below. */
typedef struct GrazeKey {
  const char* at;    /* where to look for the next one; at first the settings */
  int depth;         /* at first 0 */
  const char* begin; /* of the key, without quotes */
  size_t size;       /* bytes */
  const char* value;
} GrazeKey;

/* The next key; 0: there is none. */
static inline int graze_next_key(GrazeKey* key) {
  const char* at = key->at;
  while (*at != '\0') {
    if (*at == '{' || *at == '[') ++key->depth;
    if (*at == '}' || *at == ']') --key->depth;
    if (*at != '"') {
      ++at;
      continue;
    }
    key->begin = ++at;
    while (*at != '\0' && *at != '"') at += at[0] == '\\' && at[1] != '\0' ? 2 : 1;
    key->size = (size_t)(at - key->begin);
    if (*at != '\0') ++at;
    key->value = at;
    while (*key->value == ' ') ++key->value;
    if (key->depth != 1 || *key->value != ':') continue; /* a text that is no key of the outermost map */
    ++key->value;
    while (*key->value == ' ') ++key->value;
    key->at = at;
    return 1;
  }
  return 0;
}

/* The number that stands under `key` in the outermost map of the settings, 1 for true and 0 for false, or `otherwise`
 * if nothing stands there. NaN for a text, a list or a map, for which take a JSON library. */
static inline double graze_setting(const GrazeSetup* setup, const char* key, double otherwise) {
  GrazeKey one = {setup->settings, 0, NULL, 0, NULL};
  while (graze_next_key(&one)) {
    if (one.size != strlen(key) || strncmp(one.begin, key, one.size) != 0) continue;
    if (strncmp(one.value, "true", 4) == 0) return 1;
    if (strncmp(one.value, "false", 5) == 0) return 0;
    if (*one.value == '"' || *one.value == '[' || *one.value == '{') return NAN;
    char* end = NULL;
    const double number = strtod(one.value, &end);
    return end == one.value ? otherwise : number;
  }
  return otherwise;
}

/* Whether a key of the settings' outermost map is none of `known`, names with spaces between ("kp kd"): then it stands
 * in `found`, cut to `size` - 1 bytes. For create(), so that a misspelt setting is told and not left out. */
static inline int graze_unknown_setting(const GrazeSetup* setup, const char* known, char* found, size_t size) {
  GrazeKey one = {setup->settings, 0, NULL, 0, NULL};
  while (graze_next_key(&one)) {
    int is_known = 0;
    for (const char* name = known; *name != '\0' && !is_known;) {
      const size_t length = strcspn(name, " ");
      is_known = length == one.size && strncmp(name, one.begin, length) == 0;
      name += length;
      while (*name == ' ') ++name;
    }
    if (is_known) continue;
    const size_t length = one.size < size ? one.size : size - 1;
    memcpy(found, one.begin, length);
    found[length] = '\0';
    return 1;
  }
  return 0;
}

#ifdef __cplusplus
}
#endif

#endif
