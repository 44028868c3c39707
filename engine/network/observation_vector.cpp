#include "engine/network/observation_vector.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/control/rows.h"
#include "engine/lanes/scalar.h"

namespace graze {

namespace {

constexpr long long kMostFrames = 1000;

enum class Seen {
  joint_position,
  joint_velocity,
  joint_torque,
  gravity,
  base_rate,
  base_velocity,
  base_rpy,
  base_height,
  command,
  last_action,
  phase,
  time
};

struct SeenKind {
  const char* name;
  Seen seen;
  int rows;  // 0: one for each joint
  unsigned reads;
};

constexpr std::array<SeenKind, 12> kSeenKinds = {{{"joint_position", Seen::joint_position, 0, kJointPosition},
                                                  {"joint_velocity", Seen::joint_velocity, 0, kJointVelocity},
                                                  {"joint_torque", Seen::joint_torque, 0, kJointTorque},
                                                  {"gravity", Seen::gravity, 3, kBaseTilt},
                                                  {"base_rate", Seen::base_rate, 3, kBaseRpy | kBaseRate},
                                                  {"base_velocity", Seen::base_velocity, 3, kBaseRpy | kBaseVelocity},
                                                  {"base_rpy", Seen::base_rpy, 3, kBaseRpy},
                                                  {"base_height", Seen::base_height, 1, kBaseHeight},
                                                  {"command", Seen::command, 3, 0},
                                                  {"last_action", Seen::last_action, 0, 0},
                                                  {"phase", Seen::phase, 2, 0},
                                                  {"time", Seen::time, 1, 0}}};

std::vector<std::string> seen_names() {
  std::vector<std::string> out;
  for (const SeenKind& kind : kSeenKinds) out.emplace_back(kind.name);
  return out;
}

const SeenKind& kind_named(const std::string& name) {
  return *std::find_if(kSeenKinds.begin(), kSeenKinds.end(), [&](const SeenKind& kind) { return name == kind.name; });
}

const Description& network_input_description() {
  static const Description text = {
      "what the network sees, in its order; a word alone stands for `{of: WORD}`",
      {{"of",
        {Form::word(seen_names())},
        Default::required(),
        "`joint_position` (from the stance), `joint_velocity`, `joint_torque`: of `joints`; in the base's axes "
        "`gravity` (where down is, of length 1), `base_rate`, `base_velocity`; `base_rpy`, `base_height`; `command`: "
        "forward, strafe, turn; `last_action`: before its scale; `phase`: sine and cosine of a clock; `time`"},
       {"mean", {Form::number(), Form::numbers(-1)}, Default::value("0"), "is subtracted first; of all or of each"},
       {"scale", {Form::number(), Form::numbers(-1)}, Default::value("1"), "is multiplied with"},
       {"clip", {Form::number(Quantity::dimensionless, Bound::positive)}, {}, "then it is cut to within ± this"},
       {"period", {Form::number(Quantity::time, Bound::positive)}, {}, "of the clock of `phase`"},
       {"offset", {Form::number()}, Default::value("0"), "of the clock when a trace begins, in cycles"}},
      {},
      {Form::word(seen_names())}};
  return text;
}

/// One number for all rows, or a number for each.
std::vector<double> row_numbers(const Described& own, std::string_view key, int rows) {
  const auto written = own.find(key);
  if (!written || !written->is_list()) return std::vector<double>(static_cast<std::size_t>(rows), own.number(key));
  std::vector<double> out = written->numbers(-1);
  if (static_cast<int>(out.size()) == rows) return out;
  written->fail(fmt::format("has {} numbers; there must be {}, or one for all", out.size(), rows));
}

}  // namespace

/// One entry of `inputs`.
struct ObservationVector::Term {
  SeenKind kind;
  int first, rows;  // of a frame
  std::vector<double> mean, scale;
  double clip;  // infinity: none
  double period = 0, offset = 0;
};

long long read_count(const Settings& value, long long most, const char* what) {
  const double number = value.number();
  // First the range, so that what integer() suggests lies in it.
  if (number < 1 || number > static_cast<double>(most)) {
    value.fail(fmt::format("{}: must be from 1 to {} {}; nearest right answer: {}", value.text(), most, what,
                           number < 1 ? 1 : most));
  }
  return value.integer();
}

std::vector<Key> observation_keys() {
  return {{"inputs", {Form::maps(network_input_description())}, Default::required(), network_input_description().help},
          {"history",
           {Form::whole(Bound::positive)},
           Default::value("1"),
           fmt::format("frames that it sees, at most {}: the newest and those before", kMostFrames)},
          {"newest", {Form::word({"last", "first"})}, Default::value("last"), "where the newest frame stands"},
          {"stacked",
           {Form::word({"frames", "inputs"})},
           Default::value("frames"),
           "`frames`: one whole frame behind the other; `inputs`: all frames of the first input, then of the next"},
          velocity_key(),
          waypoints_key(),
          commands_key()};
}

ObservationVector::ObservationVector(const ControlContext& context, const Described& own, const NetworkJoints& joints,
                                     const NetworkKernel& kernel)
    : joints_(joints), kernel_(&kernel) {
  read_terms(own);
  read_layout(own);
  std::vector<std::string> steering;  // the keys that are written, of which one may be
  for (const std::string& key : steering_keys()) {
    if (own.has(key)) steering.push_back(key);
  }
  if (steering.size() > 1) {
    own.at(steering[1]).fail_key(fmt::format("stands beside '{}'; one of them must go", steering[0]));
  }
  const bool steered = !steering.empty();
  const auto commanded =
      std::any_of(terms_.begin(), terms_.end(), [](const auto& term) { return term->kind.seen == Seen::command; });
  if (commanded && !steered) {
    own.at("inputs").fail_key(
        "has a command, which lacks its value: velocity: [forward, strafe, turn] or waypoints: … or commands: FILE");
  }
  if (steered && !commanded) {
    own.at(steering[0]).fail_key("is not among the inputs; add 'command' to them");
  }
  if (!steered) return;
  steering_ = read_steering(own.settings(), context.nominal.floating_base);
  reads_ |= steering_->reads();
  command_ = BlockArray(kCommandRows);
}

void ObservationVector::read_terms(const Described& own) {
  int rows = 0;
  const Settings list = own.at("inputs");
  if (!list.is_list()) list.fail("must be a list: [base_rate, gravity, {of: joint_position, scale: 0.5}, …]");
  for (const Settings& item : list.items()) {
    const Described entry(item, network_input_description());
    const std::string word = item.is_map() ? entry.word("of") : item.choice(seen_names());
    const SeenKind kind = kind_named(word);
    auto term = std::make_shared<Term>();
    term->kind = kind;
    term->first = rows;
    term->rows = kind.rows > 0 ? kind.rows : static_cast<int>(joints_.actuators.size());
    term->mean.assign(static_cast<std::size_t>(term->rows), 0.0);
    term->scale.assign(static_cast<std::size_t>(term->rows), 1.0);
    term->clip = std::numeric_limits<double>::infinity();
    const bool clock = kind.seen == Seen::phase;
    if (item.is_map()) {
      term->mean = row_numbers(entry, "mean", term->rows);
      term->scale = row_numbers(entry, "scale", term->rows);
      term->clip = entry.find_number("clip").value_or(term->clip);
      term->period = entry.find_number("period").value_or(0);
      term->offset = entry.number("offset");
      for (const char* key : {"period", "offset"}) {
        if (!clock && entry.has(key)) entry.at(key).fail_key("goes with 'of: phase'");
      }
    }
    if (clock && !(term->period > 0)) item.fail("phase lacks the period of its clock: {of: phase, period: 0.5 s}");
    rows += term->rows;
    reads_ |= kind.reads;
    terms_.push_back(std::move(term));
  }
  now_ = BlockArray(rows);
  down_ = rate_ = velocity_ = BlockArray(3);
}

void ObservationVector::read_layout(const Described& own) {
  const auto written = own.find("history");
  const long long frames = written ? read_count(*written, kMostFrames, "frames") : 1;
  if (frames == 1) {
    for (const char* key : {"newest", "stacked"}) {
      if (own.has(key)) own.at(key).fail_key("goes with a history of several frames");
    }
  }
  frames_.assign(static_cast<std::size_t>(frames), now_);
  const int count = static_cast<int>(frames);
  const bool last = own.word("newest") == "last";
  const auto add = [&](int first, int rows) {
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < rows; ++k) layout_.emplace_back(last ? count - 1 - i : i, first + k);
    }
  };
  if (own.word("stacked") == "frames") return add(0, now_.rows());
  for (const auto& term : terms_) add(term->first, term->rows);
}

