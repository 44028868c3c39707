/* A controller for tests: does what its settings say. `does`: what; `above` (m): only in robots whose base is higher at
 * the start; from 10 ms on. ODD_TAME in the environment: not at all. With NO_SYMBOL, OTHER_VERSION, LACKS_ACT: a
 * library that is not to be loaded. */
#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "graze/policy.h"

typedef struct Odd {
  const GrazeSetup* setup;
  double above;
  double start_height[64], draw[64];
  int steps;  /* of all lanes and traces: what a controller must not keep */
  int starts; /* the same */
} Odd;

static int does(const Odd* self, const char* what) {
  char wanted[100];
  snprintf(wanted, sizeof wanted, "\"does\": \"%s\"", what);
  return strstr(self->setup->settings, wanted) != NULL;
}

__attribute__((constructor)) static void loaded(void) {
  FILE* const trace = getenv("ODD_TRACE") ? fopen(getenv("ODD_TRACE"), "w") : NULL;
  if (trace) fclose(trace);
}

static int speechless; /* last_error() crashes */

static void* create(const GrazeSetup* setup) {
  Odd* const self = calloc(1, sizeof *self);
  self->setup = setup;
  self->above = graze_setting(setup, "above", 1e9);
  speechless = does(self, "refuse_and_crash");
  if (speechless || does(self, "refuse") || strstr(setup->urdf, "<robot") == NULL) {
    free(self);
    return NULL;
  }
  if (does(self, "crash_create")) *(volatile int*)8 = 1;
  if (does(self, "sleep_create")) sleep(1);
  if (does(self, "stop") && getenv("ODD_TAME") == NULL) raise(SIGSTOP);
  if (does(self, "terminate") && getenv("ODD_TAME") == NULL) raise(SIGTERM);
  if (does(self, "wander") && chdir("aside") != 0) abort();
  return self;
}

static double uniform(uint64_t seed) {
  seed ^= seed >> 33;
  seed *= 0xff51afd7ed558ccdu;
  seed ^= seed >> 33;
  return (double)(seed >> 11) * 0x1p-53;
}

static int start(void* policy, int32_t lane, uint64_t seed) {
  Odd* const self = policy;
  if (does(self, "weigh")) { /* the robot that it is told of */
    const char* const mass = strstr(self->setup->urdf, "<mass");
    fprintf(stderr, "weighs %.20s\n", mass ? mass : "");
  }
  self->draw[lane] = does(self, "dice") ? uniform(seed) : 0;
  ++self->starts;
  return 0;
}

/* As a message of the simulator's begins; what a controller should never write there. */
static void forge(char kind, uint64_t length, const char* text) {
  enum { simulator = 3 };
  char bytes[100];
  bytes[0] = kind;
  memcpy(bytes + 1, &length, sizeof length);
  memcpy(bytes + 1 + sizeof length, text, strlen(text));
  if (send(simulator, bytes, 1 + sizeof length + strlen(text), 0) < 0) abort();
}

static void* stop_soon(void* unused) {
  usleep(20000);
  kill(getpid(), SIGSTOP);
  return unused;
}

/* Over all memory that is shared with the simulator. */
static void scribble(void) {
  char line[500];
  FILE* const maps = fopen("/proc/self/maps", "r");
  unsigned long begin = 0, end = 0;
  while (maps && fgets(line, sizeof line, maps)) {
    if (strstr(line, "memfd:graze-controller") && sscanf(line, "%lx-%lx", &begin, &end) == 2) {
      memset((void*)begin, 0x7f, end - begin);
    }
  }
  if (maps) fclose(maps);
}

static void* leave_well(void* unused) {
  exit(0);
  return unused;
}
static void* leave_ill(void* unused) {
  exit(9);
  return unused;
}
static void* crash_apart(void* unused) {
  *(volatile int*)8 = 1;
  return unused;
}

/* What touches the process as a whole. */
static void err_aside(Odd* self, double time) {
  pthread_t other;
  if (does(self, "exit_well")) exit(0);
  if (does(self, "exit_thread") && pthread_create(&other, NULL, leave_well, NULL) == 0) pause();
  if (does(self, "exit_thread_ill") && pthread_create(&other, NULL, leave_ill, NULL) == 0) pause();
  if (does(self, "crash_thread") && pthread_create(&other, NULL, crash_apart, NULL) == 0) pause();
  if (does(self, "fork_back") && time < 0.0105) fork(); /* both go on */
  if (does(self, "freeze") && pthread_create(&other, NULL, stop_soon, NULL) == 0) usleep(100000);
  if (does(self, "vanish")) {
    if (unlink("odd.so") != 0) abort();
    exit(3);
  }
  if (does(self, "replace")) { /* as if somebody had compiled it anew */
    FILE* const library = fopen("odd.so", "a");
    if (library == NULL || fputs("x", library) < 0 || fclose(library) != 0) abort();
  }
  if (does(self, "scribble")) {
    scribble();
    abort();
  }
  if (does(self, "forge_length")) {
    forge('t', (uint64_t)1 << 35, "");
    pause();
  }
  if (does(self, "forge_words")) forge('m', 3, "hey");
  if (does(self, "forge_part")) {
    if (send(3, "t", 1, 0) < 0) abort();
    pause();
  }
  if (does(self, "shut")) shutdown(3, SHUT_RDWR);
  if (does(self, "killed")) kill(getpid(), SIGKILL);  /* as somebody else may */
  if (does(self, "end_thread")) syscall(SYS_exit, 0); /* of which no exit handler hears */
  if (does(self, "truncate") && ftruncate(4, 0) == 0) abort();
}

