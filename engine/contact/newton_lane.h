#pragma once
// One lane's contacts and joints, taken out of all lanes' for Newton's method, and its results put back.

#include <type_traits>

#include "engine/contact/newton.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline double number_of(const T& all, int lane) {
  return reinterpret_cast<const double*>(&all)[lane];
}
template <class T>
inline void set_number(T& all, int lane, double value) {
  reinterpret_cast<double*>(&all)[lane] = value;
}
template <class T>
inline Vec3T<double> numbers_of(const Vec3T<T>& all, int lane) {
  return {number_of(all.x, lane), number_of(all.y, lane), number_of(all.z, lane)};
}
template <class T>
inline void set_numbers(Vec3T<T>& all, int lane, const Vec3T<double>& value) {
  set_number(all.x, lane, value.x), set_number(all.y, lane, value.y), set_number(all.z, lane, value.z);
}

/// Lays out the problem of a lane in NewtonMemory.
template <class T>
class NewtonLane {
 public:
  NewtonLane(const ContactLawT<T>& law, const ConstraintsT<T>& set, const NewtonT<T>& newton, int lane)
      : set_(set), lane_(lane), numbers_(newton.memory.numbers), indices_(newton.memory.indices) {
    const int nv = newton.nv;
    p_.nv = nv;
    p_.width = 8 * static_cast<int>(eights(static_cast<std::size_t>(nv)));
    p_.convex = number_of(law.convex, lane) > 0.0;
    p_.H = reserve(nv * p_.width);  // assemble() clears it
    double** rows[] = {&p_.D, &p_.inverse_D, &p_.free, &p_.gradient, &p_.step, &p_.z, &p_.trial, &p_.start};
    for (double** row : rows) *row = take(p_.width);
    double energy = 0.0, mass = 0.0;
    for (int k = 0; k < nv; ++k) {
      p_.inverse_D[k] = number_of(newton.inverse_D[k], lane);
      p_.D[k] = p_.inverse_D[k] > 0.0 ? 1.0 / p_.inverse_D[k] : 1.0;
      p_.free[k] = number_of(newton.free[k], lane);
      if (!(p_.inverse_D[k] > 0.0)) continue;
      const double before = number_of(newton.start[k], lane), after = before + p_.free[k];
      energy = fma(p_.D[k], max(before * before, after * after), energy);
      mass += p_.D[k];
    }
    p_.momentum = sqrt(energy * mass);
    p_.filled = reinterpret_cast<std::uint64_t*>(take(nv * kDofWords));
    columns_of_ = take_indices(nv);
    count_rows();
    lay_out(
        set.contacts, set.contact_count, p_.contact_count, 3,
        [&](const ContactT<T>& c) -> const PathView& { return set.paths[c.path]; }, p_.contacts, p_.contact_packs);
    lay_out(
        set.joints, set.joint_count, p_.joint_count, 1,
        [](const JointRowT<T>& joint) -> const JointRowT<T>& { return joint; }, p_.joints, p_.joint_packs);
    find_pattern();
  }

  NewtonProblem& problem() { return p_; }

  /// At the impulses of contacts and joints, and the change of L v that goes with them.
  void begin(const T* dz) {
    for (int k = 0; k < p_.nv; ++k) p_.z[k] = number_of(dz[k], lane_);
  }
  /// With no impulses.
  void begin_at_rest() {
    for (int k = 0; k < p_.nv; ++k) p_.z[k] = p_.free[k];
    const Eight zero(0.0);
    for (int i = 0; i < (p_.contact_count + 7) / 8; ++i) p_.contact_packs[i].kept = {zero, zero, zero};
    for (int i = 0; i < (p_.joint_count + 7) / 8; ++i) {
      for (Eight& kept : p_.joint_packs[i].kept) kept = zero;
    }
  }

 private:
  double* reserve(int count) {
    double* place = numbers_;
    numbers_ += (count + 7) / 8 * 8;
    return place;
  }
  /// Filled with zeros.
  double* take(int count) {
    double* place = reserve(count);
    for (double* p = place; p != numbers_; ++p) *p = 0.0;
    return place;
  }
  int* take_indices(int count) {
    int* place = indices_;
    indices_ += count;
    return place;
  }

  void count_rows() {
    const unsigned bit = 1u << lane_;
    p_.contact_count = p_.joint_count = 0;
    for (int i = 0; i < set_.contact_count; ++i) p_.contact_count += (set_.contacts[i].lanes & bit) != 0;
    for (int i = 0; i < set_.joint_count; ++i) p_.joint_count += (set_.joints[i].lanes & bit) != 0;
  }

