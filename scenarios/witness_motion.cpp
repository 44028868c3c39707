// Witnesses of where links are and how they move. All margins are in SI units; several links: the least margin.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/lanes/scalar.h"
#include "scenarios/names.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

std::vector<int> read_frames(const Described& own, const Model& nominal) {
  const Settings link = own.at("link");
  return match_names(link, link.text(), frame_names(nominal), "link");
}

/// A row of lanes.
struct Lanes {
  double value[kLanes];
  double& operator[](int lane) { return value[lane]; }
  double operator[](int lane) const { return value[lane]; }
};
struct Lanes3 {
  Lanes x, y, z;
};

/// The parts of witnesses of these frames: one alone needs no telling.
PartKind parts_of(const std::vector<int>& frames) { return frames.size() > 1 ? PartKind::link : PartKind::none; }

/// R_WB u + p of a vector that is fixed in a body (-1: the world), rows [3] of a particle's numbers; `as_point`: with
/// p.
Lanes3 to_world(const BlockState& state, int body, const double* u_B, bool as_point) {
  const double *x = u_B, *y = u_B + kLanes, *z = u_B + 2 * kLanes;
  Lanes3 out;
  double* rows[3] = {out.x.value, out.y.value, out.z.value};
  for (int i = 0; i < 3; ++i) {
    if (body < 0) {
      std::copy_n(u_B + i * kLanes, kLanes, rows[i]);
      continue;
    }
    const double* R = state.X.row(12 * body + 3 * i);
    const double* p = state.X.row(12 * body + 9 + i);
    for (int l = 0; l < kLanes; ++l) {
      rows[i][l] = R[l] * x[l] + R[kLanes + l] * y[l] + R[2 * kLanes + l] * z[l] + (as_point ? p[l] : 0.0);
    }
  }
  return out;
}

Lanes3 rows3(const double* rows) {
  Lanes3 out;
  std::copy_n(rows, kLanes, out.x.value);
  std::copy_n(rows + kLanes, kLanes, out.y.value);
  std::copy_n(rows + 2 * kLanes, kLanes, out.z.value);
  return out;
}

Lanes3 minus(const Lanes3& a, const Lanes3& b) {
  Lanes3 out;
  for (int l = 0; l < kLanes; ++l) {
    out.x[l] = a.x[l] - b.x[l], out.y[l] = a.y[l] - b.y[l], out.z[l] = a.z[l] - b.z[l];
  }
  return out;
}

Lanes3 scaled(const Lanes3& a, const double* by) {
  Lanes3 out;
  for (int l = 0; l < kLanes; ++l) out.x[l] = a.x[l] * by[l], out.y[l] = a.y[l] * by[l], out.z[l] = a.z[l] * by[l];
  return out;
}

void add(const Lanes3& a, Lanes3& sum) {
  for (int l = 0; l < kLanes; ++l) sum.x[l] += a.x[l], sum.y[l] += a.y[l], sum.z[l] += a.z[l];
}

/// sum += w x r
void add_cross(const Lanes3& w, const Lanes3& r, Lanes3& sum) {
  for (int l = 0; l < kLanes; ++l) {
    sum.x[l] += w.y[l] * r.z[l] - w.z[l] * r.y[l];
    sum.y[l] += w.z[l] * r.x[l] - w.x[l] * r.z[l];
    sum.z[l] += w.x[l] * r.y[l] - w.y[l] * r.x[l];
  }
}

void write(const Vec3& u, int first, int lane, BlockArray& own) {
  for (int i = 0; i < 3; ++i) own(first + i, lane) = u[i];
}

/// The greatest tilt of a lane that was looked at: a smaller one needs no angle, as its margin is greater.
struct TiltMemory final : WitnessMemory {
  Lanes key, value;  // of Tilt::evaluate
  void start(int lane, const Model&) override { key[lane] = -1; }
  void carry(int, LaneTape&) override {}  // what it keeps saves time, and changes no margin
};

/// Angle between the link's z axis and the world's, against the largest that is allowed. Numbers: the z axes, [3] each.
class Tilt : public Witness {
 public:
  Tilt(const Model& nominal, std::vector<int> frames, double below) : frames_(std::move(frames)), below_(below) {
    for (const int frame : frames_) body_.push_back(nominal.frames[frame].body);
  }

  int numbers() const override { return 3 * static_cast<int>(frames_.size()); }

