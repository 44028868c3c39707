#include "engine/model/spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "engine/lanes/scalar.h"
#include "engine/model/limits.h"
#include "engine/settings/settings.h"
#include "sampling/elementary.h"
#include "sampling/stream.h"

namespace graze {
namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;
constexpr double kAtBound = 1e-12;  // of wavelengths and their squares: those at a bound are in

/// One wave as A cos(theta + phi) = even cos(theta) - odd sin(theta), theta = 2 pi (i x / L_x + j y / L_y).
struct Wave {
  int i, j;  // periods along x and y; j >= 0
  double even, odd;
};

/// The waves of a band by rising j, then i; of each pair (i, j), (-i, -j) one. `nx`, `ny`: cells; waves of two cells
/// and less are left out, which the grid does not tell from others.
class Band {
 public:
  Band(const Spectrum& spectrum, int nx, int ny, double length_x, double length_y)
      : spectrum_(spectrum), length_x_(length_x), length_y_(length_y) {
    for (int j = 0; 2 * j < ny && !beyond(0, j); ++j) {
      int most = 0;
      while (2 * (most + 1) < nx && !beyond(most + 1, j)) ++most;
      for (int i = j == 0 ? 1 : -most; i <= most; ++i) add(i, j);
    }
  }

  /// With the amplitudes that make the root mean square.
  std::vector<Wave> waves() && {
    const double factor = spectrum_.rms / std::sqrt(power_);
    for (Wave& wave : waves_) wave.even *= factor, wave.odd *= factor;
    return std::move(waves_);
  }
  bool empty() const { return waves_.empty(); }

 private:
  double squared_number(int i, int j) const {
    const double x = i / length_x_, y = j / length_y_;
    return x * x + y * y;
  }
  bool beyond(int i, int j) const {
    return squared_number(i, j) * spectrum_.shortest * spectrum_.shortest > 1 + kAtBound;
  }

  void add(int i, int j) {
    const double in_longest = squared_number(i, j) * spectrum_.longest * spectrum_.longest;
    if (in_longest < 1 - kAtBound) return;
    static const std::uint64_t name = name_hash("heightfield.spectrum");
    const std::uint64_t key = std::bit_cast<std::uint64_t>(spectrum_.seed == 0 ? 0.0 : spectrum_.seed);  // -0 is 0
    const double phase = kWholeTurn * uniform(key, static_cast<std::uint32_t>(i), name, static_cast<std::uint32_t>(j));
    const double amplitude = pinned::exp(-0.25 * (spectrum_.exponent + 1) * pinned::log(in_longest));
    const pinned::SineCosine turned = pinned::sin_cos(phase);
    waves_.push_back({i, j, amplitude * turned.cosine, amplitude * turned.sine});
    power_ += 0.5 * amplitude * amplitude;
  }

  const Spectrum& spectrum_;
  double length_x_, length_y_;  // m
  std::vector<Wave> waves_;
  double power_ = 0;  // mean square
};

/// Cosines and sines of n equal parts of a turn.
struct Circle {
  std::vector<double> cosine, sine;

  explicit Circle(int n) {
    for (int k = 0; k < n; ++k) {
      const pinned::SineCosine at = pinned::sin_cos(kWholeTurn * k / n);
      cosine.push_back(at.cosine), sine.push_back(at.sine);
    }
  }
};

/// Adds a wave along x to the sums of those with the same j: with theta = 2 pi i x / L_x at the cells of the grid, of
/// A cos(theta + phi) and of A sin(theta + phi).
void add_along_x(const Wave& wave, const Circle& circle, double* even, double* odd) {
  const int n = static_cast<int>(circle.cosine.size());
  const int step = wave.i < 0 ? wave.i + n : wave.i;
  for (int x = 0, at = 0; x < n; ++x) {
    const double c = circle.cosine[at], s = circle.sine[at];
    even[x] += wave.even * c - wave.odd * s;
    odd[x] += wave.even * s + wave.odd * c;
    at += step;
    if (at >= n) at -= n;
  }
}

}  // namespace

double spectrum_work(int nx, int ny) {
  const double x = nx - 1, y = ny - 1;
  return x * y * (x + y);
}

SpectrumLimits spectrum_limits(int nx, int ny, double length_x, double length_y) {
  // Of m waves, of which there are at most half as many as heights, the amplitudes' sum is at most sqrt(2 m) rms.
  return {kMaxLength / std::sqrt(static_cast<double>(nx) * ny), std::max(length_x, length_y),
          2 * std::max(length_x / (nx - 1), length_y / (ny - 1)) * (1 - kAtBound)};
}

std::vector<double> spectral_heights(const Spectrum& spectrum, int nx, int ny, double length_x, double length_y) {
  assert(nx >= 2 && ny >= 2);
  if (!(spectrum.shortest < spectrum.longest)) {
    throw InputError(fmt::format("waves of {:g} to {:g} m: the longest must be longer than the shortest",
                                 spectrum.shortest, spectrum.longest));
  }
  const int x_cells = nx - 1, y_cells = ny - 1;
  Band band(spectrum, x_cells, y_cells, length_x, length_y);
  if (band.empty()) {
    throw InputError(
        fmt::format("no wave of {:g} to {:g} m has a whole number of periods in {:g} x {:g} m; make the "
                    "field larger or the band wider",
                    spectrum.shortest, spectrum.longest, length_x, length_y));
  }
  const std::vector<Wave> waves = std::move(band).waves();
  const Circle x_circle(x_cells), y_circle(y_cells);
  std::vector<double> out(static_cast<std::size_t>(nx) * ny, 0.0);
  std::vector<double> even(x_cells), odd(x_cells);
  for (std::size_t k = 0; k < waves.size();) {
    const int j = waves[k].j;
    std::fill(even.begin(), even.end(), 0.0);
    std::fill(odd.begin(), odd.end(), 0.0);
    for (; k < waves.size() && waves[k].j == j; ++k) add_along_x(waves[k], x_circle, even.data(), odd.data());
    for (int y = 0, at = 0; y < y_cells; ++y) {
      const double c = y_circle.cosine[at], s = y_circle.sine[at];
      double* row = out.data() + static_cast<std::size_t>(y) * nx;
      for (int x = 0; x < x_cells; ++x) row[x] += c * even[x] - s * odd[x];
      at = (at + j) % y_cells;
    }
  }
  for (int y = 0; y < y_cells; ++y) {
    double* row = out.data() + static_cast<std::size_t>(y) * nx;
    row[x_cells] = row[0];
  }
  std::copy_n(out.begin(), nx, out.end() - nx);
  return out;
}

}  // namespace graze
