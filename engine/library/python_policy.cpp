// Policy `python`: a controller of the user's own, a class in Python that acts on NumPy arrays.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>

#include "engine/control/joint_values.h"
#include "engine/library/chances.h"
#include "engine/library/outside_policy.h"
#include "engine/library/python_process.h"
#include "engine/library/python_use.h"
#include "engine/library/settings_json.h"

namespace graze {

namespace {

/// An array of the observation, and where it is in the shared memory.
struct SeenArray {
  const char* name;
  SensedGroup group;
  const BlockArray Observation::*array;
  int rows = 0;
  std::size_t offset = 0;  // bytes
};

/// Where all arrays are in the shared memory.
struct PythonArrays {
  std::array<SeenArray, 12> seen;
  // A vector [joint] that lacks its [:, None] goes with arrays [quantity, lane] if there are as many joints as lanes,
  // and would give each robot what is meant for a joint. Such robots are shown with one lane more, so that it is an
  // error.
  int lanes;                                           // of each array
  std::size_t position = 0, velocity = 0, torque = 0;  // offsets of the targets, bytes
  std::size_t size = kPythonArrays;                    // bytes in all

  explicit PythonArrays(const Model& model)
      : seen({{{"joint_position", kJointPosition, &Observation::joint_position},
               {"joint_velocity", kJointVelocity, &Observation::joint_velocity},
               {"joint_acceleration", kJointAcceleration, &Observation::joint_acceleration},
               {"joint_torque", kJointTorque, &Observation::joint_torque},
               {"base_position", kBasePosition, &Observation::base_position},
               {"base_rpy", kBaseRpy, &Observation::base_rpy},
               {"base_velocity", kBaseVelocity, &Observation::base_velocity},
               {"base_rate", kBaseRate, &Observation::base_rate},
               {"imu_linear", kImuLinear, &Observation::imu_linear},
               {"imu_angular", kImuAngular, &Observation::imu_angular},
               {"link_force", kLinkForce, &Observation::link_force},
               {"link_push", kLinkPush, &Observation::link_push}}}),
        lanes(model.na() == kLanes ? kPythonLanes : kLanes) {
    const int links = static_cast<int>(model.frames.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const SensedGroup group = seen[i].group;
      seen[i].rows = group == kLinkForce ? links : group == kLinkPush ? 6 * links : i < 4 ? model.na() : 3;
      seen[i].offset = take(seen[i].rows);
    }
    position = take(model.na()), velocity = take(model.na()), torque = take(model.na());
  }

 private:
  std::size_t take(int rows) {
    const std::size_t offset = size;
    size += static_cast<std::size_t>(rows) * static_cast<std::size_t>(lanes) * sizeof(double);
    return offset;
  }
};

/// What the runner is told, a line of JSON. Infinite numbers are written as Python reads them.
class PythonSetup {
 public:
  PythonSetup(const ControlContext& context, const Described& own, const LibraryUse& use, const PythonArrays& arrays) {
    const auto settings = own.find("settings");
    if (settings && !settings->is_null() && !settings->is_map()) settings->fail("must be a map, {kp: 20, …}");
    add("file", json_text(use.file));
    add("class", json_text(use.class_name));
    add("settings", settings && !settings->is_null() ? settings_json(*settings) : "{}");
    add("urdf", json_text(context.urdf.empty() ? library_urdf() : context.urdf));
    add("period", number(context.period));
    add("lanes", std::to_string(arrays.lanes));
    add("robots", std::to_string(kLanes));
    add("size", std::to_string(arrays.size));
    add_robot(context);
    add_places(arrays);
  }
  std::string text() const { return "{" + text_ + "}"; }

 private:
  static std::string number(double value) {
    if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
    return std::isnan(value) ? "NaN" : fmt::format("{}", value);
  }

  void add(const char* key, const std::string& value) {
    text_ += (text_.empty() ? "" : ", ") + json_text(key) + ": " + value;
  }
  template <class Items, class Write>
  void add_list(const char* key, const Items& items, const Write& write) {
    std::string list;
    for (const auto& item : items) list += std::string(list.empty() ? "" : ", ") + write(item);
    add(key, "[" + list + "]");
  }

  void add_robot(const ControlContext& context) {
    const Model& model = context.nominal;
    std::vector<const Body*> joints;
    for (int k = 0; k < model.na(); ++k) joints.push_back(&model.bodies[model.actuated[k]]);
    add_list("joints", joints, [](const Body* body) { return json_text(body->joint); });
    add_list("slides", joints, [](const Body* body) { return body->type == JointType::prismatic ? "true" : "false"; });
    add_list("lower", joints, [](const Body* body) { return number(body->lower); });
    add_list("upper", joints, [](const Body* body) { return number(body->upper); });
    add_list("effort", joints, [](const Body* body) { return number(body->effort); });
    add_list("speed", joints, [](const Body* body) { return number(body->velocity); });
    add_list("initial", actuated_positions(model, context.initial), number);
    add_list("links", model.frames, [](const Frame& frame) { return json_text(frame.name); });
  }

  void add_places(const PythonArrays& arrays) {
    add_list("observation", arrays.seen, [](const SeenArray& one) {
      return fmt::format("[\"{}\", {}, {}, {}]", one.name, one.offset, one.rows, static_cast<unsigned>(one.group));
    });
    const std::string rows = std::to_string(arrays.seen[0].rows);
    add("targets", fmt::format("[[\"position\", {1}, {0}], [\"velocity\", {2}, {0}], [\"torque\", {3}, {0}]]", rows,
                               arrays.position, arrays.velocity, arrays.torque));
    add("offsets",
        fmt::format(
            "{{\"begun\": {}, \"stage\": {}, \"message_size\": {}, \"reads\": {}, \"lanes\": {}, \"seeds\": {}, "
            "\"time\": {}, \"active\": {}, \"message\": {}}}",
            offsetof(PythonPage, begun), offsetof(PythonPage, stage), offsetof(PythonPage, message_size),
            offsetof(PythonPage, reads), offsetof(PythonPage, lanes), offsetof(PythonPage, seeds),
            offsetof(PythonPage, time), offsetof(PythonPage, active), offsetof(PythonPage, message)));
    add("message_room", std::to_string(sizeof(PythonPage::message)));
  }

