// Policy `network`: a neural network from an ONNX file, trained elsewhere.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/control/joint_values.h"
#include "engine/control/rows.h"
#include "engine/lanes/isa.h"
#include "engine/network/network.h"
#include "engine/network/observation_vector.h"
#include "engine/settings/inputs.h"
#include "engine/settings/paths.h"
#include "engine/settings/similar.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

/// Control steps between two calls: beyond any trace.
constexpr long long kLongestWait = 1'000'000;

const NetworkKernel& chosen_network_kernel() { return GRAZE_KERNEL(chosen_isa(), find_network_kernel); }

const Description& network_description() {
  static const Description text = [] {
    Description out = {"asks a neural network from an ONNX file, feed-forward or recurrent, trained elsewhere",
                       {{"file", {Form::text("FILE")}, Default::required(), "`.onnx`, relative to the scenario"}}};
    for (Key& key : observation_keys()) out.keys.push_back(std::move(key));
    const std::vector<Key> rest = {
        {"joints",
         {Form::texts(-1, "JOINT")},
         Default::words("all, as in the URDF"),
         "those that it sees and moves, in its order; the others stay in the stance"},
        {"stance",
         {Form::joint_numbers(Quantity::angle), Form::joint_numbers(Quantity::length)},
         Default::words("the nominal initial positions"),
         "what positions are counted from, seen and wanted"},
        {"action",
         {Form::word({"position", "velocity", "torque"})},
         Default::value("position"),
         "what its outputs are: positions from the stance, velocities or torques"},
        {"scale",
         {Form::joint_numbers(Quantity::dimensionless)},
         Default::value("1"),
         "of its outputs, to rad, rad/s or N m (m, m/s, N); of joints that a map does not name 1"},
        {"clip",
         {Form::number(Quantity::dimensionless, Bound::positive)},
         {},
         "its outputs are cut to within ± this before they are scaled"},
        {"every",
         {Form::whole(Bound::positive)},
         Default::value("1"),
         fmt::format("control steps from one call to the next, at most {}; between them the action stays",
                     kLongestWait)},
        {"memory",
         {Form::text_rows(2, "NAME")},
         {},
         "`[[h_in, h_out], …]`: inputs of the file that get the output of the call before, 0 at first"}};
    out.keys.insert(out.keys.end(), rest.begin(), rest.end());
    out.more =
        "`control` says what becomes of the targets: `joint_pd` follows them, `torque` takes torques alone. "
        "docs/controllers.md tells more.";
    return out;
  }();
  return text;
}

enum class ActionKind { position, velocity, torque };

/// Warns of the first joint that cannot stand where `stance` says.
void doubt_stance(const Model& model, const Described& own, const std::vector<double>& stance) {
  const auto written = own.find("stance");
  for (std::size_t k = 0; k < stance.size() && written; ++k) {
    const Body& body = model.bodies[static_cast<std::size_t>(model.actuated[k])];
    if (stance[k] >= body.lower && stance[k] <= body.upper) continue;
    const char* const unit = body.type == JointType::revolute ? "rad" : "m";
    warn(*written, fmt::format("of joint {} is {:.6g} {}, and its limits are {:.6g} and {:.6g} {}", body.joint,
                               stance[k], unit, body.lower, body.upper, unit));
    return;
  }
}

/// The joints of `joints`, or all.
NetworkJoints read_network_joints(const ControlContext& context, const Described& own) {
  const Model& model = context.nominal;
  const std::vector<std::string> names = actuated_names(model);
  std::vector<double> stance = actuated_positions(model, context.initial);
  if (const auto written = own.find("stance")) {
    // Joints that no entry names stay where they begin.
    const std::vector<double> low = read_joint_values(model, *written, Quantity::angle, -1, Quantity::length);
    const std::vector<double> high = read_joint_values(model, *written, Quantity::angle, 1, Quantity::length);
    for (std::size_t k = 0; k < stance.size(); ++k) stance[k] = low[k] == high[k] ? low[k] : stance[k];
  }
  doubt_stance(model, own, stance);
  NetworkJoints out{{}, {}, std::move(stance)};
  const auto add = [&](std::size_t k) {
    out.actuators.push_back(static_cast<int>(k));
    out.names.push_back(names[k]);
  };
  const auto written = own.find("joints");
  for (std::size_t k = 0; k < names.size() && !written; ++k) add(k);
  for (const Settings& item : written ? written->items() : std::vector<Settings>{}) {
    const std::string name = item.text();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      item.fail("'" + name + "' is no driven joint of the robot" + similar_names(name, names, false));
    const auto k = static_cast<std::size_t>(found - names.begin());
    if (std::count(out.actuators.begin(), out.actuators.end(), static_cast<int>(k)))
      item.fail("'" + name + "' stands twice");
    add(k);
  }
  return out;
}

