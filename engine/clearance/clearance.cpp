#include "engine/clearance/clearance.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/clearance/terrain_gap.h"
#include "engine/contact/collide.h"
#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"
#include "engine/model/convex_hull.h"

namespace graze {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// What sums of ways and measured gaps may be wrong by, m: a bound counts less this much.
constexpr double kSlack = 1e-6;
/// A reach that leaves nothing out, m.
constexpr double kAll = 1e9;

/// Of a ball about the shape's origin that holds it, m.
double radius_of(const Shape& shape, const Mesh* hull) {
  if (shape.kind != ShapeKind::mesh) {
    return bounding_radius<double>(shape.kind, {{shape.size.x(), shape.size.y(), shape.size.z()}});
  }
  double radius = 0;
  for (const Vec3& vertex : hull->vertices) radius = std::max(radius, vertex.cwiseProduct(shape.size).norm());
  return radius;
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

/// out = A B, 12 rows each.
void multiply(const double* A, const double* B, double* out) {
  const auto row = [](const double* X, int i) { return X + i * kLanes; };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      double* to = out + (j < 3 ? 3 * i + j : 9 + i) * kLanes;
      const int first = j < 3 ? j : 9, step = j < 3 ? 3 : 1;
      for (int lane = 0; lane < kLanes; ++lane) {
        double sum = j < 3 ? 0 : row(A, 9 + i)[lane];
        for (int k = 0; k < 3; ++k) sum += row(A, 3 * i + k)[lane] * row(B, first + step * k)[lane];
        to[lane] = sum;
      }
    }
  }
}

}  // namespace

Clearance::Clearance(const Model& nominal, Parts first, Parts second, double within)
    : first_(std::move(first)),
      second_(std::move(second)),
      within_(within),
      colliders_(static_cast<int>(nominal.colliders.size())),
      manifold_(kManifoldRows * kSlots) {
  bool meshes = false;
  for (std::size_t i = 0; i < nominal.pairs.size(); ++i) {
    const int a = nominal.pairs[i].a, b = nominal.pairs[i].b;
    const std::vector<unsigned>&f = first_.features, &s = second_.features;
    if (!((f[a] && s[b]) || (s[a] && f[b]))) continue;
    Pair pair;
    pair.index = static_cast<int>(i);
    pair.a = solid_of(nominal, a);
    pair.b = solid_of(nominal, b);
    const ShapeKind kind_a = solids_[pair.a].kind, kind_b = solids_[pair.b].kind;
    pair.ground = kind_a == ShapeKind::heightfield || kind_b == ShapeKind::heightfield;
    meshes = meshes || !has_kernel(kind_a, kind_b);
    pairs_.push_back(pair);
  }
  for (const Solid& solid : solids_) {
    views_.push_back(solid.grid ? HeightView{solid.grid->nx, solid.grid->ny, solid.grid->height.data()}
                                : HeightView{0, 0, nullptr});
  }
  if (meshes) hulls_.emplace(nominal, kLanes);
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
  solid.grid = of.shape.grid;
  if (of.shape.kind == ShapeKind::mesh) {
    solid.mesh = convex_hull(*of.shape.mesh);
    if (!solid.mesh) solid.mesh = of.shape.mesh;  // flat
  }
  solid.mover = -1;
  for (std::size_t i = 0; i < movers_.size(); ++i) {
    if (movers_[i].body == of.body) solid.mover = static_cast<int>(i);
  }
  if (solid.mover < 0 && of.body >= 0) {
    solid.mover = static_cast<int>(movers_.size());
    movers_.emplace_back().body = of.body;
  }
  solids_.push_back(std::move(solid));
  return static_cast<int>(solids_.size()) - 1;
}

void Clearance::start(int lane, const Model& model) {
  for (Mover& mover : movers_) mover.radius[lane] = 0;
  for (Solid& solid : solids_) {
    const Collider& collider = model.colliders[solid.collider];
    put_pose(collider.X_BG, lane, solid.X_BG);
    for (int k = 0; k < 3; ++k) solid.size(k, lane) = collider.shape.size[k];
    if (solid.mover < 0) continue;
    const double reach = collider.X_BG.translation().norm() + radius_of(collider.shape, solid.mesh.get());
    movers_[solid.mover].radius[lane] = std::max(movers_[solid.mover].radius[lane], reach);
  }
  if (hulls_) hulls_->start(lane, model);
  fresh_.set(lane);
}