  void read(const Model& model, int lane, BlockArray& own) const override {
    for (int i = 0; i < static_cast<int>(frames_.size()); ++i) {
      write(model.frames[frames_[i]].X_BF.linear().col(2), 3 * i, lane, own);
    }
  }

  PartKind parts() const override { return parts_of(frames_); }
  std::unique_ptr<WitnessMemory> remember() const override { return std::make_unique<TiltMemory>(); }

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out, double* part) const override {
    // The most tilted has the greatest key; only its angle is computed.
    Lanes greatest, sine2{}, cosine{};
    std::fill_n(greatest.value, kLanes, -1.0);
    std::fill_n(part, kLanes, double{kNoPart});
    for (int i = 0; i < static_cast<int>(frames_.size()); ++i) {
      const Lanes3 z_W = to_world(in.state, body_[i], own.row(3 * i), false);
      for (int l = 0; l < kLanes; ++l) {
        const double s2 = z_W.x[l] * z_W.x[l] + z_W.y[l] * z_W.y[l];
        const double key = z_W.z[l] > 0 ? s2 : 2 - s2;
        const bool more = key > greatest[l];
        greatest[l] = more ? key : greatest[l];
        part[l] = more ? frames_[i] : part[l];
        sine2[l] = more ? s2 : sine2[l];
        cosine[l] = more ? z_W.z[l] : cosine[l];
      }
    }
    TiltMemory& most = *static_cast<TiltMemory*>(in.memory);
    for (int l = 0; l < kLanes; ++l) {
      if (!in.lanes[l]) continue;
      if (in.enough && greatest[l] < most.key[l] - kKeySlack && in.enough[l] <= most.value[l]) {
        out[l] = most.value[l];
        continue;
      }
      out[l] = below_ - pinned::atan2(std::sqrt(sine2[l]), cosine[l]);
      if (in.enough && greatest[l] > most.key[l]) most.key[l] = greatest[l], most.value[l] = out[l];
    }
  }

 private:
  /// Keys that differ by more are of angles in the same order: far beyond the rounding of rotations (1e-15).
  static constexpr double kKeySlack = 1e-9;
  std::vector<int> frames_, body_;
  double below_;  // rad
};

/// Numbers of a frame: the place of its origin in its body, [3].
void read_origins(const Model& model, const std::vector<int>& frames, int lane, BlockArray& own) {
  for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
    write(model.frames[frames[i]].X_BF.translation(), 3 * i, lane, own);
  }
}

/// The origins of all frames lie in a box of the world (sides may be open).
class Region : public Witness {
 public:
  Region(const Model& nominal, std::vector<int> frames, const Vec3& above, const Vec3& below)
      : frames_(std::move(frames)), above_(above), below_(below) {
    for (const int frame : frames_) body_.push_back(nominal.frames[frame].body);
  }

  int numbers() const override { return 3 * static_cast<int>(frames_.size()); }
  void read(const Model& model, int lane, BlockArray& own) const override { read_origins(model, frames_, lane, own); }

  PartKind parts() const override { return parts_of(frames_); }

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out, double* part) const override {
    std::fill_n(out, kLanes, std::numeric_limits<double>::infinity());
    std::fill_n(part, kLanes, double{kNoPart});
    for (int i = 0; i < static_cast<int>(frames_.size()); ++i) {
      const Lanes3 p_W = to_world(in.state, body_[i], own.row(3 * i), true);
      const Lanes* axis[3] = {&p_W.x, &p_W.y, &p_W.z};
      for (int k = 0; k < 3; ++k) {
        const Lanes& p = *axis[k];
        for (int l = 0; l < kLanes; ++l) {
          const double margin = std::min(p[l] - above_[k], below_[k] - p[l]);
          part[l] = margin < out[l] ? frames_[i] : part[l];
          out[l] = margin < out[l] ? margin : out[l];
        }
      }
    }
  }

 private:
  std::vector<int> frames_, body_;
  Vec3 above_, below_;  // m; infinite where open
};

/// Speed of the frames' origins. Numbers: their places, and the axis of each body's joint in its frame, [3] each.
class Speed : public Witness {
 public:
  Speed(const Model& nominal, std::vector<int> frames, double below) : frames_(std::move(frames)), below_(below) {
    for (const int frame : frames_) body_.push_back(nominal.frames[frame].body);
    for (const Body& body : nominal.bodies) joints_.push_back({body.parent, body.v, body.type});
  }