/// The joints' stances in the network's order.
NetworkJoints in_network_order(const NetworkJoints& joints) {
  NetworkJoints out = joints;
  out.stance.clear();
  for (const int k : joints.actuators) out.stance.push_back(joints.stance[static_cast<std::size_t>(k)]);
  return out;
}

Network read_network(const Settings& file, const NetworkKernel& kernel) {
  const std::string path = file.resolve_file(file.text());
  if (!input_exists(path)) {
    if (const std::string why = why_no_file(path); !why.empty()) file.fail(fmt::format("'{}': {}", path, why));
    file.fail(fmt::format("'{}' is not there{}", path, path_suggestion(path, {".onnx"})));
  }
  const std::string bytes = read_input(path, file.place() + ": " + file.path() + ": ");
  try {
    return Network(bytes, kernel);
  } catch (const NetworkError& error) {
    file.fail(fmt::format("{}: {}", path, error.what()));
  }
}

/// Inputs and outputs of the file by what they are for.
struct NetworkPorts {
  const NetworkPort *observation = nullptr, *action = nullptr;
  std::vector<std::pair<const NetworkPort*, const NetworkPort*>> memory;  // from the output to the input
};

std::vector<std::string> port_names(const std::vector<NetworkPort>& ports) {
  std::vector<std::string> out;
  for (const NetworkPort& port : ports) out.push_back(port.name);
  return out;
}

const NetworkPort& port_named(const std::vector<NetworkPort>& ports, const Settings& name, const char* what) {
  for (const NetworkPort& port : ports) {
    if (port.name == name.text()) return port;
  }
  name.fail(fmt::format("'{}' is no {} of the network; {}", name.text(), what,
                        nearest_or_all(name.text(), port_names(ports))));
}

std::string shapes_in_words(const std::vector<NetworkPort>& ports) {
  std::string out;
  for (const NetworkPort& port : ports)
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", port.name, text_of(port.shape));
  return out;
}

/// The input that is no memory, of which there must be one.
const NetworkPort* observed_input(const Network& network, const NetworkPorts& ports, const Settings& place) {
  const NetworkPort* out = nullptr;
  for (const NetworkPort& port : network.inputs()) {
    const bool kept =
        std::any_of(ports.memory.begin(), ports.memory.end(), [&](const auto& pair) { return pair.first == &port; });
    if (kept) continue;
    if (out != nullptr) {
      place.fail(
          fmt::format("the network has the inputs {}; one is for what is observed, the others must be named "
                      "under 'memory': [[INPUT, OUTPUT], …] (its outputs: {})",
                      shapes_in_words(network.inputs()), shapes_in_words(network.outputs())));
    }
    out = &port;
  }
  if (out == nullptr) place.fail("the network has no input for what is observed");
  return out;
}

NetworkPorts sort_ports(const Network& network, const Described& own) {
  NetworkPorts out;
  const auto memory = own.find("memory");
  for (const Settings& pair : memory ? memory->items() : std::vector<Settings>{}) {
    const std::vector<Settings> names = pair.items();
    if (names.size() != 2) pair.fail("must be a pair [INPUT, OUTPUT]");
    const NetworkPort& in = port_named(network.inputs(), names[0], "input");
    const NetworkPort& from = port_named(network.outputs(), names[1], "output");
    if (in.rows.size() != from.rows.size()) {
      pair.fail(fmt::format("the shape of {} is {}, and that of {} {}", in.name, text_of(in.shape), from.name,
                            text_of(from.shape)));
    }
    for (const auto& [earlier, source] : out.memory) {
      if (earlier == &in) names[0].fail(fmt::format("'{}' stands twice; it gets one output", in.name));
      if (source == &from) names[1].fail(fmt::format("'{}' stands twice; it goes into one input", from.name));
    }
    out.memory.emplace_back(&in, &from);
  }
  out.observation = observed_input(network, out, own.at("file"));
  for (const NetworkPort& port : network.outputs()) {
    const bool kept =
        std::any_of(out.memory.begin(), out.memory.end(), [&](const auto& pair) { return pair.second == &port; });
    if (!kept && out.action == nullptr) out.action = &port;
  }
  if (out.action == nullptr) own.at("file").fail("the network has no output but those under 'memory'");
  return out;
}

