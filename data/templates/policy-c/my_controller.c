/* A controller in C: holds every joint where the nominal robot begins, by a spring kp and a damper kd. Replace
 * act_one() by what your robot does; graze/policy.h says what it is given and what it promises. */
#include "graze/policy.h"

#include <stdio.h>

typedef struct Controller {
  const GrazeSetup* setup;
  double kp, kd; /* N m/rad, N m s/rad */
} Controller;

static char problem[200]; /* of the last call that failed */

static void* create(const GrazeSetup* setup) {
  char unknown[64];
  if (graze_unknown_setting(setup, "kp kd", unknown, sizeof unknown)) {
    snprintf(problem, sizeof problem, "unknown setting '%s'; there are: kp kd", unknown);
    return NULL;
  }
  Controller* const self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->setup = setup;
  self->kp = graze_setting(setup, "kp", 20.0);
  self->kd = graze_setting(setup, "kd", 1.0);
  if (!(self->kp >= 0 && self->kd >= 0)) {
    snprintf(problem, sizeof problem, "kp (%g) and kd (%g) must be numbers that are not negative", self->kp, self->kd);
    free(self);
    return NULL;
  }
  return self;
}

/* This law remembers nothing of a trace; what yours remembers of `lane` is forgotten here. */
static int start(void* policy, int32_t lane, uint64_t seed) {
  (void)policy, (void)lane, (void)seed;
  return 0;
}

static int act_one(void* policy, const GrazeRobot* robot) {
  const Controller* const self = policy;
  for (int32_t k = 0; k < robot->joints; ++k) {
    const double q0 = self->setup->joint[k].initial;
    double torque = self->kp * (q0 - graze_position(robot, k));
    torque += self->kd * (0.0 - graze_velocity(robot, k));
    graze_want(robot, robot->wants->torque, k, torque);
  }
  return 0;
}

static int act(void* policy, const GrazeObservation* observation, uint32_t active, GrazeTargets* targets) {
  return graze_each_robot(policy, observation, active, targets, act_one);
}

static void destroy(void* policy) { free(policy); }

static const char* last_error(void* policy) {
  (void)policy;
  return problem;
}

GRAZE_POLICY_EXPORT const GrazePolicy* graze_policy(void) {
  static const GrazePolicy policy = {GRAZE_POLICY_VERSION,
                                     sizeof(GrazePolicy),
                                     GRAZE_READS_JOINT_POSITION | GRAZE_READS_JOINT_VELOCITY,
                                     create,
                                     start,
                                     act,
                                     destroy,
                                     last_error};
  return &policy;
}