  template <class S>
  S* take_array(int count, std::size_t doubles) {
    return reinterpret_cast<S*>(take(count * static_cast<int>(doubles)));
  }

  /// The blocks of a row, those of the row before if it moves by the same degrees of freedom; room for y.
  void lay_out_row(NewtonRow& row, const NewtonRow* before, int count, const int* dofs, int directions) {
    const int blocks = p_.width / 8;
    row.count = count, row.dofs = dofs;
    if (before && before->dofs == dofs && before->count == count) {
      row.blocks = before->blocks, row.block = before->block, row.place = before->place;
    } else {
      int *place = take_indices(blocks), *block = take_indices(blocks);
      for (int b = 0; b < blocks; ++b) place[b] = -1;
      for (int i = 0; i < count; ++i) place[dofs[i] / 8] = 0;
      row.blocks = 0;
      for (int b = 0; b < blocks; ++b) {
        if (place[b] < 0) continue;
        place[b] = row.blocks;
        block[row.blocks++] = b;
      }
      row.block = block, row.place = place;
    }
    row.y = take(8 * directions * row.blocks);
  }

  /// Which degrees of freedom some of a pack's rows move; columns_of_ says where each is.
  int find_columns(const NewtonRow* rows, int count, int* dofs) {
    for (int k = 0; k < p_.nv; ++k) columns_of_[k] = -1;
    int found = 0;
    for (int i = 0; i < count; ++i) {
      if (i > 0 && rows[i].dofs == rows[i - 1].dofs && rows[i].count == rows[i - 1].count) continue;
      for (int a = 0; a < rows[i].count; ++a) {
        int& column = columns_of_[rows[i].dofs[a]];
        if (column >= 0) continue;
        column = found;
        dofs[found++] = rows[i].dofs[a];
      }
    }
    return found;
  }

  /// Rows and packs of those of `all` that are in the lane. dofs_of: what moves one, as something with count and dofs.
  template <class Pack, class Constraint, class DofsOf>
  void lay_out(const Constraint* all, int total, int count, int directions, const DofsOf& dofs_of, NewtonRow*& rows,
               Pack*& packs) {
    using Column = std::remove_pointer_t<decltype(Pack::columns)>;
    rows = take_array<NewtonRow>(count, kNewtonRow);
    packs = take_array<Pack>((count + 7) / 8, kNewtonEight);
    int* source = take_indices(count);
    for (int i = 0, n = 0; i < total; ++i) {
      if (!(all[i].lanes >> lane_ & 1u)) continue;
      const auto& path = dofs_of(all[i]);
      lay_out_row(rows[n], n > 0 ? &rows[n - 1] : nullptr, path.count, path.dofs, directions);
      source[n++] = i;
    }
    for (int first = 0; first < count; first += 8) {
      Pack& pack = packs[first / 8];
      pack.first = first, pack.count = count - first < 8 ? count - first : 8;
      int* dofs = take_indices(p_.nv);
      pack.dof_count = find_columns(rows + first, pack.count, dofs);
      pack.dofs = dofs;
      pack.columns = take_array<Column>(pack.dof_count, sizeof(Column) / sizeof(double));
      leave_open(pack);
      for (int i = 0; i < pack.count; ++i) fill(pack, i, all[source[first + i]]);
    }
  }

  /// What no constraint fills has no impulse; all else is zero.
  static void leave_open(ContactsOfEight& pack) { pack.rn = pack.rt = Eight(1.0); }
  static void leave_open(JointsOfEight& pack) { pack.r = pack.lower_gap = pack.upper_gap = Eight(1.0); }

  void fill(ContactsOfEight& pack, int i, const ContactT<T>& c) {
    const NewtonRow& row = p_.contacts[pack.first + i];
    Vec3T<double> b = numbers_of(c.b, lane_);
    for (int a = 0; a < row.count; ++a) {
      const int dof = row.dofs[a];
      const Vec3T<double> y = numbers_of(c.y[a], lane_);
      if (!(p_.inverse_D[dof] > 0.0)) {  // moves as it moves, whatever the impulses
        b = axpy(p_.free[dof], y, b);
        continue;
      }
      row.at(0, dof) = y.x, row.at(1, dof) = y.y, row.at(2, dof) = y.z;
      set_numbers(pack.columns[columns_of_[dof]], i, y);
    }
    set_numbers(pack.b, i, b);
    set_numbers(pack.kept, i, numbers_of(c.lambda, lane_));
    const double ann = number_of(c.ann, lane_), ass = number_of(c.ass, lane_), att = number_of(c.att, lane_);
    const double guard = number_of(c.guard, lane_);
    set_number(pack.friction, i, number_of(c.friction, lane_));
    set_number(pack.compliance, i, number_of(c.compliance, lane_));
    set_number(pack.guard, i, guard);
    set_number(pack.felt, i, number_of(c.phi, lane_) < -number_of(c.deep, lane_) ? 0.0 : guard);
    // The convex model projects on a cone and has one R for both.
    const double all = (1.0 / 3.0) * (ann + ass + att);
    set_number(pack.rn, i, p_.convex ? all : ann);
    set_number(pack.rt, i, p_.convex ? all : max(ass, att));
  }