class NetworkPolicy : public Policy {
 public:
  NetworkPolicy(const ControlContext& context, const Described& own)
      : file_(own.at("file").text()),
        network_(read_network(own.at("file"), chosen_network_kernel())),
        ports_(sort_ports(network_, own)),
        joints_(read_network_joints(context, own)),
        seen_(context, own, in_network_order(joints_), chosen_network_kernel()),
        memory_(network_.memory()),
        action_(static_cast<int>(joints_.actuators.size())) {
    check_sizes(own);
    const std::string kind = own.word("action");
    kind_ = kind == "torque" ? ActionKind::torque : kind == "velocity" ? ActionKind::velocity : ActionKind::position;
    const auto written = own.find("scale");
    const std::vector<double> scale = written
                                          ? read_joint_values(context.nominal, *written, Quantity::dimensionless, 1.0)
                                          : read_joint_values_or(context.nominal, own, "scale");
    if (written) check_moved(*written);
    for (const int k : joints_.actuators) scale_.push_back(scale[static_cast<std::size_t>(k)]);
    clip_ = own.find_number("clip").value_or(std::numeric_limits<double>::infinity());
    if (const auto every = own.find("every")) every_ = read_count(*every, kLongestWait, "control steps");
    int rows = 0;
    for (const auto& [in, out] : ports_.memory) rows += static_cast<int>(in->rows.size());
    kept_ = BlockArray(rows);
  }

  unsigned reads() const override { return seen_.reads(); }

  void start(int lane) override {
    seen_.start(lane);
    wait_[static_cast<std::size_t>(lane)] = 0;
    for (BlockArray* rows : {&action_, &kept_}) {
      for (int k = 0; k < rows->rows(); ++k) (*rows)(k, lane) = 0;
    }
  }

