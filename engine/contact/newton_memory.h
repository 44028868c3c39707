#pragma once
// Memory of Newton's method for contacts (newton.h): plain numbers, so that what allocates it need not know of lanes.

#include <cstddef>

#include "engine/model/newton_limit.h"

namespace graze {

/// Working memory of one lane's solve, reused by all lanes. `numbers` begins on a cache line.
struct NewtonMemory {
  double* numbers = nullptr;
  int* indices = nullptr;
  double* rows = nullptr;  // of all lanes; begins on a cache line
};

/// Doubles of a register of eight contacts or joints with its pointers, and of a row: bounds, which newton.h checks.
inline constexpr std::size_t kNewtonEight = 256, kNewtonRow = 8;
/// Words of a set of degrees of freedom.
inline constexpr int kDofWords = static_cast<int>((kMostNewtonDofs + 63) / 64);

constexpr std::size_t eights(std::size_t count) { return (count + 7) / 8; }

/// Doubles of NewtonMemory for so many degrees of freedom, contacts and joint rows.
constexpr std::size_t newton_numbers(std::size_t nv, std::size_t contacts, std::size_t joints) {
  const std::size_t width = 8 * eights(nv), packs = eights(contacts) + eights(joints);
  const std::size_t columns = 8 * nv * (3 * eights(contacts) + eights(joints));
  return nv * width + 8 * width + nv * kDofWords + packs * kNewtonEight + (contacts + joints) * kNewtonRow + columns +
         (3 * contacts + joints) * width + 64;
}

/// Likewise ints.
constexpr std::size_t newton_indices(std::size_t nv, std::size_t contacts, std::size_t joints) {
  const std::size_t packs = eights(contacts) + eights(joints);
  return packs * nv + (contacts + joints) * (2 * eights(nv) + 1) + nv * (nv + eights(nv) + 2) + 2 * nv + 1;
}

/// Rows of newton_tree.h per degree of freedom, body, contact and joint row: sizes of its structs, which it checks.
inline constexpr std::size_t kTreeDof = 6, kTreeBody = 68, kTreeContact = 23, kTreeJoint = 9;

/// Rows of W lanes likewise.
constexpr std::size_t tree_rows(std::size_t nv, std::size_t bodies, std::size_t contacts, std::size_t joints) {
  return kTreeDof * nv + kTreeBody * bodies + kTreeContact * contacts + kTreeJoint * joints;
}

}  // namespace graze