  int numbers() const override { return 3 * static_cast<int>(frames_.size() + joints_.size()); }

  void read(const Model& model, int lane, BlockArray& own) const override {
    read_origins(model, frames_, lane, own);
    for (int b = 0; b < static_cast<int>(joints_.size()); ++b) write(model.bodies[b].axis, axis_row(b), lane, own);
  }

  PartKind parts() const override { return parts_of(frames_); }

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out, double* part) const override {
    Lanes largest{};
    std::fill_n(part, kLanes, static_cast<double>(frames_.front()));
    for (int i = 0; i < static_cast<int>(frames_.size()); ++i) {
      const Lanes3 v = velocity(in.state, own, body_[i], to_world(in.state, body_[i], own.row(3 * i), true));
      for (int l = 0; l < kLanes; ++l) {
        const double v2 = v.x[l] * v.x[l] + v.y[l] * v.y[l] + v.z[l] * v.z[l];
        part[l] = largest[l] < v2 ? frames_[i] : part[l];
        largest[l] = std::max(largest[l], v2);
      }
    }
    for (int l = 0; l < kLanes; ++l) out[l] = below_ - std::sqrt(largest[l]);
  }

 private:
  struct Joint {
    int parent, v;
    JointType type;
  };
  int axis_row(int body) const { return 3 * (static_cast<int>(frames_.size()) + body); }

  /// Velocity of a point of a body: what each joint on the way to the world adds.
  Lanes3 velocity(const BlockState& state, const BlockArray& own, int body, const Lanes3& p_W) const {
    Lanes3 sum{};
    for (int b = body; b >= 0; b = joints_[b].parent) {
      const Joint& joint = joints_[b];
      const Lanes3 r = minus(p_W, rows3(state.X.row(12 * b + 9)));
      if (joint.type == JointType::floating) {
        add_cross(rows3(state.v.row(joint.v)), r, sum);
        add(rows3(state.v.row(joint.v + 3)), sum);
        continue;
      }
      const Lanes3 motion = scaled(to_world(state, b, own.row(axis_row(b)), false), state.v.row(joint.v));
      if (joint.type == JointType::revolute) {
        add_cross(motion, r, sum);
      } else {
        add(motion, sum);
      }
    }
    return sum;
  }

  std::vector<int> frames_, body_;
  std::vector<Joint> joints_;  // of every body
  double below_;               // m/s
};

constexpr double kOpen = std::numeric_limits<double>::infinity();

/// Range of the least margin of several frames: a link that is welded to the world has `welded(pose)` all along, every
/// other one `free`.
template <typename Welded>
WitnessRange least_of_frames(const Model& nominal, const std::vector<int>& frames, const WitnessRange& free,
                             const Welded& welded) {
  WitnessRange out{kOpen, kOpen, "", false};
  for (const int i : frames) {
    const Frame& frame = nominal.frames[i];
    WitnessRange one = free;
    if (frame.body < 0) {
      one.low = one.high = welded(frame.X_BF);
      one.why = fmt::format("{} is welded to the world, and its margin is {:g} all along", frame.name, one.high);
      one.of_nominal = true;
    }
    if (one.high < out.high || out.why.empty()) out.why = one.why, out.of_nominal = one.of_nominal;
    out.low = std::min(out.low, one.low);
    out.high = std::min(out.high, one.high);
  }
  return out;
}

/// `{above: …, below: …}`, at least one of them.
void read_range(const Described& own, double& above, double& below) {
  above = own.find_number("above").value_or(-kOpen);
  below = own.find_number("below").value_or(kOpen);
  if (!own.has("above") && !own.has("below")) own.settings().fail("needs 'above', 'below' or both");
  if (above >= below) {
    own.settings().fail(fmt::format("above {:g} m lies {} below {:g} m: nothing is between", above,
                                    above > below ? "over" : "at", below));
  }
}

/// "x > 1 m, y > -0.5 m and y < 0.5 m"
std::string region_text(const Vec3& above, const Vec3& below) {
  std::vector<std::string> bounds;
  for (int i = 0; i < 3; ++i) {
    if (std::isfinite(above[i])) bounds.push_back(fmt::format("{} > {:g} m", "xyz"[i], above[i]));
    if (std::isfinite(below[i])) bounds.push_back(fmt::format("{} < {:g} m", "xyz"[i], below[i]));
  }
  std::string out = bounds.empty() ? "anywhere" : bounds.front();
  for (std::size_t i = 1; i < bounds.size(); ++i) out += (i + 1 < bounds.size() ? ", " : " and ") + bounds[i];
  return out;
}

}  // namespace