std::string ObservationVector::in_words() const {
  std::string list;
  for (const auto& term : terms_) {
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", term->kind.name, term->rows);
  }
  return fmt::format("{}{}{}{}", size(), list.empty() ? "" : ": ", list,
                     frames_.size() > 1 ? fmt::format("; {} frames of {}", frames_.size(), now_.rows()) : "");
}

std::string ObservationVector::of_size(int missing) const {
  const int frames = static_cast<int>(frames_.size());
  std::string list;
  for (const SeenKind& kind : kSeenKinds) {
    const int rows = kind.rows > 0 ? kind.rows : static_cast<int>(joints_.actuators.size());
    const bool there =
        std::any_of(terms_.begin(), terms_.end(), [&](const auto& term) { return term->kind.seen == kind.seen; });
    if (missing > 0 && rows * frames == missing && !there) list += (list.empty() ? "" : ", ") + std::string(kind.name);
    if (missing < 0 && rows * frames == -missing && there) list += (list.empty() ? "" : ", ") + std::string(kind.name);
  }
  return list;
}

void ObservationVector::start(int lane) {
  fresh_.set(lane);
  if (steering_) steering_->start(lane);
}

void ObservationVector::carry(int lane, LaneTape& tape) {
  bool fresh = fresh_[lane];
  tape.carry(fresh);
  fresh_.set(lane, fresh);
  for (BlockArray& frame : frames_) tape.carry(frame, lane);
  if (steering_) steering_->carry(lane, tape);
}