  void carry(int lane, LaneTape& tape) override {
    seen_.carry(lane, tape);
    tape.carry(wait_[static_cast<std::size_t>(lane)]);
    tape.carry(action_, lane);
    tape.carry(kept_, lane);
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    LaneMask due;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      std::int64_t& wait = wait_[static_cast<std::size_t>(lane)];
      if (wait == 0) due.set(lane);
      wait = (wait == 0 ? every_ : wait) - 1;
    }
    if (due.any()) ask(observation, due);
    fill(active, targets);
  }

  std::vector<Inside> inside() const override {
    std::vector<Inside> out;
    for (const std::string& name : joints_.names) out.push_back({"action." + name, "1"});
    return out;
  }
  void look_inside(int lane, double* out) const override {
    for (int k = 0; k < action_.rows(); ++k) out[k] = action_(k, lane);
  }

 private:
  /// A factor of a joint that the network does not move would do nothing. Globs may match more joints.
  void check_moved(const Settings& scale) const {
    if (!scale.is_map()) return;
    for (const auto& [name, value] : scale.entries()) {
      const bool moved = std::find(joints_.names.begin(), joints_.names.end(), name) != joints_.names.end();
      if (moved || name.find_first_of("*?[{") != std::string::npos) continue;
      value.fail_key(fmt::format("the network does not move '{}'; it moves {}", name, listed(joints_.names)));
    }
  }

  void check_sizes(const Described& own) const {
    const int wanted = static_cast<int>(ports_.observation->rows.size()),
              moved = static_cast<int>(joints_.actuators.size());
    const TensorShape& shape = ports_.observation->shape;
    if (shape.size() > 1 && shape.front() > 1 && wanted == static_cast<int>(shape.front()) * seen_.size()) {
      own.at("file").fail(
          fmt::format("the network's input '{}' of shape {} is a batch of {} robots; export it with a "
                      "batch of 1, or an open one: lanes are Graze's own matter",
                      ports_.observation->name, text_of(shape), shape.front()));
    }
    if (wanted != seen_.size()) {
      const std::string fitting = seen_.of_size(wanted - seen_.size());
      own.at("inputs").fail(
          fmt::format("the network's input '{}' of shape {} takes {} numbers, and these are {}; {} {}{}",
                      ports_.observation->name, text_of(ports_.observation->shape), wanted, seen_.in_words(),
                      std::abs(wanted - seen_.size()), wanted > seen_.size() ? "are missing" : "are too many",
                      fitting.empty() ? "" : fmt::format(", as many as there are of {}", fitting)));
    }
    const int given = static_cast<int>(ports_.action->rows.size());
    if (given == moved) return;
    const Settings place = own.find("joints").value_or(own.at("file"));
    place.fail(
        fmt::format("the network's output '{}' of shape {} has {} numbers, and there are {} joints: {}; 'joints' "
                    "names those that it moves, in its order",
                    ports_.action->name, text_of(ports_.action->shape), given, moved, listed(joints_.names)));
  }

  static std::string listed(const std::vector<std::string>& names) {
    std::string out;
    for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
    return out;
  }

  /// One call of the network; what it gives is kept for the lanes that are due.
  void ask(const Observation& observation, LaneMask due) {
    seen_.see(observation, due, action_);
    for (int i = 0; i < seen_.size(); ++i) put(seen_.row(i), *ports_.observation, i);
    int row = 0;
    for (const auto& [in, out] : ports_.memory) {
      for (std::size_t i = 0; i < in->rows.size(); ++i) put(kept_.row(row++), *in, static_cast<int>(i));
    }
    network_.run(memory_);
    row = 0;
    for (const auto& [in, out] : ports_.memory) {
      for (const int from : out->rows) copy_lanes(kept_.row(row++), memory_.row(from), due);
    }
    for (int k = 0; k < action_.rows(); ++k) {
      const double* const from = memory_.row(ports_.action->rows[static_cast<std::size_t>(k)]);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!due[lane]) continue;
        if (!std::isfinite(from[lane])) not_finite(k, from[lane], observation.time[static_cast<std::size_t>(lane)]);
        action_(k, lane) = std::clamp(from[lane], -clip_, clip_);
      }
    }
  }

  /// Number i of an input, as the file has numbers.
  void put(const double* from, const NetworkPort& port, int i) {
    double* const to = memory_.row(port.rows[static_cast<std::size_t>(i)]);
    for (int lane = 0; lane < kLanes; ++lane) {
      to[lane] = port.single ? static_cast<double>(static_cast<float>(from[lane])) : from[lane];
    }
  }

  [[noreturn]] void not_finite(int k, double value, double time) const {
    throw std::runtime_error(fmt::format("{}: the network's output for joint {} at {:g} s is {}", file_,
                                         joints_.names[static_cast<std::size_t>(k)], time, value));
  }

  void fill(LaneMask active, Targets& targets) const {
    for (int k = 0; k < targets.q.rows(); ++k) {
      fill_lanes(targets.q.row(k), joints_.stance[static_cast<std::size_t>(k)], active);
      fill_lanes(targets.v.row(k), 0.0, active);
      fill_lanes(targets.tau.row(k), 0.0, active);
    }
    BlockArray& to = kind_ == ActionKind::torque ? targets.tau : kind_ == ActionKind::velocity ? targets.v : targets.q;
    for (int k = 0; k < action_.rows(); ++k) {
      const int joint = joints_.actuators[static_cast<std::size_t>(k)];
      const double scale = scale_[static_cast<std::size_t>(k)];
      for (int lane = 0; lane < kLanes; ++lane) {
        if (active[lane]) to(joint, lane) += scale * action_(k, lane);
      }
    }
  }

  const std::string file_;  // as it is written, for messages
  const Network network_;
  const NetworkPorts ports_;  // point into the network
  const NetworkJoints joints_;
  ObservationVector seen_;
  BlockArray memory_;  // of the network; nothing in it outlives a call
  BlockArray action_;  // cut, before its scale
  BlockArray kept_;    // from call to call, in the order of ports_.memory
  ActionKind kind_ = ActionKind::position;
  std::vector<double> scale_;
  double clip_ = 0;
  std::int64_t every_ = 1;
  std::array<std::int64_t, kLanes> wait_{};  // control steps until the next call
};

const PolicyRegistration network_registration("network", network_description(),
                                              [](const ControlContext& context, const Described& own,
                                                 TargetKind kind) -> std::unique_ptr<Policy> {
                                                need_joint_targets(own, kind, "network");
                                                return std::make_unique<NetworkPolicy>(context, own);
                                              });

}  // namespace

}  // namespace graze
