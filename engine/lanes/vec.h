#pragma once
// Vectors, rotations and poses of kernels: T is double or a Pack. Sums run in a fixed order with fma written out.

#include "engine/lanes/pack.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct Vec3T {
  T x, y, z;

  friend Vec3T operator+(const Vec3T& a, const Vec3T& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3T operator-(const Vec3T& a, const Vec3T& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3T operator-(const Vec3T& a) { return {-a.x, -a.y, -a.z}; }
  friend Vec3T operator*(const T& s, const Vec3T& a) { return {s * a.x, s * a.y, s * a.z}; }
  friend Vec3T operator*(const Vec3T& a, const T& s) { return s * a; }
  Vec3T& operator+=(const Vec3T& b) { return *this = *this + b; }
  Vec3T& operator-=(const Vec3T& b) { return *this = *this - b; }
};

template <class T>
inline T dot(const Vec3T<T>& a, const Vec3T<T>& b) {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
/// dot(a, b) + c
template <class T>
inline T dot_add(const Vec3T<T>& a, const Vec3T<T>& b, const T& c) {
  return fma(a.z, b.z, fma(a.y, b.y, fma(a.x, b.x, c)));
}
template <class T>
inline Vec3T<T> cross(const Vec3T<T>& a, const Vec3T<T>& b) {
  return {fnma(a.z, b.y, a.y * b.z), fnma(a.x, b.z, a.z * b.x), fnma(a.y, b.x, a.x * b.y)};
}
/// cross(a, b) + c
template <class T>
inline Vec3T<T> cross_add(const Vec3T<T>& a, const Vec3T<T>& b, const Vec3T<T>& c) {
  return {fnma(a.z, b.y, fma(a.y, b.z, c.x)), fnma(a.x, b.z, fma(a.z, b.x, c.y)), fnma(a.y, b.x, fma(a.x, b.y, c.z))};
}
/// s a + b
template <class T>
inline Vec3T<T> axpy(const T& s, const Vec3T<T>& a, const Vec3T<T>& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}
template <class T>
inline T norm2(const Vec3T<T>& a) {
  return dot(a, a);
}
template <class T>
inline Vec3T<T> select(const mask_of<T>& mask, const Vec3T<T>& a, const Vec3T<T>& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
template <class T>
inline Vec3T<T> load_vec3(const double* p) {
  return {load<T>(p), load<T>(p + kWidth<T>), load<T>(p + 2 * kWidth<T>)};
}

/// A rotation matrix (or any 3 x 3 matrix), row-major.
template <class T>
struct RotT {
  T m[9];

  Vec3T<T> column(int j) const { return {m[j], m[3 + j], m[6 + j]}; }
  Vec3T<T> row(int i) const { return {m[3 * i], m[3 * i + 1], m[3 * i + 2]}; }

  friend Vec3T<T> operator*(const RotT& R, const Vec3T<T>& a) {
    return {dot(R.row(0), a), dot(R.row(1), a), dot(R.row(2), a)};
  }
  friend RotT operator*(const RotT& A, const RotT& B) {
    RotT out;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) out.m[3 * i + j] = dot(A.row(i), B.column(j));
    }
    return out;
  }
};

/// R^T a
template <class T>
inline Vec3T<T> transposed_times(const RotT<T>& R, const Vec3T<T>& a) {
  return {dot(R.column(0), a), dot(R.column(1), a), dot(R.column(2), a)};
}
/// A^T B
template <class T>
inline RotT<T> transposed_times(const RotT<T>& A, const RotT<T>& B) {
  RotT<T> out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.m[3 * i + j] = dot(A.column(i), B.column(j));
  }
  return out;
}

template <class T>
struct PoseT {
  RotT<T> R;
  Vec3T<T> p;

  friend Vec3T<T> operator*(const PoseT& X, const Vec3T<T>& a) {
    return {dot_add(X.R.row(0), a, X.p.x), dot_add(X.R.row(1), a, X.p.y), dot_add(X.R.row(2), a, X.p.z)};
  }
  friend PoseT operator*(const PoseT& A, const PoseT& B) { return {A.R * B.R, A * B.p}; }
};

/// Twelve quantities from p: R row by row, then the position.
template <class T>
inline PoseT<T> load_pose(const double* p) {
  PoseT<T> X;
  for (int i = 0; i < 9; ++i) X.R.m[i] = load<T>(p + i * kWidth<T>);
  X.p = load_vec3<T>(p + 9 * kWidth<T>);
  return X;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