  void fill(JointsOfEight& pack, int i, const JointRowT<T>& joint) {
    const NewtonRow& row = p_.joints[pack.first + i];
    double b = number_of(joint.b, lane_);
    for (int a = 0; a < row.count; ++a) {
      const int dof = row.dofs[a];
      const double y = number_of(joint.y[a], lane_);
      if (!(p_.inverse_D[dof] > 0.0)) {
        b = fma(p_.free[dof], y, b);
        continue;
      }
      row.at(0, dof) = y;
      set_number(pack.columns[columns_of_[dof]], i, y);
    }
    set_number(pack.b, i, b);
    set_number(pack.r, i, 1.0 / number_of(joint.inverse_a, lane_));
    const auto copy = [&](Eight& to, const T& from) { set_number(to, i, number_of(from, lane_)); };
    copy(pack.lower_gap, joint.lower_gap), copy(pack.upper_gap, joint.upper_gap);
    copy(pack.dry_gap, joint.dry_gap), copy(pack.dry_compliance, joint.dry_compliance);
    copy(pack.dry_low, joint.dry_low), copy(pack.dry_high, joint.dry_high);
    copy(pack.kept[0], joint.lower), copy(pack.kept[1], joint.upper), copy(pack.kept[2], joint.dry);
  }

  std::uint64_t* filled(int dof) const { return p_.filled + kDofWords * dof; }

  /// Marks the degrees of freedom that a row moves, all with all.
  void mark(const NewtonRow& row) {
    std::uint64_t all[kDofWords] = {};
    for (int a = 0; a < row.count; ++a) all[row.dofs[a] / 64] |= std::uint64_t{1} << (row.dofs[a] % 64);
    for (int a = 0; a < row.count; ++a) {
      for (int w = 0; w < kDofWords; ++w) filled(row.dofs[a])[w] |= all[w];
    }
  }
  void mark(const NewtonRow* rows, int count) {
    for (int i = 0; i < count; ++i) {
      if (i == 0 || rows[i].dofs != rows[i - 1].dofs || rows[i].count != rows[i - 1].count) mark(rows[i]);
    }
  }

  /// Where H may be other than zero, and what elimination fills.
  void find_pattern() {
    mark(p_.contacts, p_.contact_count);
    mark(p_.joints, p_.joint_count);
    const int stride = p_.nv + p_.width / 8 + 2;
    p_.ancestors = take_indices(p_.nv * stride);
    p_.active = take_indices(p_.nv + 1);
    p_.active[0] = 0;
    for (int k = p_.nv - 1; k >= 0; --k) {
      std::uint64_t* row = filled(k);
      if (!(row[k / 64] >> (k % 64) & 1u)) continue;
      p_.active[++p_.active[0]] = k;
      for (int w = k / 64 + 1; w < kDofWords; ++w) row[w] = 0;
      row[k / 64] &= (std::uint64_t{1} << (k % 64)) - 1;
      list_ancestors(row, p_.ancestors + stride * k);
    }
  }

  /// Their rows come to share what this one has.
  void list_ancestors(const std::uint64_t* row, int* list) {
    int count = 0, blocks = 0, last = -1;
    for (int w = 0; w < kDofWords; ++w) {
      for (std::uint64_t rest = row[w]; rest != 0; rest &= rest - 1) {
        const int j = 64 * w + __builtin_ctzll(rest);
        list[++count] = j;
        for (int v = 0; v < kDofWords; ++v) filled(j)[v] |= row[v];
      }
    }
    list[0] = count;
    int* block = list + count + 1;
    for (int i = 1; i <= count; ++i) {
      if (list[i] / 8 != last) block[++blocks] = last = list[i] / 8;
    }
    block[0] = blocks;
  }

  const ConstraintsT<T>& set_;
  int lane_;
  double* numbers_;
  int* indices_;
  int* columns_of_;
  NewtonProblem p_;
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
