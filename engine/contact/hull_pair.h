#pragma once
// A convex hull and another convex shape: sphere, capsule, cylinder, box or hull. The exact gap (core_gap.h), and where
// faces or edges lie on each other the points that span that (hull_faces.h).

#include "engine/contact/core_gap.h"
#include "engine/contact/hull_faces.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// The deepest point goes in with its own gap, in place of the slot that is nearest to it; into the first slot if there
/// is none.
template <class T>
inline void put_gap(const T& phi, const Vec3T<T>& n, const Vec3T<T>& p, const T& margin, ManifoldT<T>& out) {
  constexpr double kSteep = 1e-3;  // as in SpreadT
  T least(1e300), slot(-1.0);
  for (int k = 0; k < out.count; ++k) {
    const mask_of<T> deeper = out.point[k].valid & (out.point[k].phi < least);
    least = select(deeper, out.point[k].phi, least);
    slot = select(deeper, T(k), slot);
  }
  const mask_of<T> wanted = phi < margin, alone = slot < T(0.0);
  slot = max(slot, T(0.0));
  for (int k = 0; k < out.count; ++k) {
    const mask_of<T> here = wanted & (slot == T(k)) & (alone | (phi < least - T(kSamePoint)));
    const Vec3T<T> own = out.point[k].p;
    const mask_of<T> elsewhere = alone | (least - phi > T(kSteep) * sqrt(norm2(p - own)));
    put_where<T>(out, k, here, phi, select(elsewhere, p, own), n);
  }
}

/// `b` is the hull. Slots belong to directions of its frame, so that they stay while the shapes rock or slide.
template <class T>
GRAZE_OUT_OF_LINE void hull_pair(ShapeKind kind, const ShapeT<T>& sa, const PoseT<T>& Xa, const ShapeT<T>& sb,
                                 const PoseT<T>& Xb, const T& margin, ManifoldT<T>& out) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  const CoreT<T> a{kind, sa, {Xa.R, Xa.p - Xb.p}}, b{kinds::mesh, sb, {Xb.R, zero}};
  const CoreGapT<T> gap = gap_of_cores(a, b, margin);
  nothing(out);
  out.axis = gap.n;
  const mask_of<T> near = gap.phi < margin;
  if (!any(near)) return;
  const AcrossT<T> across(Xb.R, gap.n);
  const Vec3T<T> middle = T(0.5) * (gap.p_a + gap.p_b);
  const T radius = min(a.radius(), b.radius()), slope = min(max(margin, T(kLeastReach)) / radius, T(kAlongContact));
  const TouchFrameT<T> frame{across.x, across.y, gap.n, middle, slope, near};
  const OutlineT<T> on_a = outline_of(a, frame, -1.0), on_b = outline_of(b, frame, 1.0);
  const T wanted = select(near, margin, T(-1e300));
  const CommonPointsT<T> common(on_a, on_b, frame, gap.phi, wanted);
  SpreadT<T> spread(across, radius, wanted);
  common.show_edges(on_a, InsideT<T>(on_b), 0, spread);
  common.show_edges(on_b, InsideT<T>(on_a), 2 * kOutlineWays, spread);
  spread.write(out);
  put_gap(gap.phi, gap.n, middle, margin, out);
  for (int k = 0; k < out.count; ++k) out.point[k].p += Xb.p;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
