#pragma once
// Ground that is drawn instead of measured: heights whose spectrum is a power law between two wavelengths. A particle
// has a ground of its own by the number that its phases are keyed by.
//
// The field is one period of a sum of plane waves, those with a whole number of periods along x and along y whose
// length lies between `shortest` and `longest`:
//   h(x, y) = sum_k A_k cos(2 pi (i_k x / L_x + j_k y / L_y) + phi_k),   A_k^2 ~ nu_k^-(exponent + 1)
// with nu_k the wave's number of periods per metre. The power per area of the plane of wavenumbers falls with
// `exponent` + 1, and so that along a straight line with `exponent` (ISO 8608 describes roads by such, with 2). The
// amplitudes are certain and the phases drawn, so the mean over the field is 0 and the root mean square `rms`, exactly.

#include <cstddef>
#include <vector>

namespace graze {

struct Spectrum {
  double rms = 0.01;                   // m, of the heights over the whole field
  double longest = 1, shortest = 0.1;  // m, of the waves
  double exponent = 2;                 // of the power spectral density along a line
  double seed = 0;                     // any number; another one gives another ground, whatever the difference
};

/// Bounds of Spectrum::exponent.
inline constexpr double kLeastExponent = 0, kMostExponent = 10;
/// Multiplications that one ground may take, as spectrum_work() counts them; some 40 ms.
inline constexpr double kMostSpectrumWork = 1e8;

/// Multiplications for a grid of nx by ny heights at the shortest wavelength that it can have, two cells.
double spectrum_work(int nx, int ny);
/// What a grid can have, m.
struct SpectrumLimits {
  double rms;       // at most: no height is beyond kMaxLength, whatever the waves
  double longest;   // at most: the field's longer side
  double shortest;  // at least: two cells, those of the side that has longer ones
};
SpectrumLimits spectrum_limits(int nx, int ny, double length_x, double length_y);

/// Heights [iy][ix] of a grid of nx by ny points, from rim to rim of a field of length_x by length_y (m). The last row
/// and column are the first ones again. A wave has the same phase on every grid: a finer one sees the same ground.
/// Throws InputError if `shortest` is not less than `longest`, and if no wave between them fits the field.
std::vector<double> spectral_heights(const Spectrum& spectrum, int nx, int ny, double length_x, double length_y);

}  // namespace graze
