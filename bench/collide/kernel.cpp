#include "bench/collide/kernel.h"

#include "engine/contact/collide.h"

#if defined(GRAZE_ISA_AVX512)
#define GRAZE_COLLIDE_BLOCKS collide_blocks_avx512
#elif defined(GRAZE_ISA_AVX2)
#define GRAZE_COLLIDE_BLOCKS collide_blocks_avx2
#else
#define GRAZE_COLLIDE_BLOCKS collide_blocks_portable
#endif

namespace graze {

long GRAZE_COLLIDE_BLOCKS(ShapeKind a, ShapeKind b, const HeightView* terrain, const double* data, int blocks) {
  using T = Pack<8>;
  long points = 0;
  for (int block = 0; block < blocks; ++block, data += 8 * kCollideRows) {
    const ShapeT<T> sa{load_vec3<T>(data)}, sb{load_vec3<T>(data + 8 * 15), terrain};
    const PoseT<T> Xa = load_pose<T>(data + 8 * 3), Xb = load_pose<T>(data + 8 * 18);
    ManifoldT<T> manifold;
    collide<T>(a, sa, Xa, b, sb, Xb, T(0.002), manifold);
    for (int k = 0; k < manifold.count; ++k) {
      for (unsigned valid = bits(manifold.point[k].valid); valid != 0; valid &= valid - 1) ++points;
    }
  }
  return points;
}

}  // namespace graze