/// How far each body's points can have gone since the last look: the way of its origin, and the greatest stretch of the
/// turn's chord, |R' - R| = |R' - R|_F / sqrt(2), times the radius.
void Clearance::move(const BlockState& state) {
  Row most{};
  for (Mover& mover : movers_) {
    Row way{}, turn{};
    for (int i = 0; i < 12; ++i) {
      const double* now = state.X.row(12 * mover.body + i);
      double *last = mover.last.row(i), *sum = i < 9 ? turn.data() : way.data();
      for (int lane = 0; lane < kLanes; ++lane) {
        const double d = now[lane] - last[lane];
        sum[lane] += d * d;
        last[lane] = now[lane];
      }
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      const double moved = std::sqrt(way[lane]) + mover.radius[lane] * std::sqrt(0.5 * turn[lane]);
      most[lane] = std::max(most[lane], moved);
      mover.travel[lane] = fresh_[lane] ? 0.0 : mover.travel[lane] + moved;
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) lowest_[lane] -= 2 * most[lane];
}

double Clearance::travel(const Pair& pair, int lane) const {
  const int a = solids_[pair.a].mover, b = solids_[pair.b].mover;
  return (a < 0 ? 0.0 : movers_[a].travel[lane]) + (b < 0 ? 0.0 : movers_[b].travel[lane]);
}

void Clearance::least(const BlockState& state, LaneMask lanes, const double* enough, double* out, double* part) {
  move(state);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!fresh_[lane] || !lanes[lane]) continue;
    for (Pair& pair : pairs_) pair.reserve[lane] = -kInfinity;
    lowest_[lane] = -kInfinity;
    fresh_.set(lane, false);
  }
  Row least;
  unsigned wanted = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    least[lane] = lanes[lane] ? std::min(within_, enough ? enough[lane] : within_) : -kInfinity;
    wanted |= static_cast<unsigned>(lanes[lane] && !(lowest_[lane] - kSlack >= least[lane])) << lane;
  }
  const Row limit = least;
  Row least_pair;
  least_pair.fill(-1);
  if (wanted != 0) {
    Row lowest;
    lowest.fill(kInfinity);
    for (Pair& pair : pairs_) {
      unsigned near = 0;
      for (int lane = 0; lane < kLanes; ++lane) {
        const double bound = pair.reserve[lane] - travel(pair, lane);
        near |= static_cast<unsigned>(!(bound - kSlack >= least[lane])) << lane;
      }
      if ((near & wanted) != 0) {
        const Row before = least;
        measure(pair, state, near & wanted, lanes.bits(), least);
        const double number = static_cast<double>(solids_[pair.a].collider) * colliders_ + solids_[pair.b].collider;
        for (int lane = 0; lane < kLanes; ++lane) {
          least_pair[lane] = least[lane] < before[lane] ? number : least_pair[lane];
        }
      }
      for (int lane = 0; lane < kLanes; ++lane) {
        lowest[lane] = std::min(lowest[lane], pair.reserve[lane] - travel(pair, lane));
      }
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      if (wanted >> lane & 1u) lowest_[lane] = lowest[lane];
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) out[lane] = least[lane] < limit[lane] ? least[lane] : within_;
  if (part != nullptr) std::copy(least_pair.begin(), least_pair.end(), part);
}

std::vector<Clearance::Overlap> Clearance::overlaps(const BlockState& state, int lane) {
  const unsigned bit = 1u << lane;
  std::vector<Overlap> out;
  for (Pair& pair : pairs_) {
    Row least;
    least.fill(-kInfinity);
    least[lane] = 0;
    measure(pair, state, bit, bit, least);
    if (least[lane] < 0) out.push_back({solids_[pair.a].collider, solids_[pair.b].collider, -least[lane]});
  }
  fresh_.set(lane);
  return out;
}

const double* Clearance::pose_of(Solid& solid, const BlockState& state) const {
  if (solid.mover < 0) return solid.X_BG.row(0);
  multiply(state.X.row(12 * movers_[solid.mover].body), solid.X_BG.row(0), solid.pose.row(0));
  return solid.pose.row(0);
}

/// `lanes`: where what costs nothing more is taken along, so that their times of looking fall together.
void Clearance::measure(Pair& pair, const BlockState& state, unsigned wanted, unsigned lanes, Row& least) {
  const double *pose_a = pose_of(solids_[pair.a], state), *pose_b = pose_of(solids_[pair.b], state);
  Row bound, enough;
  for (int lane = 0; lane < kLanes; ++lane) enough[lane] = least[lane] + kSlack;
  if (!has_kernel(solids_[pair.a].kind, solids_[pair.b].kind) || pair.ground) lanes = wanted;  // these go lane by lane
  if (find_points(pair, pose_a, pose_b, wanted, enough, bound)) {
    take_points(pair, lanes, bound, least);
    if (pair.ground) take_terrain(pair, pose_a, pose_b, wanted, bound, least);
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(lanes >> lane & 1u)) continue;
    pair.reserve[lane] = std::max(pair.reserve[lane], bound[lane] + travel(pair, lane));
  }
}

/// True if the manifold was filled, else `bound` is enough.
bool Clearance::find_points(const Pair& pair, const double* pose_a, const double* pose_b, unsigned wanted,
                            const Row& enough, Row& bound) {
  const Solid &a = solids_[pair.a], &b = solids_[pair.b];
  Row reach;
  reach.fill(pair.ground ? within_ : kAll);  // terrain takes time by the reach
  if (has_kernel(a.kind, b.kind)) {
    return kernel_of(chosen_isa(), kLanes)
        .measure_gap({{static_cast<int>(a.kind), a.size.row(0), pose_a, &views_[pair.a]},
                      {static_cast<int>(b.kind), b.size.row(0), pose_b, &views_[pair.b]},
                      wanted,
                      enough.data(),
                      reach.data(),
                      bound.data(),
                      manifold_.row(0)});
  }
  bound.fill(-kInfinity);
  hulls_->collide(pair.index, kLanes, wanted, pose_a, pose_b, reach.data(), manifold_.row(0));
  return true;
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
  const HeightView& grid = views_[a_is_ground ? pair.a : pair.b];
  const auto size_of = [](const Solid& solid, int lane) { return solid.size.vec3(0, lane); };
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(wanted >> lane & 1u) || bound[lane] <= 0) continue;
    const Vec3 size = size_of(shape, lane);
    std::vector<Vec3> corners;
    if (shape.mesh) {
      for (const Vec3& vertex : shape.mesh->vertices) corners.push_back(vertex.cwiseProduct(size));
    }
    const bullet::Convex convex{shape.kind, size, pose_in(a_is_ground ? pose_b : pose_a, lane), &corners};
    const Pose X_WT = pose_in(a_is_ground ? pose_a : pose_b, lane);
    const TerrainGap found = gap_above_terrain(convex, grid, size_of(ground, lane), X_WT, bound[lane]);
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
