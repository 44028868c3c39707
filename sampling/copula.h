#pragma once
// Gaussian copula: coordinates of the unit cube that vary together while each stays uniform.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace graze {

/// Lower Cholesky factor of a correlation matrix (its lower half is read). Returns -1, or the first row whose pivot is
/// not positive to working precision: the leading minor of order row + 1 is then not positive.
int correlation_factor(const Eigen::MatrixXd& correlation, Eigen::MatrixXd& factor);

/// Replaces the coordinates `members` of u by Phi(L Phi^-1(u)). If C = L L^T, the rank (Spearman) correlation of
/// coordinates i and j becomes (6 / pi) asin(C_ij / 2). The first member keeps its value.
void correlate(const Eigen::MatrixXd& factor, const std::vector<int>& members, std::span<double> u);

/// Makes row i of `scores` (independent standard normals, [member][particle]) the normal score of member i, the rows
/// before it included: L times each column.
void correlate_scores(const Eigen::MatrixXd& factor, std::vector<std::vector<double>>& scores);

/// Place of each number in ascending order, 0 … n-1; equal ones in the order of their indices. n < 2^32.
std::vector<std::uint32_t> ranks_of(const std::vector<double>& numbers);

}  // namespace graze
