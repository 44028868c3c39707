#pragma once
// How far apart chosen parts are, for witnesses: the least signed gap over some pairs of colliders, from the poses
// after a step. The physics does not know of it: it looks at a state only, with geometry of its own reach, and so
// returns the same for every back end. Gaps are exact up to a distance that is asked for.
//
// Most steps need no geometry: a gap that was measured once shrinks no faster than its bodies move. And where they have
// moved by more, the shapes are mostly still apart in the direction in which they were then.

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "engine/block_physics.h"
#include "engine/clearance/body_moves.h"
#include "engine/contact/hull_arrays.h"
#include "engine/lane_physics/kernel.h"

namespace graze {

/// Features by name, as bits 1 << Feature. A collider is meant in none, some or all (~0u) of its features.
struct Parts {
  std::vector<unsigned> features;  // per collider of the Model
};

/// Whether a point of two colliders with these features is one of two parts', in either order.
inline bool meant(const Parts& first, const Parts& second, int a, Feature feature_a, int b, Feature feature_b) {
  const unsigned in_a = 1u << static_cast<unsigned>(feature_a), in_b = 1u << static_cast<unsigned>(feature_b);
  return ((first.features[a] & in_a) && (second.features[b] & in_b)) ||
         ((second.features[a] & in_a) && (first.features[b] & in_b));
}

class Clearance {
 public:
  /// The pairs of the Model that have a part of `first` and one of `second`. A gap counts for the features on which its
  /// nearest points lie. `within`: how far it is measured, m.
  Clearance(const Model& nominal, Parts first, Parts second, double within);

  /// A fresh trace in a lane, of a particle with this p*.
  void start(int lane, const Model& model);
  /// The least gap in some lanes after a step, or `within` where it is more. `enough` (per lane, m; null: within):
  /// where the gap is no less than this, `within` may be given instead. Does not depend on what was asked before, but
  /// for speed. `part` (may be null): the pair of colliders that the gap is between, the first of several, as
  /// a * colliders + b with a < b; -1 where `within` was given. `moves` (null: it looks at every call by itself): of
  /// at least bodies(), started wherever this is and told of each new state; the same at every call.
  void least(const BlockState& state, LaneMask lanes, const double* enough, double* out, double* part = nullptr,
             BodyMoves* moves = nullptr);

  /// Two colliders that are in each other, a < b, and how far, m.
  struct Overlap {
    int a, b;
    double depth;
  };
  /// All pairs that overlap in one lane, in the order of Model::pairs, whatever their features. For looking once: the
  /// lane then begins anew.
  std::vector<Overlap> overlaps(const BlockState& state, int lane);

  double within() const { return within_; }
  /// Pairs that are looked at.
  std::size_t pairs() const { return pairs_.size(); }
  /// That move, of these pairs.
  const std::vector<int>& bodies() const { return bodies_; }

 private:
  using Row = std::array<double, kLanes>;
  struct Solid {
    int collider;
    int place;  // of its body in travel_
    ShapeKind kind;
    std::array<std::shared_ptr<const HeightGrid>, kLanes> grid;  // of terrain: each lane's own
    HullArrays hull;                                             // of meshes, whose frame is at its centre
    BlockArray X_BG{12}, size{3}, pose{12};
    long posed = 0;  // the look of which `pose` is
  };
  struct Pair {
    int a, b;     // solids
    bool ground;  // one is a heightfield
  };

  int solid_of(const Model& nominal, int collider);
  void move(const BlockState& state, BodyMoves* moves);
  void look(const BlockState& state, unsigned wanted, Row& least, Row& least_pair);
  const double* pose_of(Solid& solid, const BlockState& state) const;
  void measure(int pair, const BlockState& state, unsigned wanted, Row& least);
  unsigned find_points(int pair, const double* pose_a, const double* pose_b, unsigned wanted, const Row& enough,
                       Row& bound);
  void take_points(const Pair& pair, unsigned wanted, Row& bound, Row& least) const;
  void take_terrain(const Pair& pair, const double* pose_a, const double* pose_b, unsigned wanted, Row& bound,
                    Row& least) const;

  const LaneKernel* kernel_;
  Parts first_, second_;
  double within_;
  int colliders_;  // of the Model
  std::vector<Solid> solids_;
  std::vector<std::array<HeightView, kLanes>> views_;  // per solid, of terrain
  std::vector<HullView> hull_views_;                   // per solid
  std::vector<Pair> pairs_;
  // What a gap that was measured once says of later ones, as the kernels take it (gaps.h).
  std::vector<int> bodies_;       // that move
  std::vector<int> rows_;         // per body: in the moves that are used
  std::optional<BodyMoves> own_;  // where no others are given
  BlockArray radius_;             // per body
  BlockArray travel_;             // the world's, which is 0; per body
  std::vector<int> places_;       // per pair: of both bodies in travel_
  BlockArray reserve_;            // per pair: the gap is no less than this minus both travels
  BlockArray axis_;               // 3 per pair
  Row lowest_{};                  // no more than any pair's gap
  LaneMask fresh_;                // lanes in which nothing has been seen yet
  long looks_ = 0;
  std::vector<int> due_;  // room for the pairs
  std::vector<unsigned> due_lanes_;
  BlockArray manifold_;
};

}  // namespace graze