/* Takes all the stack that there is. */
static int overflow(int depth) {
  volatile char room[10000];
  room[0] = (char)depth;
  return depth < 0 ? 0 : overflow(depth + 1) + room[0];
}

static int err(Odd* self, const GrazeRobot* robot) {
  volatile int always = 1;
  if (getenv("ODD_TAME") != NULL) return 0;
  err_aside(self, robot->time);
  if (does(self, "segfault")) *(volatile int*)8 = 1;
  if (does(self, "overflow")) return overflow(0);
  if (does(self, "print")) {
    printf("my gripper is %s\n", "on fire");
    abort();
  }
  if (does(self, "exit")) exit(3);
  if (does(self, "exit_alike")) exit(77); /* as a process that has found itself stuck */
  while (does(self, "loop") && always) {
  }
  if (does(self, "leak")) {
    while (malloc(1 << 20) != NULL) {
    }
    abort();
  }
  if (does(self, "fork")) {
    if (fork() == 0) sleep(1000);
    _exit(5);
  }
  if (does(self, "rounding")) fesetround(FE_UPWARD);
  if (does(self, "nan")) graze_want(robot, robot->wants->torque, 0, NAN);
  if (does(self, "behind")) graze_want(robot, robot->wants->torque, robot->joints, 0.5);
  return does(self, "error") || does(self, "replace") ? 7 : 0;
}

static int act_one(void* policy, const GrazeRobot* robot) {
  Odd* const self = policy;
  const double height = graze_see(robot, robot->sees->base_position, 2);
  while (does(self, "tire") && self->starts > 8) sleep(1);
  if (robot->time == 0) self->start_height[robot->lane] = height;
  double torque = 0.5 * (0.3 - graze_position(robot, 0)) + 0.01 * self->draw[robot->lane];
  if (does(self, "remember")) torque += 1e-9 * self->steps;
  if (does(self, "lane")) torque += 1e-9 * robot->lane;
  ++self->steps;
  graze_want(robot, robot->wants->torque, 0, torque);
  if (robot->time < 0.0095 || !(self->start_height[robot->lane] > self->above)) return 0;
  return err(self, robot);
}

static int act(void* policy, const GrazeObservation* observation, uint32_t active, GrazeTargets* targets) {
  static double own[4096];
  if (does(policy, "swap_array")) targets->torque = own;
  if (does(policy, "chatter")) puts("step");
  return graze_each_robot(policy, observation, active, targets, act_one);
}

static void destroy(void* policy) {
  FILE* const trace = getenv("ODD_DESTROYED") ? fopen(getenv("ODD_DESTROYED"), "a") : NULL;
  if (trace) {
    fputs("destroyed\n", trace);
    fclose(trace);
  }
  if (does(policy, "hang_destroy")) pause();
  if (does(policy, "crash_destroy") && getenv("ODD_TAME") == NULL) *(volatile int*)8 = 1;
  if (does(policy, "exit_destroy") && getenv("ODD_TAME") == NULL) exit(0);
  free(policy);
}

static const char* last_error(void* policy) {
  if (speechless) *(volatile int*)8 = 1;
  return policy ? "the gripper has no fingers" : "refused, as it was told";
}

#ifndef NO_SYMBOL
#ifdef OTHER_VERSION
#define VERSION 99u
#else
#define VERSION GRAZE_POLICY_VERSION
#endif
#ifdef LACKS_ACT
#define ACT NULL
#else
#define ACT act
#endif
GRAZE_POLICY_EXPORT const GrazePolicy* graze_policy(void) {
  static const GrazePolicy policy = {
      VERSION, sizeof(GrazePolicy), GRAZE_READS_JOINT_POSITION | GRAZE_READS_BASE_POSITION, create, start, ACT,
      destroy, last_error};
  return &policy;
}
#else
const void* odd_unused[] = {create, start, act, destroy, last_error};
#endif