/// What is sensed in the base's axes, if anybody wants it.
void ObservationVector::turn(const Observation& o) {
  BaseAxesCall call;
  for (const auto& term : terms_) {
    if (term->kind.seen == Seen::gravity) call.down = down_.row(0);
    if (term->kind.seen == Seen::base_rate) call.base_rate = rate_.row(0);
    if (term->kind.seen == Seen::base_velocity) call.base_velocity = velocity_.row(0);
  }
  call.rpy = o.base_rpy.row(0);
  call.rate = o.base_rate.row(0);
  call.velocity = o.base_velocity.row(0);
  if (call.down || call.base_rate || call.base_velocity) kernel_->base_axes(call);
}

void ObservationVector::see(const Observation& observation, LaneMask due, const BlockArray& action) {
  turn(observation);
  if (steering_) steering_->steer(observation, due, command_);
  for (const auto& term : terms_) fill(*term, observation, action, now_);
  const LaneMask first(due.bits() & fresh_.bits());
  for (int k = 0; k < now_.rows(); ++k) {
    for (std::size_t age = frames_.size() - 1; age > 0; --age) {
      copy_lanes(frames_[age].row(k), frames_[age - 1].row(k), due);
      copy_lanes(frames_[age].row(k), now_.row(k), first);
    }
    copy_lanes(frames_[0].row(k), now_.row(k), due);
  }
  fresh_ = LaneMask(fresh_.bits() & ~due.bits());
}

void ObservationVector::fill(const Term& term, const Observation& o, const BlockArray& action, BlockArray& out) const {
  constexpr std::array<int, 3> kPlanarRows = {0, 1, 5};  // forward, strafe, turn
  for (int i = 0; i < term.rows; ++i) {
    double* const to = out.row(term.first + i);
    const auto joint = [&](const BlockArray& rows) { return rows.row(joints_.actuators[static_cast<std::size_t>(i)]); };
    for (int lane = 0; lane < kLanes; ++lane) {
      switch (term.kind.seen) {
        case Seen::joint_position:
          to[lane] = joint(o.joint_position)[lane] - joints_.stance[static_cast<std::size_t>(i)];
          break;
        case Seen::joint_velocity:
          to[lane] = joint(o.joint_velocity)[lane];
          break;
        case Seen::joint_torque:
          to[lane] = joint(o.joint_torque)[lane];
          break;
        case Seen::gravity:
          to[lane] = down_(i, lane);
          break;
        case Seen::base_rate:
          to[lane] = rate_(i, lane);
          break;
        case Seen::base_velocity:
          to[lane] = velocity_(i, lane);
          break;
        case Seen::base_rpy:
          to[lane] = o.base_rpy(i, lane);
          break;
        case Seen::base_height:
          to[lane] = o.base_position(2, lane);
          break;
        case Seen::command:
          to[lane] = command_(kPlanarRows[static_cast<std::size_t>(i)], lane);
          break;
        case Seen::last_action:
          to[lane] = action(i, lane);
          break;
        case Seen::phase: {
          const double cycles = o.time[static_cast<std::size_t>(lane)] / term.period + term.offset;
          const auto [sine, cosine] = pinned::sin_cos(2 * std::numbers::pi * (cycles - std::floor(cycles)));
          to[lane] = i == 0 ? sine : cosine;
          break;
        }
        case Seen::time:
          to[lane] = o.time[static_cast<std::size_t>(lane)];
          break;
      }
    }
  }
  finish(term, out);
}

void ObservationVector::finish(const Term& term, BlockArray& out) const {
  for (int i = 0; i < term.rows; ++i) {
    double* const row = out.row(term.first + i);
    const double mean = term.mean[static_cast<std::size_t>(i)], scale = term.scale[static_cast<std::size_t>(i)];
    for (int lane = 0; lane < kLanes; ++lane) {
      const double x = (row[lane] - mean) * scale;
      row[lane] = x < -term.clip ? -term.clip : x > term.clip ? term.clip : x;
    }
  }
}

}  // namespace graze
