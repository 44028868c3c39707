#include "engine/clearance/clearance.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/clearance/terrain_gap.h"
#include "engine/contact/collide.h"
#include "engine/contact/features.h"
#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"
#include "sampling/constants.h"

namespace graze {
namespace {

/// A bound counts less this much, m: sums of ways are wrong by rounding, and gaps at the rims of cylinders, which take
/// iterations, by up to 1e-6.
constexpr double kSlack = 2e-6;
/// A reach that leaves nothing out, m.
constexpr double kAll = 1e9;

/// Of a ball about the shape's origin (a mesh's: its hull's centre) that holds it, m.
double radius_of(const Shape& shape, const HullView& hull) {
  return bounding_radius<double>(shape.kind, {{shape.size.x(), shape.size.y(), shape.size.z()}, nullptr, &hull});
}

void put_pose(const Pose& X, int lane, BlockArray& rows) {
  for (int i = 0; i < 9; ++i) rows(i, lane) = X.linear()(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) rows(9 + i, lane) = X.translation()[i];
}

Pose pose_in(const double* rows, int lane) {
  Pose X = Pose::Identity();
  for (int i = 0; i < 9; ++i) X.linear()(i / 3, i % 3) = rows[i * kLanes + lane];
  for (int i = 0; i < 3; ++i) X.translation()[i] = rows[(9 + i) * kLanes + lane];
  return X;
}

}  // namespace

Clearance::Clearance(const Model& nominal, Parts first, Parts second, double within)
    : kernel_(&kernel_of(chosen_isa(), kLanes)),
      first_(std::move(first)),
      second_(std::move(second)),
      within_(within),
      colliders_(static_cast<int>(nominal.colliders.size())),
      manifold_(kManifoldRows * kSlots) {
  for (std::size_t i = 0; i < nominal.pairs.size(); ++i) {
    const int a = nominal.pairs[i].a, b = nominal.pairs[i].b;
    const std::vector<unsigned>&f = first_.features, &s = second_.features;
    if (!((f[a] && s[b]) || (s[a] && f[b]))) continue;
    Pair pair;
    pair.a = solid_of(nominal, a);
    pair.b = solid_of(nominal, b);
    const ShapeKind kind_a = solids_[pair.a].kind, kind_b = solids_[pair.b].kind;
    pair.ground = kind_a == ShapeKind::heightfield || kind_b == ShapeKind::heightfield;
    pairs_.push_back(pair);
    places_.insert(places_.end(), {solids_[pair.a].place, solids_[pair.b].place});
  }
  const int bodies = static_cast<int>(bodies_.size()), pairs = static_cast<int>(pairs_.size());
  radius_ = BlockArray(bodies), travel_ = BlockArray(1 + bodies);
  reserve_ = BlockArray(pairs), axis_ = BlockArray(3 * pairs);
  for (int i = 0; i < pairs; ++i) std::fill_n(axis_.row(3 * i), kLanes, 1.0);
  due_.resize(pairs), due_lanes_.resize(pairs);
  for (const Solid& solid : solids_) hull_views_.push_back(solid.hull.view());
  views_.resize(solids_.size());
  for (int lane = 0; lane < kLanes; ++lane) start(lane, nominal);
}

int Clearance::solid_of(const Model& nominal, int collider) {
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    if (solids_[i].collider == collider) return static_cast<int>(i);
  }
  const Collider& of = nominal.colliders[collider];
  Solid solid;
  solid.collider = collider;
  solid.kind = of.shape.kind;
  if (of.shape.kind == ShapeKind::mesh) solid.hull = HullArrays(*hull_of(of.shape));
  solid.place = 0;
  if (of.body >= 0) {
    const auto at = std::find(bodies_.begin(), bodies_.end(), of.body);
    solid.place = 1 + static_cast<int>(at - bodies_.begin());
    if (at == bodies_.end()) bodies_.push_back(of.body);
  }
  solids_.push_back(std::move(solid));
  return static_cast<int>(solids_.size()) - 1;
}

void Clearance::start(int lane, const Model& model) {
  for (int i = 0; i < radius_.rows(); ++i) radius_(i, lane) = 0;
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    Solid& solid = solids_[i];
    const Collider& collider = model.colliders[solid.collider];
    const Pose X_BG = solid.hull.placed(collider.X_BG, collider.shape.size);
    put_pose(X_BG, lane, solid.X_BG);
    for (int k = 0; k < 3; ++k) solid.size(k, lane) = collider.shape.size[k];
    if (const auto& grid = collider.shape.grid) {
      solid.grid[lane] = grid;
      views_[i][lane] = {grid->nx, grid->ny, grid->height.data()};
    }
    if (solid.place == 0) {
      put_pose(X_BG, lane, solid.pose);
      continue;
    }
    const double reach = X_BG.translation().norm() + radius_of(collider.shape, hull_views_[i]);
    double& radius = radius_(solid.place - 1, lane);
    radius = std::max(radius, reach);
  }
  fresh_.set(lane);
  if (own_) own_->start(lane);
}