namespace {

constexpr const char* kMostTilt = "an angle from the vertical is at most pi rad (180 deg)";

/// Of a region: the margin is greatest in its middle.
WitnessRange region_range(const Model& nominal, const std::vector<int>& frames, const Vec3& above, const Vec3& below) {
  return least_of_frames(nominal, frames, {-kOpen, 0.5 * (below - above).minCoeff(), "", false}, [&](const Pose& X) {
    return std::min((X.translation() - above).minCoeff(), (below - X.translation()).minCoeff());
  });
}

const Description& region_description() {
  static const Description text = {
      "an interval, open at one end or not",
      {{"above", {Form::number(Quantity::length)}, {}, "the lower bound; at least one of the two"},
       {"below", {Form::number(Quantity::length)}, {}, "the upper bound"}}};
  return text;
}

ReadWitness read_tilt(const Described& own, const Model& nominal) {
  const std::vector<int> frames = read_frames(own, nominal);
  const double below = own.number("below");
  return {std::make_shared<Tilt>(nominal, frames, below),
          fmt::format("tilt of {} below {:g} rad", own.at("link").text(), below), "rad",
          least_of_frames(nominal, frames, {below - std::numbers::pi, below, kMostTilt, false}, [&](const Pose& X) {
            return below - pinned::acos(std::clamp(X.linear()(2, 2), -1.0, 1.0));
          })};
}

ReadWitness read_height(const Described& own, const Model& nominal) {
  const std::vector<int> frames = read_frames(own, nominal);
  Vec3 above = Vec3::Constant(-kOpen), below = Vec3::Constant(kOpen);
  read_range(own, above.z(), below.z());
  return {std::make_shared<Region>(nominal, frames, above, below),
          own.at("link").text() + " " + region_text(above, below), "m", region_range(nominal, frames, above, below)};
}

ReadWitness read_position(const Described& own, const Model& nominal) {
  const std::vector<int> frames = read_frames(own, nominal);
  Vec3 above = Vec3::Constant(-kOpen), below = Vec3::Constant(kOpen);
  constexpr const char* kAxes[] = {"x", "y", "z"};
  bool any = false;
  for (int i = 0; i < 3; ++i) {
    const auto range = own.find(kAxes[i]);
    if (!range) continue;
    read_range(Described(*range, region_description()), above[i], below[i]);
    any = true;
  }
  if (!any) own.settings().fail("needs one of x, y, z, e.g. y: {below: -0.2 m}");
  return {std::make_shared<Region>(nominal, frames, above, below),
          own.at("link").text() + " " + region_text(above, below), "m", region_range(nominal, frames, above, below)};
}

ReadWitness read_speed(const Described& own, const Model& nominal) {
  const std::vector<int> frames = read_frames(own, nominal);
  const double below = own.number("below");
  return {std::make_shared<Speed>(nominal, frames, below),
          fmt::format("speed of {} below {:g} m/s", own.at("link").text(), below), "m/s",
          least_of_frames(nominal, frames, {-kOpen, below, "", false}, [&](const Pose&) { return below; })};
}

}  // namespace

std::vector<WitnessKind> motion_witnesses() {
  const Key link = {"link", {Form::text("GLOB")}, Default::required(), "links; of several the worst counts"};
  const auto axis = [](const char* name) {
    return Key{name, {Form::map(region_description())}, {}, "bounds on that axis, m; at least one axis"};
  };
  const std::vector<Key> bounds = region_description().keys;
  return {
      {"tilt",
       {"angle of a link's z axis from the vertical stays below a bound",
        {link, {"below", {Form::number(Quantity::angle, Bound::positive)}, Default::required(), "the largest angle"}}},
       "rad",
       read_tilt},
      {"height", {"z of a link's origin stays above or below a bound", {link, bounds[0], bounds[1]}}, "m", read_height},
      {"position", {"a link's origin stays in a region", {link, axis("x"), axis("y"), axis("z")}}, "m", read_position},
      {"speed",
       {"a link's origin stays slower than a bound",
        {link, {"below", {Form::number(Quantity::velocity, Bound::positive)}, Default::required(), "the bound"}}},
       "m/s",
       read_speed},
  };
}

}  // namespace graze