  std::string text_;
};

class PythonPolicy : public OutsidePolicy {
 public:
  PythonPolicy(const ControlContext& context, const Described& own)
      : OutsidePolicy(context, read_python_use(own)),
        arrays_(context.nominal),
        setup_(PythonSetup(context, own, use(), arrays_).text()) {
    if (use().loads_here()) load();
  }

  /// Where it does not run nobody knows.
  unsigned reads() const override { return process_ ? reads_ : kAllGroups; }

  /// Told with the next act(), so that lanes that begin together are one call of reset().
  void start(int lane) override {
    if (!process_) refuse();
    begun_.set(lane);
    seeds_[static_cast<std::size_t>(lane)] = seed(lane);
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    if (!process_) refuse();
    const double time = time_of(observation, active);
    show(observation, active);
    process_->step(time);
    begun_ = LaneMask();
    fetch();
    const std::string wrong = take(wanted_, active, targets);
    if (!wrong.empty()) process_->fail(time, wrong);
  }

 private:
  void load() {
    check_library_file(use());
    try {
      process_ = with_chances<CallLost>([&] { return std::make_unique<PythonProcess>(use(), setup_, arrays_.size); });
    } catch (const MachineError&) {
      throw;
    } catch (const PythonRefused& refused) {
      fail_at(refused.key, refused.what());
    } catch (const std::runtime_error& error) {
      fail_at("file", error.what());
    }
    reads_ = static_cast<unsigned>(process_->page().reads) & kAllGroups;
    for (const SeenArray& one : arrays_.seen) {
      std::fill_n(process_->array(one.offset), one.rows * arrays_.lanes, std::numeric_limits<double>::quiet_NaN());
    }
  }

  /// At what is typed under the key, or, where its default holds, at the file.
  [[noreturn]] void fail_at(const char* key, const std::string& what) const {
    const Settings& place = use().place;
    place.at(place.has(key) ? key : "file").fail(what);
  }

  /// Writes what is sensed, and which lanes begin and act.
  void show(const Observation& observation, LaneMask active) {
    PythonPage& page = process_->page();
    page.begun = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      page.active[lane] = active[lane];
      page.time[lane] = observation.time[static_cast<std::size_t>(lane)];
      if (!begun_[lane]) continue;
      page.lanes[page.begun] = lane;
      page.seeds[page.begun++] = seeds_[static_cast<std::size_t>(lane)];
    }
    for (const SeenArray& one : arrays_.seen) {
      if ((reads_ & one.group) == 0 || one.rows == 0) continue;
      const BlockArray& array = observation.*one.array;
      put(array, one.rows, one.offset);
    }
    if (joints() == 0) return;
    preset(wanted_.q.row(0), wanted_.v.row(0), wanted_.tau.row(0));
    put(wanted_.q, joints(), arrays_.position);
    put(wanted_.v, joints(), arrays_.velocity);
    put(wanted_.tau, joints(), arrays_.torque);
  }

  void fetch() {
    get(arrays_.position, wanted_.q);
    get(arrays_.velocity, wanted_.v);
    get(arrays_.torque, wanted_.tau);
  }

  /// Into the shared memory. A lane behind those of the block holds what the last one holds: numbers, of which no
  /// function warns.
  void put(const BlockArray& from, int rows, std::size_t offset) {
    double* to = process_->array(offset);
    if (arrays_.lanes == kLanes && rows > 0) {
      std::memcpy(to, from.row(0), bytes_of_rows(rows));
      return;
    }
    for (int row = 0; row < rows; ++row, to += arrays_.lanes) {
      std::memcpy(to, from.row(row), kLanes * sizeof(double));
      std::fill(to + kLanes, to + arrays_.lanes, from.row(row)[kLanes - 1]);
    }
  }

  static std::size_t bytes_of_rows(int rows) { return static_cast<std::size_t>(rows) * kLanes * sizeof(double); }

  /// A row per joint, out of the shared memory.
  void get(std::size_t offset, BlockArray& into) const {
    const double* from = process_->array(offset);
    if (arrays_.lanes == kLanes && joints() > 0) {
      std::memcpy(into.row(0), from, bytes_of_rows(joints()));
      return;
    }
    for (int row = 0; row < joints(); ++row, from += arrays_.lanes) {
      std::memcpy(into.row(row), from, kLanes * sizeof(double));
    }
  }

  const PythonArrays arrays_;
  const std::string setup_;
  Targets wanted_ = Targets(joints(), 0);
  std::unique_ptr<PythonProcess> process_;
  unsigned reads_ = kAllGroups;
  LaneMask begun_;  // lanes whose trace begins with the next act()
  std::array<std::uint64_t, kLanes> seeds_{};
};

const PolicyRegistration python_registration(
    "python", python_description(),
    [](const ControlContext& context, const Described& own, TargetKind kind) -> std::unique_ptr<Policy> {
      if (kind != TargetKind::joint) {
        own.settings().fail_key(
            "python gives joint positions, velocities and torques; use control: {joint_pd: …} or {torque: {}}");
      }
      return std::make_unique<PythonPolicy>(context, own);
    });

}  // namespace

}  // namespace graze