void Clearance::move(const BlockState& state, BodyMoves* moves) {
  if (moves == nullptr) {
    if (!own_) own_.emplace(bodies_);
    own_->next();
    moves = &*own_;
  }
  moves->look(state);
  if (rows_.empty()) {
    for (const int body : bodies_) rows_.push_back(moves->row_of(body));
  }
  Row most;
  kernel_->add_travel({static_cast<int>(bodies_.size()), rows_.data(), moves->turn(), moves->way(), radius_.row(0),
                       travel_.row(0), most.data()});
  for (int lane = 0; lane < kLanes; ++lane) lowest_[lane] -= 2 * most[lane];
}

void Clearance::least(const BlockState& state, LaneMask lanes, const double* enough, double* out, double* part,
                      BodyMoves* moves) {
  if (!pairs_.empty()) move(state, moves);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!fresh_[lane] || !lanes[lane]) continue;
    for (int i = 0; i < reserve_.rows(); ++i) reserve_(i, lane) = -kInfinity;
    lowest_[lane] = -kInfinity;
    fresh_.set(lane, false);
  }
  Row least, least_pair;
  least_pair.fill(-1);
  unsigned wanted = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    least[lane] = lanes[lane] ? std::min(within_, enough ? enough[lane] : within_) : -kInfinity;
    wanted |= static_cast<unsigned>(lanes[lane] && !(lowest_[lane] - kSlack >= least[lane])) << lane;
  }
  const Row limit = least;
  if (wanted != 0 && !pairs_.empty()) look(state, wanted, least, least_pair);
  for (int lane = 0; lane < kLanes; ++lane) out[lane] = least[lane] < limit[lane] ? least[lane] : within_;
  if (part != nullptr) std::copy(least_pair.begin(), least_pair.end(), part);
}

std::vector<Clearance::Overlap> Clearance::overlaps(const BlockState& state, int lane) {
  std::vector<Overlap> out;
  ++looks_;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    Row least;
    least.fill(-kInfinity);
    least[lane] = 0;
    measure(static_cast<int>(i), state, 1u << lane, least);
    if (least[lane] < 0) out.push_back({solids_[pairs_[i].a].collider, solids_[pairs_[i].b].collider, -least[lane]});
  }
  fresh_.set(lane);
  return out;
}

void Clearance::look(const BlockState& state, unsigned wanted, Row& least, Row& least_pair) {
  ++looks_;
  Row enough, lowest;
  for (int lane = 0; lane < kLanes; ++lane) enough[lane] = least[lane] + kSlack;
  const int due = kernel_->find_due({static_cast<int>(pairs_.size()), places_.data(), reserve_.row(0), travel_.row(0),
                                     enough.data(), wanted, lowest.data(), due_.data(), due_lanes_.data()});
  for (int i = 0; i < due; ++i) {
    const int at = due_[i];
    const Pair& pair = pairs_[at];
    const Row before = least;
    measure(at, state, due_lanes_[i], least);
    const double number = static_cast<double>(solids_[pair.a].collider) * colliders_ + solids_[pair.b].collider;
    const double *reserve = reserve_.row(at), *a = travel_.row(places_[2 * at]), *b = travel_.row(places_[2 * at + 1]);
    for (int lane = 0; lane < kLanes; ++lane) {
      least_pair[lane] = least[lane] < before[lane] ? number : least_pair[lane];
      lowest[lane] = std::min(lowest[lane], reserve[lane] - (a[lane] + b[lane]));
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    if (wanted >> lane & 1u) lowest_[lane] = lowest[lane];
  }
}

/// Once per look.
const double* Clearance::pose_of(Solid& solid, const BlockState& state) const {
  if (solid.place > 0 && solid.posed != looks_) {
    kernel_->place(state.X.row(12 * bodies_[solid.place - 1]), solid.X_BG.row(0), solid.pose.row(0));
    solid.posed = looks_;
  }
  return solid.pose.row(0);
}

void Clearance::measure(int pair, const BlockState& state, unsigned wanted, Row& least) {
  const Pair& of = pairs_[pair];
  const double *pose_a = pose_of(solids_[of.a], state), *pose_b = pose_of(solids_[of.b], state);
  Row bound, enough;
  for (int lane = 0; lane < kLanes; ++lane) enough[lane] = least[lane] + kSlack;
  const unsigned open = find_points(pair, pose_a, pose_b, wanted, enough, bound);
  if (open != 0) {
    take_points(of, open, bound, least);
    if (of.ground) take_terrain(of, pose_a, pose_b, open, bound, least);
  }
  double* reserve = reserve_.row(pair);
  const double *a = travel_.row(places_[2 * pair]), *b = travel_.row(places_[2 * pair + 1]);
  // A kernel's bounds are of all lanes: so their times of looking fall together.
  for (int lane = 0; lane < kLanes; ++lane) reserve[lane] = std::max(reserve[lane], bound[lane] + (a[lane] + b[lane]));
}

/// The lanes in which the manifold was filled; in the others `bound` is enough.
unsigned Clearance::find_points(int pair, const double* pose_a, const double* pose_b, unsigned wanted,
                                const Row& enough, Row& bound) {
  const Pair& of = pairs_[pair];
  const Solid &a = solids_[of.a], &b = solids_[of.b];
  Row reach;
  reach.fill(of.ground ? within_ : kAll);  // terrain takes time by the reach
  return kernel_->measure_gap(
      {{static_cast<int>(a.kind), a.size.row(0), pose_a, views_[of.a].data(), &hull_views_[of.a]},
       {static_cast<int>(b.kind), b.size.row(0), pose_b, views_[of.b].data(), &hull_views_[of.b]},
       wanted,
       enough.data(),
       reach.data(),
       axis_.row(3 * pair),
       bound.data(),
       manifold_.row(0)});
}

/// The points that are meant go into `least`; `bound` becomes the gap of the whole pair.
void Clearance::take_points(const Pair& pair, unsigned wanted, Row& bound, Row& least) const {
  const int a = solids_[pair.a].collider, b = solids_[pair.b].collider;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(wanted >> lane & 1u)) continue;
    bound[lane] = pair.ground ? within_ : kAll;
    for (int k = 0; k < kSlots; ++k) {
      const double* slot = manifold_.row(k * kManifoldRows) + lane;
      if (!(slot[kRowValid * kLanes] > 0.5)) continue;
      const double gap = slot[kRowPhi * kLanes];
      bound[lane] = std::min(bound[lane], gap);
      const auto feature = [&](int row) { return static_cast<Feature>(static_cast<int>(slot[row * kLanes])); };
      if (gap < least[lane] && meant(first_, second_, a, feature(kRowFeatureA), b, feature(kRowFeatureB))) {
        least[lane] = gap;
      }
    }
  }
}

/// What the kernels miss over terrain.
void Clearance::take_terrain(const Pair& pair, const double* pose_a, const double* pose_b, unsigned wanted, Row& bound,
                             Row& least) const {
  const bool a_is_ground = solids_[pair.a].kind == ShapeKind::heightfield;
  const Solid &shape = solids_[a_is_ground ? pair.b : pair.a], &ground = solids_[a_is_ground ? pair.a : pair.b];
  if (shape.kind == ShapeKind::sphere) return;  // exact as it is
  const std::array<HeightView, kLanes>& grids = views_[a_is_ground ? pair.a : pair.b];
  const auto size_of = [](const Solid& solid, int lane) { return solid.size.vec3(0, lane); };
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(wanted >> lane & 1u) || bound[lane] <= 0) continue;
    const Vec3 size = size_of(shape, lane);
    std::vector<Vec3> corners;
    for (int k = 0; k < shape.hull.count(); ++k) corners.push_back(shape.hull.corner(k).cwiseProduct(size));
    const Corners hull(corners);
    const Convex convex{shape.kind, size, pose_in(a_is_ground ? pose_b : pose_a, lane), &hull};
    const Pose X_WT = pose_in(a_is_ground ? pose_a : pose_b, lane);
    const TerrainGap found = gap_above_terrain(convex, grids[lane], size_of(ground, lane), X_WT, bound[lane]);
    if (!(found.gap < bound[lane])) continue;
    bound[lane] = found.gap;
    const Feature on_shape = feature_of({shape.kind, size, nullptr, nullptr}, convex.X.inverse() * found.p_W);
    const Feature on_a = a_is_ground ? Feature::surface : on_shape, on_b = a_is_ground ? on_shape : Feature::surface;
    if (found.gap < least[lane] &&
        meant(first_, second_, solids_[pair.a].collider, on_a, solids_[pair.b].collider, on_b)) {
      least[lane] = found.gap;
    }
  }
}

}  // namespace graze
